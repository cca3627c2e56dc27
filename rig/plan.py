"""Which exact samples does a protocol mean, and may they be played?

Everything that can be refused without a device is refused here, with the file, line and key of the step to blame: a
level over the limit, a slope too steep, a frequency the rate cannot carry, nothing to play, too much to play.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from itertools import pairwise
from math import lcm
from pathlib import Path

import numpy as np

from identify.trace import Samples, Step, frozen
from rig.errors import MisfitError, RefusedError
from rig.limits import Limits
from rig.linearblock import settling_time_s
from rig.protocol import Protocol, ProtocolStep
from rig.recorded import Initial
from rig.signals import AT_ONCE, alike, extremes, first_steeper, joined, steepest
from rig.stimuli import is_whole
from rig.stimulus import MAX_SAMPLES, Drawn, Setting
from rig.yamlfile import parse_yaml

__all__ = ["Limits", "Plan", "plan", "whole_rate_hz"]

LEVEL_SLACK = 1e-9
"""Relative; rounding on the way from text to samples."""
HEADER_BYTES = 65_536


@dataclass(frozen=True)
class Plan:
    """The samples u (N,), V, a device is to play, u[k] from k / rate_hz on, and what to know while it does.

    ``inputs`` are the signals to record, by what is wired to the device's inputs 1, 2, ...; the first is y. ``notes``
    say where the samples are not quite what was asked for. Paths and texts are those of the files read. With
    ``retries`` a run ends where samples are lost, and goes on in a segment of its own (``rig/retry.py``) so many times.
    """

    title: str
    u: Samples
    rate_hz: float
    steps: tuple[Step, ...]
    limits: Limits
    safe_level_v: float = 0.0
    ramp_s: float = 0.1
    protocol_text: str = ""
    question: str = ""
    rig_path: str | None = None
    rig_text: str = ""
    device: str | None = None
    inputs: tuple[str, ...] = ("y",)
    notes: tuple[str, ...] = field(default=())
    initial: Initial = "rest"
    retries: int = 0

    def __post_init__(self) -> None:
        """Freeze the samples: what was checked is what is played."""
        object.__setattr__(self, "u", frozen(self.u))

    @property
    def duration_s(self) -> float:
        """Return how long the plan takes."""
        return self.u.size / self.rate_hz

    @cached_property
    def range_v(self) -> tuple[float, float]:
        """Return the lowest and the highest level of u."""
        found = extremes(self.u)
        return found.low_v, found.high_v

    @property
    def peak_v(self) -> float:
        """Return the largest magnitude of u."""
        return max(map(abs, self.range_v))

    @cached_property
    def slew_v_per_s(self) -> float:
        """Return the steepest slope between two samples, the first taken from the safe level."""
        return steepest(self.u, self.safe_level_v) * self.rate_hz

    @property
    def memory_bytes(self) -> int:
        """Return what the samples take in the computer while they are played: u, the inputs and the ledger.

        Of signals longer than ``AT_ONCE`` there is only a stretch in memory.
        """
        return 8 * (1 + len(self.inputs)) * min(self.u.size, AT_ONCE) + self.u.size

    @property
    def disk_bytes(self) -> int:
        """Return what the recording takes: u, the inputs and the ledger, twice while it is being closed."""
        return 2 * ((9 + 8 * len(self.inputs)) * int(self.u.size) + HEADER_BYTES)


def plan(protocol: Protocol, rate_hz: float | None = None) -> Plan:
    """Return the exact samples of ``protocol``, at ``rate_hz`` where the device cannot make the protocol's own rate.

    Raises RefusedError for what must not or cannot be played.
    """
    rate = protocol.rate_hz if rate_hz is None else rate_hz
    _check_level(protocol.safe_level_v, protocol.limits, _place(protocol, "safe_level"), "the safe level")
    drawn = _draw_all(protocol, rate)
    order = [index for index, step in enumerate(protocol.steps) for _ in range(step.repeats)] * protocol.repeats
    _check_slew(protocol, drawn, order, rate)
    return Plan(
        title=protocol.title, u=joined([drawn[index].u for index in order]), rate_hz=rate,
        steps=_planned(protocol, drawn, order), limits=protocol.limits, safe_level_v=protocol.safe_level_v,
        ramp_s=protocol.ramp_s, protocol_text=protocol.text, question=protocol.question, rig_path=protocol.rig_path,
        rig_text=protocol.rig.text if protocol.rig else "", device=protocol.device,
        inputs=protocol.inputs, notes=_notes(protocol, drawn, rate), retries=protocol.retries,
    )


def whole_rate_hz(periods_s: list[tuple[float, float]], near_hz: float) -> float | None:
    """Return the rate nearest to ``near_hz`` that makes every (frequency in Hz, time in s) whole samples and periods.

    None when there is none within a factor of 2: the times have no common measure, or the frequencies do not fit them.
    """
    times = sorted({time for _, time in periods_s})
    if not times or not all(is_whole(frequency * time) for frequency, time in periods_s):
        return None
    ratios = [Fraction(time / times[0]).limit_denominator(10_000) for time in times]
    if any(not is_whole(time / times[0] / float(ratio)) for time, ratio in zip(times, ratios, strict=True)):
        return None
    step_hz = lcm(*(ratio.denominator for ratio in ratios)) / times[0]
    rate = max(1, round(near_hz / step_hz)) * step_hz
    return rate if near_hz / 2 < rate < 2 * near_hz else None


def _draw_all(protocol: Protocol, rate_hz: float) -> list[Drawn]:
    """Return every step drawn once, in the order of the file, each within the limits."""
    setting = Setting(rate_hz, lambda fraction: _settling_s(protocol, fraction), Path(protocol.path).parent)
    drawn: list[Drawn] = []
    total = 0
    for step in protocol.steps:
        drawn.append(_draw(step, setting))
        total += drawn[-1].u.size * step.repeats * protocol.repeats
        if total > MAX_SAMPLES:
            raise RefusedError("the protocol is too long", where=step.where,
                               value=f"{total / rate_hz:.6g} s up to here",
                               allowed=f"{MAX_SAMPLES / rate_hz:.6g} s ({MAX_SAMPLES} samples) at {rate_hz:g} Hz",
                               do="take fewer repeats, split it, or lower acquisition.rate")
        _check_levels(step, drawn[-1].u, protocol.limits)
    return drawn


def _draw(step: ProtocolStep, setting: Setting) -> Drawn:
    """Return the samples of a step; what cannot be drawn is refused at its place in the file."""
    try:
        return step.stimulus.draw(setting)
    except MisfitError as error:
        raise RefusedError(error.what, where=step.where, value=error.value, allowed=error.allowed,
                           do=error.do) from error


def _settling_s(protocol: Protocol, fraction: float) -> float:
    """Return how long the linear blocks take to settle to ``fraction``; F between them only scales what remains."""
    if protocol.rig is None:
        raise MisfitError("a dwell that waits for settling needs a rig", do="name one under 'rig:', or give a time")
    if protocol.rig.model.unknown:
        raise MisfitError("a dwell that waits for settling needs a rig with values",
                          value=f"{protocol.rig.model.unknown[0]} has none", do="give a time")
    blocks = (protocol.rig.model.g1, protocol.rig.model.g2)
    dead_time_s = sum(block.dead_time_s for block in blocks)
    return settling_time_s([(block.num, block.den) for block in blocks], dead_time_s, fraction)


def _check_levels(step: ProtocolStep, u: Samples, limits: Limits) -> None:
    """Raise RefusedError for a step that leaves the limits, naming the level furthest out."""
    found = extremes(u)
    above, below = found.high_v - limits.high_v, limits.low_v - found.low_v
    _check_level(found.high_v if above >= below else found.low_v, limits, step.where, f"a level of {step.label!r}")


def _check_level(level_v: float, limits: Limits, where: str, what: str) -> None:
    slack = LEVEL_SLACK * max(abs(limits.low_v), abs(limits.high_v))
    if not limits.low_v - slack <= level_v <= limits.high_v + slack:
        raise RefusedError(f"{what} is over the limit", where=where, value=f"{level_v:.6g} V",
                           allowed=limits.levels,
                           do="lower the level, or widen 'limits:' where the rig can take it")


def _check_slew(protocol: Protocol, drawn: list[Drawn], order: list[int], rate_hz: float) -> None:
    """Raise RefusedError where a step, or the jump into it, is steeper than the limit; the run begins at safe level."""
    slew = protocol.limits.slew_v_per_s
    if slew is None:
        return
    _check_ramp(protocol, drawn, slew)
    last = [float(pieces.u[-1:][0]) for pieces in drawn]
    ends = [protocol.safe_level_v, *(last[index] for index in order)]
    for before, index in sorted(set(zip(ends[:-1], order, strict=True)), key=lambda entry: entry[1]):
        slope = steepest(drawn[index].u, before) * rate_hz
        if slope > slew * (1 + LEVEL_SLACK):
            at_s = first_steeper(drawn[index].u, before, slew * (1 + LEVEL_SLACK) / rate_hz) / rate_hz
            raise RefusedError("too steep", where=protocol.steps[index].where,
                               value=f"{slope:.6g} V/s, first at {at_s:.6g} s of the step",
                               allowed=f"{protocol.limits.slope} (limits.slew)",
                               do="go there by a triangle or a linear table, or raise limits.slew")


def _check_ramp(protocol: Protocol, drawn: list[Drawn], slew: float) -> None:
    """Raise RefusedError when the ramp to the safe level, from the level furthest from it, is too steep."""
    found = [extremes(pieces.u) for pieces in drawn]
    furthest_v = max(abs(v - protocol.safe_level_v) for each in found for v in (each.low_v, each.high_v))
    shortest_s = furthest_v / slew
    if protocol.ramp_s < shortest_s * (1 - LEVEL_SLACK):
        raise RefusedError("the ramp to the safe level is too steep", where=_place(protocol, "ramp"),
                           value=f"{furthest_v:.6g} V in {protocol.ramp_s:g} s",
                           allowed=f"{protocol.limits.slope} (limits.slew)",
                           do=f"write 'ramp: {shortest_s:.3g} s' or longer")


def _place(protocol: Protocol, key: str) -> str:
    """Return file, line and key of what stands at the top of the protocol."""
    return parse_yaml(protocol.text, protocol.path).at(key)


def _planned(protocol: Protocol, drawn: list[Drawn], order: list[int]) -> tuple[Step, ...]:
    """Return the passes as they follow each other; those with one label are numbered."""
    _check_labels(protocol, drawn)
    edges = np.cumsum([0, *(drawn[index].u.size for index in order)])
    seen: Counter[str] = Counter()
    planned = []
    for index, (start, stop) in zip(order, pairwise(edges), strict=True):
        step = protocol.steps[index]
        planned.append(Step(step.label, step.stimulus.kind, int(start), int(stop), seen[step.label]))
        seen[step.label] += 1
    return tuple(planned)


def _check_labels(protocol: Protocol, drawn: list[Drawn]) -> None:
    """Raise RefusedError when steps of one label are not the same samples."""
    first: dict[str, Samples] = {}
    for step, pieces in zip(protocol.steps, drawn, strict=True):
        if not alike(first.setdefault(step.label, pieces.u), pieces.u):
            raise RefusedError("two different steps have one label", where=step.where, value=repr(step.label),
                               do="give each its own 'label:'; one label means repeats")


def _notes(protocol: Protocol, drawn: list[Drawn], rate_hz: float) -> tuple[str, ...]:
    """Return where samples differ from what was asked for, and a rate at which they would not."""
    notes = [f"{step.label}: {note}" for step, pieces in zip(protocol.steps, drawn, strict=True)
             for note in (*pieces.notes, *_misfits(pieces, rate_hz))]
    timed = [(frequency, pieces.time_s) for pieces in drawn for frequency in pieces.frequencies_hz]
    if all(is_whole(time * rate_hz) for _, time in timed):
        return tuple(notes)
    better = whole_rate_hz(timed, rate_hz)
    return (*notes, f"acquisition.rate {better:.12g} Hz samples every period exactly" if better
            else "no rate near acquisition.rate samples all these periods exactly")


def _misfits(pieces: Drawn, rate_hz: float) -> Iterator[str]:
    """Yield what does not fit in the time of one step."""
    samples = pieces.time_s * rate_hz
    if pieces.time_s and not is_whole(samples):
        yield f"its whole periods take {samples:.6g} samples, {pieces.u.size} are played"
    for frequency in pieces.frequencies_hz:
        if not is_whole(frequency * pieces.time_s):
            yield f"{frequency:.6g} Hz makes {frequency * pieces.time_s:.6g} periods, not a whole number"
