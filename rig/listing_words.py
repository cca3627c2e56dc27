"""How are the recordings of a folder told on a terminal?"""

from collections.abc import Iterator

from identify.natural_units import shown
from rig.listing import Facts, Listing, Row
from rig.tabular import Line, Table
from rig.units import show

HEADINGS = ("recording", "when, UTC", "what", "device", "rate", "length", "whole", "verdict")
MOST = 40  # characters of a title or a device


def words(found: Listing) -> Iterator[Line]:
    """Tell every recording in a line, and what cannot be read with the reason."""
    readable = [(row, row.facts) for row in found.rows if row.facts]
    if not found.rows:
        yield f"{found.folder}: no recordings (*.h5)"
    if readable:
        yield Table(HEADINGS, tuple(_cells(found, row, facts) for row, facts in readable))
    yield from (f"cannot be listed: {row.problem}" for row in found.rows if row.problem)


def _cells(found: Listing, row: Row, facts: Facts) -> tuple[str, ...]:
    return (
        str(row.path.relative_to(found.folder)), facts.started[:19].replace("T", " "), facts.title[:MOST],
        facts.device[:MOST], show(facts.rate_hz, "Hz"), shown(facts.length_s, "s"), _whole(facts), _verdict(row),
    )  # fmt: skip


def _whole(facts: Facts) -> str:
    lost = f", {facts.lost} samples not recorded" if facts.lost else ""
    return f"yes{lost}" if facts.complete else f"no{lost}"


def _verdict(row: Row) -> str:
    told = list(dict.fromkeys(answer.verdict for answer in row.answers))
    if row.outdated:
        told.append("an answer of what the file held before")
    return "; ".join(told)
