"""How is a result told in plain words on a terminal?"""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from identify.natural_units import shown, shown_interval
from rig.tabular import Line, Table
from rig.units import show

if TYPE_CHECKING:
    from identify.explain.explanation import Explanation, Finding
    from identify.identification import Identification, Unidentifiable
    from identify.planning.information import StepInformation
    from identify.trace import Samples
    from rig.calibrating import Calibrated
    from rig.recorded import Recording
    from rig.registry import Attached
    from rig.session import Recorded
    from rig.workflow import Runs

MOST_STEPS = 12


def recorded(done: "Recorded") -> Iterator[str]:
    """Tell how a run ended and where it is."""
    for segment in done.segments:
        total, outcome = segment.recording.u.size, segment.outcome
        kept = f"{outcome.samples} of {total} samples kept"
        yield f"{segment.path}: {f'all {total} samples recorded' if outcome.complete else kept}"
        yield from (f"  {event.kind}: {event.text}" for event in outcome.events if event.kind != "safe")
    if done.segments[0].recording.origin.equipment.calibration:
        yield "  the calibration of the device is kept with it"
    if len(done.segments) > 1:
        yield f"  retried: give all of {' '.join(map(str, done.paths))} to `rig identify` and `rig explain`"


def transcribed(done: "Recorded") -> Iterator[str]:
    """Tell where what crossed the wire is kept."""
    for segment in done.segments:
        kept = bool(segment.recording.transcript)
        yield (f"  {segment.path}: what crossed the wire is its dataset `transcript`" if kept else
               f"  {segment.path}: no transcript, nothing crossed a wire or it found no room")


def calibrated(done: "Calibrated") -> Iterator[str]:
    """Tell what a cable told, and where it is kept."""
    found = done.calibration
    yield f"{done.path}: {found.origin}"
    yield f"  delay     {shown_interval(found.delay, 's')}, time constant {shown_interval(found.time_constant, 's')}"
    if unused := found.delay_not_used():
        yield f"            {unused}"
    yield f"  skew      {shown_interval(found.skew, 'ppm')}"
    yield from (f"  {name}   read {shown_interval(skew, 's')} later" for name, skew in found.input_skews.items())
    yield f"  gain      {shown_interval(found.gain, 'V/V')}, offset {shown_interval(found.offset, 'V')}"
    yield f"  noise     {shown_interval(found.noise, 'V')}"
    yield f"  step      {shown_interval(found.input_step, 'V') if found.input_step else 'the readings lie on no grid'}"
    yield from (f"  warning   {text}" for text in found.warnings)


def imported(recording: "Recording", path: str) -> Iterator[str]:
    """Tell what a table became."""
    first = "at rest" if recording.initial == "rest" else "in motion"
    length = span(recording.u.size / recording.rate_hz)
    yield f"{path}: {recording.u.size} samples at {show(recording.rate_hz, 'Hz')}, {length}"
    yield f"  u {_span(recording.u)}, {recording.intersample} between samples"
    yield f"  y {_span(recording.y)}, {first} at the first sample"
    understood = recording.origin.equipment.settings.get("understood", "")
    yield from (f"  understood  {remark}" for remark in understood.split("; ") if remark)
    yield from (f"  {event.kind}  {event.text}" for event in recording.events if event.kind == "lost")


def exported(recording: "Recording", path: object) -> Iterator[str]:
    """Tell what a recording was written to, and how it is had back."""
    whole = "" if recording.complete else ", an incomplete run"
    yield f"{path}: {recording.u.size} samples at {show(recording.rate_hz, 'Hz')} with all that was recorded{whole}"
    yield f"  back with `rig import {path} --out RUN.h5`, bit for bit"


def _span(signal: "Samples") -> str:
    """Return the least and the largest of a long signal, V, where it is known."""
    import numpy as np

    from identify.trace import blocks

    ends = [(np.fmin.reduce(held), np.fmax.reduce(held)) for held in (signal[a:b] for a, b in blocks(0, signal.size))]
    low, high = np.fmin.reduce([low for low, _ in ends]), np.fmax.reduce([high for _, high in ends])
    return f"{low:.6g} to {high:.6g} V"


def incomplete(runs: "Runs") -> Iterator[str]:
    """Tell of which runs a part is missing."""
    yield from (f"{name}: incomplete, {reason}" for name, reason in runs.incomplete)


def devices(found: "tuple[Attached, ...]") -> Iterator[Line]:
    """Tell what is attached, by identity."""
    yield Table(("", ""), tuple((one.address, str(one.identity or one.problem)) for one in found))


