"""What does the file of a run say that is being recorded, or was never finished?

It has a user block of 64 KiB: the checksum of all bytes that do not change while it grows, where the others stand, and
room for the last words of the run. They are put down in place as soon as the run is over, so that nothing that comes
after - a full disk, a folder that may no longer be written to, the death of the program - costs more than the finished
form of the file. What grows is accounted for in the ``journal`` (``rig/journal.py``).
"""

import json
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from io import FileIO
from pathlib import Path

import xxhash

from rig.journal import HarmedError
from rig.recorded import Entry, Event, Recording
from rig.seal import GROWING, READERS, SCHEMA, mark_of, pieces
from rig.writing import is_written, put

BLOCK = 1 << 16  # bytes of the user block
WORDS_AT, WORDS_HEAD = 1 << 13, 128
WORDS_MOST = BLOCK - WORDS_AT - WORDS_HEAD
STILL, LEFT = "still being written", "the program ended before the run did"
NOTE = (f"HDF5 from byte {BLOCK} on; a run that is being recorded, or whose program was killed. The checksum is that "
        f"of the next line and of all bytes from there on but those it names. {READERS}")
_WORDS = re.compile(r"last words ([0-9]+) ([0-9a-f]{32})\n")
Extents = Mapping[str, tuple[int, int]]
"""First byte and number of bytes of every dataset that grows, by its name in the file, the journal the last."""


@dataclass(frozen=True)
class LastWords:
    """How a run ended, as it stands in its file before that is finished."""

    complete: bool
    reason: str
    finished: str
    events: tuple[Event, ...] = ()


@dataclass(frozen=True)
class Unfinished:
    """A file that grows: where, how its run ended when that is known, and whether a program is writing it now."""

    extents: Extents
    words: LastWords | None
    being_written: bool
    loose: bool = False  # words that were not written to their end

    @property
    def reason(self) -> str:
        """Return why the recording is incomplete, when no last words say so."""
        return STILL if self.being_written else LEFT


def mark(path: Path, extents: Extents) -> None:
    """Write the user block of the file at ``path``, whose structure is finished; raise OSError."""
    with path.open("r+b", buffering=0) as file:
        head = _head(_fixed_digest(file, extents), extents)
        if len(head) > WORDS_AT:
            raise ValueError(f"{len(extents)} signals are more than the user block has room to name")
        file.seek(0)
        file.write(head.ljust(BLOCK))


def inspect(path: Path) -> Unfinished:
    """Return what the user block says, all that does not grow compared; raise HarmedError, OSError."""
    with path.open("rb", buffering=0) as file:
        busy = is_written(file)
        block = file.read(BLOCK)
        extents = _extents(block)
        if block[:WORDS_AT] != _head(_fixed_digest(file, extents), extents).ljust(WORDS_AT):
            raise HarmedError("the bytes that do not grow do not match their checksum")
        words, loose = _words(block[WORDS_AT:])
    return Unfinished(extents, words, busy, loose)


def spoken(file: FileIO) -> LastWords | None:
    """Return the last words that stand in an open file now, None while there are none; raise OSError.

    They may be put down at this moment: what does not match its checksum is none yet.
    """
    try:
        return _words(os.pread(file.fileno(), BLOCK - WORDS_AT, WORDS_AT))[0]
    except HarmedError:
        return None


def speak(descriptor: int, words: LastWords) -> None:
    """Put down how the run ended, in place; raise OSError. Events that find no room are counted, not kept."""
    body = _fitting(words)
    head = f"last words {len(body)} {xxhash.xxh3_128_hexdigest(body)}\n".encode()
    put(descriptor, b" " * WORDS_HEAD, WORDS_AT)
    put(descriptor, body.ljust(WORDS_MOST), WORDS_AT + WORDS_HEAD)
    put(descriptor, head.ljust(WORDS_HEAD), WORDS_AT)


def ended(recording: Recording, words: LastWords) -> Recording:
    """Return the recording as its last words have it; what its ``lost`` events name and nobody sent was lost."""
    ledger = recording.ledger
    for event in (event for event in words.events if event.kind == "lost"):
        ledger = ledger if ledger.flags.writeable else ledger.copy()
        stretch = ledger[event.start : event.stop]
        stretch[stretch == Entry.NOT_RECEIVED] = Entry.LOST
    return replace(recording, ledger=ledger, complete=words.complete, reason=words.reason, events=words.events,
                   origin=replace(recording.origin, finished=words.finished))


def _fixed_digest(file: FileIO, extents: Extents) -> str:
    """Return the checksum of where things grow and of all bytes that do not."""
    found = xxhash.xxh3_128(_listed(extents))
    at = BLOCK
    for start, length in sorted(extents.values()):
        for piece in pieces(file, at, start):
            found.update(piece)
        at = start + length
    for piece in pieces(file, at):
        found.update(piece)
    return found.hexdigest()


def _head(digest: str, extents: Extents) -> bytes:
    return f"{SCHEMA} {GROWING} {digest}\n{NOTE}".encode() + _listed(extents)


def _listed(extents: Extents) -> bytes:
    return json.dumps({"grows": {name: list(extent) for name, extent in extents.items()}}).encode() + b"\n"


def _extents(block: bytes) -> Extents:
    """Return where things grow, by the user block; raise HarmedError."""
    if len(block) != BLOCK or mark_of(block) is None:
        raise HarmedError("the user block is cut off")
    try:
        told = json.loads(block[:WORDS_AT].split(b"\n")[2])["grows"]
        extents = {str(name): (int(start), int(length)) for name, (start, length) in told.items()}
    except (IndexError, KeyError, ValueError, TypeError, AttributeError, RecursionError) as error:
        raise HarmedError("the user block does not say what grows") from error
    if any(start < BLOCK or length < 0 for start, length in extents.values()):
        raise HarmedError("the user block does not say what grows")
    return extents


def _words(area: bytes) -> tuple[LastWords | None, bool]:
    """Return the last words, and whether some were begun that nobody ended; raise HarmedError."""
    head, body = area[:WORDS_HEAD], area[WORDS_HEAD:]
    if not head.strip(b" "):
        return None, bool(body.strip(b" "))
    found = _WORDS.match(head.decode("latin-1"))
    said = body[:int(found[1])] if found else b""
    if found is None or area != head[:found.end()].ljust(WORDS_HEAD) + said.ljust(WORDS_MOST) or (
        xxhash.xxh3_128_hexdigest(said) != found[2]):
        raise HarmedError("the last words of the run do not match their checksum")
    told = json.loads(said)
    return LastWords(**told | {"events": tuple(Event(**event) for event in told["events"])}), False


def _fitting(words: LastWords) -> bytes:
    """Return the words as JSON, with as many events as there is room for."""
    kept: Sequence[Event] = words.events
    while len(body := _as_json(words, kept)) > WORDS_MOST:
        kept = kept[: len(kept) // 2]
    return body


def _as_json(words: LastWords, events: Sequence[Event]) -> bytes:
    left_out = len(words.events) - len(events)
    last = words.events[-1] if left_out else None
    more = (Event("left out", f"{left_out} further events found no room", last.stop, last.stop),) if last else ()
    told = asdict(words) | {"events": [asdict(event) for event in (*events, *more)], "reason": words.reason[:4096]}
    return json.dumps(told).encode()
