"""Is one changed byte found wherever it is: in values, attributes, user block, or the structure of the file?

    python -m tests.benchmarks.flipped_bytes           # every byte of small recordings; 2,000 drawn ones of a large one
    python -m tests.benchmarks.flipped_bytes 20000     # so many of the large one

Of the room for last words in a file that has none, 56 KiB of spaces, every fiftieth byte is changed.

Three recordings of 40 samples: a finished one, one whose program was killed halfway, and the latter after its last
words. A change counts as found when `rig verify` calls the file damaged, or no recording, or says something it did not
say before. That a command which reads the file refuses it is asked as well; where it does not, it must return what was
recorded.
"""

import sys
import tempfile
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from identify.trace import Step
from rig.errors import FileError
from rig.plan import Limits, Plan
from rig.recorded import Equipment, Event, Recording
from rig.recording import Writer, read
from rig.unfinished import BLOCK, WORDS_AT, WORDS_HEAD, LastWords
from rig.verifying import Verified, verify

EQUIPMENT = Equipment("loopback:", "loopback", "op-amp", "1", {"rate": "1000 Hz", "range": "±10 V"})
WORDS = LastWords(False, "stopped by SIGINT", "2026-11-22T00:00:00+00:00", (Event("lost", "3 samples", 30, 33),))


@dataclass(frozen=True)
class Flipped:
    """One changed byte: where, and what said so; nothing where ``found`` is empty."""

    at: int
    found: str
    refused: bool


def make(path: Path, kind: str, size: int = 40) -> Path:
    """Write a recording of a kind: ``finished``, ``killed``, or killed after its ``last words``."""
    u = np.linspace(-1.0, 1.0, size)
    plan = Plan("a run", u, 1000.0, (Step("sine", "sine", 0, size),), Limits(-1.0, 1.0), protocol_text="spec: 1\n# µ\n",
                question="why?", rig_text="spec: 1\nrig: x\n", inputs=("y", "v"))
    with Writer(path, plan, EQUIPMENT) as writer:
        writer.append(0, 2.0 * u[: size // 4], u[None, : size // 4])
        writer.append(size // 4 + 2, 2.0 * u[size // 4 + 2 : size // 2], u[None, size // 4 + 2 : size // 2])
        if kind == "finished":
            writer.append(size // 2, 2.0 * u[size // 2 :], u[None, size // 2 :])
            writer.finish(False, "2 lost", [Event("lost", "2 samples", size // 4, size // 4 + 2)])
        if kind == "last words":
            writer._growing.speak(WORDS)
    return path


def flips(path: Path, places: Iterable[int], mask: int = 1) -> Iterator[Flipped]:
    """Change one byte after the other, each put back before the next."""
    before, recording = said(verify(path)), read(path)
    whole = bytearray(path.read_bytes())
    for at in places:
        with path.open("r+b", buffering=0) as file:
            file.seek(at)
            file.write(bytes([whole[at] ^ mask]))
            found = noticed(path, before)
            refused = is_refused(path, recording)
            file.seek(at)
            file.write(whole[at : at + 1])
        yield Flipped(at, found, refused)


def noticed(path: Path, before: tuple[object, ...]) -> str:
    """Return what tells of the damage; empty when nothing does."""
    try:
        found = verify(path, locate=False)
    except FileError as error:
        return error.what
    return "" if said(found) == before else "; ".join((*found.findings, *found.remarks)) or "it says other things"


def said(found: Verified) -> tuple[object, ...]:
    """Return all that `rig verify` tells."""
    told = found.to_dict()
    return found.findings, found.remarks, str(told)


def is_refused(path: Path, recording: Recording) -> bool:
    """Return whether the file is refused by who reads it; raise AssertionError when something else is read."""
    try:
        found = read(path)
    except FileError:
        return True
    signals, others = (r.inputs() | {"u": r.u, "ledger": r.ledger} for r in (found, recording))
    same = all(np.array_equal(signals[name], others[name], equal_nan=True) for name in others)
    assert same, "another recording was read, and nothing said"
    assert (found.reason, found.events, found.origin) == (recording.reason, recording.events, recording.origin)
    return False


def table(kind: str, found: list[Flipped], size: int) -> str:
    """Return the figures of one recording."""
    missed = [one.at for one in found if not one.found]
    lines = [f"{kind}: {len(found)} bytes of {size} changed, one at a time: {len(found) - len(missed)} found, "
             f"{sum(one.refused for one in found)} refused by read"]
    lines += [f"  {count:7d}  {what}" for what, count in Counter(one.found for one in found).most_common(12)]
    return "\n".join(lines + [f"  MISSED at {missed[:20]}"] * bool(missed))


def main(count: int) -> int:
    missed = 0
    with tempfile.TemporaryDirectory() as folder:
        for kind in ("finished", "killed", "last words"):
            path = make(Path(folder) / f"{kind}.h5", kind)
            size = path.stat().st_size
            found = list(flips(path, places_in(kind, size)))
            print(table(kind, found, size), flush=True)
            missed += sum(not one.found for one in found)
        for kind in ("finished", "killed"):
            path = make(Path(folder) / f"large {kind}.h5", kind, 1_000_000)
            size = path.stat().st_size
            random = np.random.default_rng(0)
            places = random.integers(0, size, count)
            found = [one for at in places for one in flips_at(path, int(at), int(random.integers(1, 256)))]
            print(table(f"large, {kind}", found, size), flush=True)
            missed += sum(not one.found for one in found)
    return missed


def places_in(kind: str, size: int) -> Iterator[int]:
    """Yield the bytes of a small recording that are changed."""
    blank = range(WORDS_AT + WORDS_HEAD, BLOCK) if kind == "killed" else range(0)
    return (at for at in range(size) if at not in blank or at % 50 == 0)


def flips_at(path: Path, at: int, mask: int) -> list[Flipped]:
    """Change the byte ``at`` in the bits of ``mask``."""
    return list(flips(path, [at], mask))


if __name__ == "__main__":
    sys.exit(main(int(float(sys.argv[1])) if len(sys.argv) > 1 else 2000) > 0)
