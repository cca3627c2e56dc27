"""What is one row of the fault matrix: what goes wrong, and how must the run end?"""

import math
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from drivers.emulators.faults import Fault, Faults, What


class End(Enum):
    """How a run may end."""

    WHOLE = "whole"
    GAPS = "gaps told"
    FAILED = "failed"
    REFUSED = "refused"
    HUNG = "NEVER"
    CRASHED = "CRASHED"


class Output(Enum):
    """Where the output is in the end. NONE: nothing was put out since the device was last switched on."""

    SAFE = "safe"
    NONE = "none"
    TOLD = "on, told"
    UNSAFE = "UNSAFE"


@dataclass(frozen=True)
class Case:
    """A fault and its end; where ``end`` or ``output`` is None, any but the worst will do.

    ``says``: what the reason must contain, or one of several parted by `` | ``. ``keeps``: at least so many samples
    are recorded. ``naps``: (sample, s) at which the host sleeps. ``speed`` of the device's clock.
    """

    name: str
    faults: Faults
    end: End | None
    says: str = ""
    output: Output | None = Output.SAFE
    keeps: int = 0
    naps: tuple[tuple[int, float], ...] = ()
    hardware: dict[str, Any] = field(default_factory=dict)
    speed: float = 5.0
    in_ci: bool = False

    def ends(self, end: End) -> bool:
        """Return whether this is how it must end."""
        return end is self.end or (self.end is None and end not in (End.HUNG, End.CRASHED))

    def leaves(self, output: Output) -> bool:
        """Return whether this is where the output must be."""
        return output is self.output or (self.output is None and output is not Output.UNSAFE)

    def told(self, text: str) -> bool:
        """Return whether ``text`` says what it must."""
        return any(word in text for word in self.says.split(" | "))

    @property
    def strikes(self) -> bool:
        """Return whether the script has faults that must be seen to have happened."""
        return bool(self.faults.script) and self.end is not None


@dataclass(frozen=True)
class Ended:
    """How the host saw the run end."""

    end: End
    reason: str
    events: tuple[str, ...] = ()


@dataclass(frozen=True)
class Verdict:
    """What became of a case; ``wrong`` holds a sentence for everything that must not be."""

    ended: Ended
    output: Output
    kept: int
    total: int
    seconds: float
    struck: int
    said: tuple[str, ...]
    wrong: tuple[str, ...]


def script(*faults: Fault) -> Faults:
    """Return the script of these faults."""
    return Faults(faults)


def happens(what: What, at_sample: int, seconds: float = math.inf) -> Faults:
    """Return the script in which one thing happens to the device in the middle of a run."""
    return script(Fault(what, at_sample=at_sample, seconds=seconds))
