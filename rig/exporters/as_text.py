"""How is a recording written as CSV that any program reads, and from which the same bits come back?

Comments first: what this is, and the note of the recording in lines that open with ``#=``. Then one line of headings
with units, and one row a sample: every number in the fewest digits that are this number and no other.
"""

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np

from identify.trace import Array, blocks
from rig.exported import TIME, note_of, signals_of, times_of
from rig.progress import Show, told
from rig.readers.text import NOTE
from rig.recorded import Entry, Recording

AT_ONCE = 1 << 16  # rows
NOTE_LINE = 2000  # characters
ORDINARY_NAN = np.array(np.nan).view(np.uint64)[()]


def put(path: Path, recording: Recording, show: Show) -> None:
    """Write the recording; raise OSError."""
    signals = signals_of(recording)
    with path.open("w", encoding="ascii", newline="\n") as file:
        file.writelines(f"# {line}\n" for line in _explained(recording))
        file.writelines(f"{NOTE}{line}\n" for line in _wrapped(note_of(recording)))
        file.write(",".join([f"{TIME} [s]", *(f"{name} [V]" for name in signals), "ledger"]) + "\n")
        for start, stop in told(blocks(0, recording.u.size, AT_ONCE), recording.u.size, "rows", show):
            columns = [times_of(recording, start, stop), *(held[start:stop] for held in signals.values())]
            file.writelines(_rows(columns, recording.ledger[start:stop].tolist()))


def _explained(recording: Recording) -> Iterator[str]:
    """Yield what a reader of the file should know, without line feeds."""
    yield f"recording of {recording.u.size} samples at {recording.rate_hz!r} Hz, made by rig export"
    yield f"u is the output as commanded, {recording.intersample} between samples; y is read just before u acts"
    yield "ledger: " + ", ".join(f"{entry.value} {entry.name.lower()}" for entry in Entry)
    yield "rig import makes the same recording of this file; the lines that open with #= are for it"


def _wrapped(note: str) -> Iterable[str]:
    """Return a long line in pieces."""
    return (note[at : at + NOTE_LINE] for at in range(0, len(note), NOTE_LINE))


def _rows(columns: Sequence[Array], ledger: Sequence[int]) -> Iterator[str]:
    """Yield the rows as lines."""
    cells = [_digits(values) for values in columns]
    return (f"{','.join(row)}\n" for row in zip(*cells, map(str, ledger), strict=True))


def _digits(values: Array) -> list[str]:
    """Return numbers as text; a NaN of unusual bits, which arithmetic makes, has them in brackets."""
    text = list(map(repr, values.tolist()))
    bits = values.view(np.uint64)
    for at in np.flatnonzero(np.isnan(values) & (bits != ORDINARY_NAN)):
        text[at] = f"nan({bits[at]:016x})"
    return text
