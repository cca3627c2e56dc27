"""What is to be known first of an identification, an explanation, a comparison?"""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from identify.interval import Interval
from identify.model import Rational
from identify.natural_units import shown, shown_interval
from identify.notebook.glance import Glance

if TYPE_CHECKING:
    from identify.compared.comparison import Comparison
    from identify.explain.explanation import Explanation, Finding
    from identify.identification import Identification

Row = tuple[str, str]


def of_identification(found: "Identification") -> Glance:
    """Return the borders, the blocks and how well they fit."""
    from identify.page.report import identification_sentence, line_sentence, physics_lines

    rows = [(name, _border(name, interval)) for name, interval in found.own_scale.items()]
    if line := line_sentence(found.model):
        rows.append(("F", line))
    rows += [(name, _block(block)) for name, block in zip(("G1", "G2"), found.blocks, strict=True)]
    if found.delay.value:
        rows.append(("delay", shown_interval(found.delay, "s")))
    rows += [(f"{name} in {stage}", values) for name, stage, values in physics_lines(found.model)]
    rows += [
        ("runs", ", ".join(o.trace.name for o in found.observations)),
        ("noise", f"{shown(found.noise.rms_v, 'V', 3)}, {found.noise_words}"),
    ]
    rows += [("cannot be told", item.what) for item in found.not_identifiable]
    rows += [("warning", text) for text in found.warnings]
    return Glance("Identification", identification_sentence(found), tuple(rows))


def of_explanation(told: "Explanation") -> Glance:
    """Return the verdict, the physics and the proof."""
    noise, held = told.noise.rms_v, told.held_out
    mismatch = f"{shown(told.mismatch_v, 'V', 3)} rms, {told.mismatch_v / noise:.3g} x the noise"
    rows = [("mismatch", mismatch)]
    if told.location:
        rows.append(("where", f"{told.location.stage}: {told.location.sentence}"))
    rows += [row for finding in told.effects for row in _finding(finding)]
    before, after = (shown(volts, "V", 3) for volts in (held.residuals.before_v, held.residuals.after_v))
    runs = ", ".join(held.runs) or held.how
    rows += [
        ("proof", f"held out ({runs}): {before} before, {after} after, noise {shown(noise, 'V', 3)}"),
        ("remains", told.remaining.sentence),
    ]
    if told.verdict != "consistent" and (values := told.rig_file.told(noise)):
        rows.append(("rig file", values))
    rows += [("warning", text) for text in told.warnings]
    return Glance(told.verdict.replace("_", " ").capitalize(), told.sentence, tuple(rows))


def of_comparison(found: "Comparison") -> Glance:
    """Return the verdict and what changed."""
    rows = [("p-value", f"{found.p_value:.3g}")]
    rows += [(name, f"{side.rms_v / side.noise.rms_v:.3g} x the noise") for name, side in
             (("fit before", found.before), ("fit after", found.after))]
    rows += [(c.name, f"{shown_interval(c.before, c.unit)} -> {shown_interval(c.after, c.unit)}")
             for c in found.changes if c.state == "changed"]
    rows += [(f"{piece.id} in {piece.stage}", piece.sentence) for piece in found.physics]
    rows += [("because", found.unproven)] if found.unproven else []
    rows += [("warning", text) for text in found.warnings]
    return Glance(found.verdict.capitalize(), found.sentence, tuple(rows))


def of_finding(finding: "Finding") -> Glance:
    """Return the physics, its values and what else it may be."""
    from identify.page.report import finding_lines

    rows = [*finding_lines(finding), ("law", finding.equation), ("means", finding.sentence)]
    rows += list(_finding(finding))[1:]
    rows += [("would separate", finding.would_separate)] if finding.would_separate else []
    return Glance("Finding", _named(finding), tuple(rows))


def _border(name: str, interval: Interval) -> str:
    return shown_interval(interval, "V" if name.startswith("D") else "V/V")


def _block(block: Rational) -> str:
    num, den = (", ".join(f"{c:.6g}" for c in side) for side in (block.num, block.den))
    return f"num [{num}], den [{den}]"


def _finding(finding: "Finding") -> Iterator[Row]:
    """Yield one piece of physics, and what it might be instead."""
    from identify.page.report import finding_lines, percent

    values = ", ".join(f"{name} {value}" for name, value in finding_lines(finding))
    yield "what", f"{_named(finding)}: {values}"
    for other in finding.could_also_be:
        yield "or", f"{other.id} in {other.stage} ({percent(other.probability)})"


def _named(finding: "Finding") -> str:
    from identify.page.report import percent

    return f"{finding.id} in {finding.stage} ({percent(finding.probability)})"