def identified(found: "Identification") -> Iterator[str]:
    """Tell which rig it was, how sure that is, and what cannot be told."""
    from identify.of_device import device_lines
    from identify.page.report import FITTED, block_note, identification_sentence, line_sentence, physics_lines

    yield identification_sentence(found)
    if found.borders:
        yield "  backlash, normalised so that V_p = 1 (the peak of G1 under a step of 1 V) and G2(0) = 1:"
    for name, interval in found.borders.items():
        yield f"    {name}  {shown_interval(interval, 'V' if name.startswith('D') else 'V/V')}"
    if found.bend:
        yield f"  {found.bend.sentence}"
    if line := line_sentence(found.model):
        yield f"  {line}"
    for name, block in zip(("G1", "G2"), found.blocks, strict=True):
        note = block_note(found, name)
        told = f"num {_coefficients(block.num)}, den {_coefficients(block.den)}"
        yield f"  {name}  {told}{f' ({note})' if note else ''}"
    if found.delay.value:
        yield f"  delay in all, given to G2: {shown_interval(found.delay, 's')}"
    yield from (f"  {line}" for line in device_lines([o.trace for o in found.observations]))
    yield from (f"  {name} in {stage}  {values}" for name, stage, values in physics_lines(found.model))
    yield from _step_lines(found.steps)
    yield f"  fit {found.fit_percent:.4g} % of the variation of y; {found.noise_words}"
    yield from untold("what these recordings cannot tell", found.not_identifiable)
    yield from (f"  warning: {text}" for text in found.warnings)
    if found.rms_v > FITTED * found.noise.rms_v:
        yield "  next: `rig explain` with the same recordings looks for what is missing"


def _step_lines(steps: "Sequence[StepInformation]") -> Iterator[str]:
    """Tell what every step brought, in the two estimates it is the largest part of."""
    if len(steps) > 1:
        yield "  which step told what:"
    for step in steps[:MOST_STEPS] if len(steps) > 1 else ():
        shares = sorted(step.shares.items(), key=lambda item: -item[1])[:2]
        told = ", ".join(f"{100.0 * share:.0f} % of {name}" for name, share in shares if share >= 0.01)
        yield f"    {step.label} ({span(step.time_s)})  {told or 'nothing'}"
    if len(steps) > MOST_STEPS:
        yield f"    and {len(steps) - MOST_STEPS} more"


def untold(heading: str, items: "Sequence[Unidentifiable]") -> Iterator[str]:
    """Tell what recordings leave open, and what holds or settles it."""
    if items:
        yield f"  {heading}:"
    for item in items:
        yield f"    {item.what}"
        yield f"      because  {item.because}"
        yield f"      held by  {item.fixed_by}"


def explained(told: "Explanation") -> Iterator[str]:
    """Tell the verdict, the place, the physics, the doubt and the proof."""
    from identify.of_device import device_lines

    yield f"{told.verdict.replace('_', ' ').upper()}. {told.sentence}"
    noise = told.noise.rms_v
    yield (f"  mismatch {shown(told.mismatch_v, 'V', 3)} rms, {told.mismatch_v / noise:.3g} x the noise of "
           f"{shown(noise, 'V', 3)} (from {told.noise.origin})")
    if told.location:
        yield f"  where    stage {told.location.stage}: {told.location.sentence}"
    for finding in told.effects:
        yield from _finding(finding)
    before, after = told.held_out.residuals.before_v, told.held_out.residuals.after_v
    yield (f"  proof    held out ({', '.join(told.held_out.runs) or told.held_out.how}): "
           f"{shown(before, 'V')} before, {shown(after, 'V')} after, noise {shown(noise, 'V')}")
    yield f"  remains  {told.remaining.sentence}"
    yield from (f"  device   {line}" for line in device_lines([o.trace for o in (*told.train, *told.test)]))
    yield from (f"  warning  {text}" for text in told.warnings)


def _finding(finding: "Finding") -> Iterator[str]:
    """Tell one piece of physics."""
    from identify.page.report import finding_lines, percent

    yield f"  what     {finding.id} in {finding.stage} ({percent(finding.probability)}): {finding.sentence}"
    yield from (f"             {name}  {value}" for name, value in finding_lines(finding))
    if finding.could_also_be:
        others = ", ".join(f"{o.id} in {o.stage} ({percent(o.probability)})" for o in finding.could_also_be)
        yield f"           could also be {others}"
    if finding.would_separate:
        yield f"           would separate: {finding.would_separate}"


def span(seconds: float) -> str:
    """Return a duration as a bench operator says it."""
    if seconds < 120.0:
        return shown(seconds, "s")
    return f"{seconds / 60.0:.1f} min" if seconds < 7200.0 else f"{seconds / 3600.0:.1f} h"


def _coefficients(values: tuple[float, ...]) -> str:
    return "[" + ", ".join(f"{value:.6g}" for value in values) + "]"

