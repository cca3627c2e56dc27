"""How is what changed between two recordings told on a terminal?"""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from identify.natural_units import shown_interval
from rig.comparing import Compared
from rig.tabular import Line, Table

if TYPE_CHECKING:
    from identify.compared.change import Change

HEADINGS = ("", "before", "after", "change", "in standard errors", "p, all tests counted", "")
STATES = {"changed": "CHANGED", "no change seen": "", "cannot tell": "cannot tell", "not told": "not told"}


def compared(done: Compared) -> Iterator[Line]:
    """Tell the verdict, every value with its change, the physics, what may be the cause, and in what files differ."""
    from identify.compared.sentence import joint_words

    found = done.found
    yield f"{found.verdict.upper()}. {found.sentence}"
    for side, source, recording in zip(("before", "after"), done.sources, done.recordings, strict=True):
        started = recording.origin.started[:19].replace("T", " ") or "at a time not known"
        yield f"  {side:<8} {source.path}, {started}{'' if recording.complete else ', incomplete'}"
    yield table(found.changes)
    yield f"  {joint_words(found.joint)}"
    yield from (f"  physics  {piece.sentence}{_others(piece.could_also_be)}" for piece in found.physics)
    yield from (f"  cause?   {cause.aspect}: {cause.state}, {cause.sentence}" for cause in done.causes)
    yield from (f"  differs  {d.aspect}: {d.what}: {d.before} -> {d.after}" for d in done.differ)
    yield from (f"  warning: {text}" for text in found.warnings)


def table(changes: "Sequence[Change]") -> Table:
    """Return a line for every value: before, after, and what it changed by."""
    return Table(HEADINGS, tuple(_row(change) for change in changes), indent=2)


def _row(change: "Change") -> tuple[str, ...]:
    from identify.compared.sentence import by_words, probability

    ends = (shown_interval(interval, change.unit) for interval in (change.before, change.after))
    if change.state == "not told":
        return (change.name, *ends, "not told", "", "", "")
    numbers = (f"{change.standard_errors:+.1f}", probability(change.adjusted).removeprefix("= "))
    return (change.name, *ends, by_words(change.by, change.unit), *numbers, STATES[change.state])


def _others(could_also_be: Sequence[str]) -> str:
    return f" (could also be {', '.join(could_also_be)})" if could_also_be else ""

