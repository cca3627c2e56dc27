"""What travels to a worker, and what comes back: a path, never samples; the text of an answer, or of a failure."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from rig.question import Question

Kind = Literal["answered", "unchanged", "failed"]


@dataclass(frozen=True)
class Order:
    """Ask ``question`` of the recording at ``path``, unless its SHA-256 is ``known``: that was answered before.

    ``program`` are the versions of whoever orders, which the worker must share. After ``limit_s`` it is given up.
    """

    path: Path
    question: "Question"
    program: Mapping[str, str]
    known: str | None = None
    limit_s: float | None = None

    @property
    def too_long(self) -> str:
        """Return what is said of an order that was given up; it is tried again next time, perhaps with more time."""
        return f"{self.path}: not answered within --time-limit, {self.limit_s or 0.0:g} s; give it more"


@dataclass(frozen=True)
class Outcome:
    """What became of an order; a failure has a ``message``.

    ``text`` is the file to keep: of an answer, or of a failure that the same recording would end in again. A failure
    without one lies with the machine or the moment, and is tried again next time.
    """

    path: Path
    kind: Kind
    text: str = ""
    message: str = ""
    seconds: float = 0.0


Do = Callable[[Order], Outcome]
