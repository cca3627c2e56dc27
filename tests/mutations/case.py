"""What is one mutated file, which command opens it, and how must that end?"""

from collections.abc import Mapping
from dataclasses import dataclass, field

LIMIT_S = 10.0
LIMIT_BYTES = 1_000_000_000
REFUSED = 2
NEGATIVE = 1
DONE = 0
VERIFY = "verify"
"""The command whose answer to damage is no, beside findings."""
SECRET = "a line of a file that nobody named: 4f2c9"
"""Stands in the folder above; whatever shows it has followed a reference out."""


@dataclass(frozen=True)
class Case:
    """Files by name in an empty folder, the words typed there, and whether nothing but a refusal is right.

    Where ``hostile`` is False, what was changed at random may still be a file as good as before: then an answer is
    right as well.
    """

    name: str
    files: Mapping[str, bytes]
    line: tuple[str, ...]
    hostile: bool = False


@dataclass(frozen=True)
class Ending:
    """How a command ended: ``signal`` for a process that died of it, ``code`` None where it was killed for time.

    ``seconds`` are those of the processor, whatever else that machine does, and of the clock where it was killed;
    ``peak_bytes`` is the most memory it had resident.
    """

    code: int | None
    out: str
    err: str
    seconds: float
    peak_bytes: int
    left: tuple[str, ...] = ()
    signal: int | None = None


@dataclass(frozen=True)
class Judged:
    """A case, how it ended, and everything that is wrong with that."""

    case: Case
    ending: Ending
    faults: tuple[str, ...] = field(default=())


def judge(case: Case, ending: Ending) -> Judged:
    """Return a case with what is wrong about its ending: nothing, as it should be."""
    return Judged(case, ending, tuple(_faults(case, ending)))


def _faults(case: Case, ending: Ending) -> list[str]:
    if ending.signal is not None:
        return [f"died of signal {ending.signal}"]
    if ending.code is None:
        return [f"went on for {ending.seconds:.1f} s"]
    faults = [f"took {ending.seconds:.1f} s"] if ending.seconds > LIMIT_S else []
    if ending.peak_bytes > LIMIT_BYTES:
        faults.append(f"took {ending.peak_bytes / 1e6:.0f} MB")
    if SECRET in ending.out + ending.err:
        faults.append("told what stands in another file")
    return faults + (_of_refusal(ending) if ending.code == REFUSED else _of_answer(case, ending))


def _of_refusal(ending: Ending) -> list[str]:
    """Return what is wrong with a refusal: it is one message, and leaves nothing behind."""
    faults = []
    if not ending.err.startswith("rig: ") or ending.err.count("\n") != 1 or "Traceback" in ending.err:
        faults.append("not one message")
    if ending.out:
        faults.append("an answer beside the refusal")
    if ending.left:
        faults.append(f"left {', '.join(ending.left)}")
    return faults


def _of_answer(case: Case, ending: Ending) -> list[str]:
    """Return what is wrong where a file was not refused: what was hostile must be, the rest must be answered."""
    if case.hostile and (ending.code, case.line[0]) != (NEGATIVE, VERIFY):
        return [f"ended with {ending.code}"]
    if ending.code == NEGATIVE:
        return [] if ending.err.count("\n") <= 1 and "Traceback" not in ending.err else ["not one message"]
    return [] if ending.code == DONE and not ending.err else [f"ended with {ending.code}"]
