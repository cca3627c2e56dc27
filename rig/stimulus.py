"""What is a stimulus of a protocol, whatever its kind?"""

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

from identify.trace import Samples
from rig.errors import MisfitError
from rig.forms import Form

MAX_SAMPLES = 1_000_000_000
"""Longest plan: 8 GB of samples each way on disk; in memory there is a stretch of them."""


@dataclass(frozen=True)
class Setting:
    """What a step is drawn in: the sample rate, and how long the rig takes to settle.

    ``settling_s`` maps a remaining fraction of a step to a time in s; it raises MisfitError when no rig is known.
    ``folder`` is where files named in the step are looked for.
    """

    rate_hz: float
    settling_s: Callable[[float], float]
    folder: Path = Path()

    def samples(self, time_s: float, what: str) -> int:
        """Return the number of samples nearest to ``time_s``; raise MisfitError for none at all or far too many."""
        count = round(time_s * self.rate_hz) if time_s * self.rate_hz <= MAX_SAMPLES else MAX_SAMPLES + 1
        if count < 1:
            raise MisfitError(f"{what} is shorter than a sample", value=f"{time_s:g} s",
                              allowed=f"at least {1 / self.rate_hz:g} s at {self.rate_hz:g} Hz")
        if count > MAX_SAMPLES:
            raise MisfitError(f"{what} is too long", value=f"{time_s:.6g} s",
                              allowed=f"up to {MAX_SAMPLES / self.rate_hz:.6g} s ({MAX_SAMPLES} samples) at "
                                      f"{self.rate_hz:g} Hz", do="shorten it or lower acquisition.rate")
        return count

    def below_nyquist(self, frequency_hz: float) -> None:
        """Raise MisfitError unless more than two samples fall on a period."""
        if frequency_hz >= self.rate_hz / 2:
            raise MisfitError("frequency above Nyquist", value=f"{frequency_hz:g} Hz",
                              allowed=f"below {self.rate_hz / 2:g} Hz, half of acquisition.rate",
                              do="raise acquisition.rate or lower the frequency")


@dataclass(frozen=True)
class Drawn:
    """The samples of one step, V; frequencies and times in them that should be whole; remarks for the operator."""

    u: Samples
    frequencies_hz: tuple[float, ...] = ()
    time_s: float = 0.0
    notes: tuple[str, ...] = field(default=())


class Stimulus(Form):
    """One kind of step."""

    kind: ClassVar[str]

    @abstractmethod
    def draw(self, setting: Setting) -> Drawn:
        """Return the samples; raise MisfitError when they cannot be made at this rate."""

    @abstractmethod
    def title(self) -> str:
        """Return the label used when the protocol gives none."""
