"""What comes back from a device: which samples, of how many inputs, and what happened to them?"""

from dataclasses import dataclass, field
from enum import IntFlag

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
NO_FURTHER: Array = np.empty((0, 0))


class Flag(IntFlag):
    """What happened to a block, or to the samples between the block before and this one."""

    NONE = 0
    OVERRUN = 1
    LINK_LOSS = 2
    CLIPPED = 4
    RESENT = 8


@dataclass(frozen=True)
class Block:
    """Samples y (n,), V, of the run from index ``start`` on; indices skipped since the block before are lost.

    ``further`` (inputs - 1, n), V, are the readings of inputs 2, 3, ... at the same instants; a device that records one
    input leaves it out.
    """

    start: int
    y: Array
    flags: Flag = field(default=Flag.NONE)
    further: Array = field(default_factory=lambda: NO_FURTHER)

    def __post_init__(self) -> None:
        """Refuse readings that are not of the same instants (ValueError)."""
        if self.further.size and self.further.shape[1:] != self.y.shape:
            raise ValueError(f"{self.y.shape} samples of y beside {self.further.shape} of the further inputs")

    @property
    def stop(self) -> int:
        """Return the index after the last sample."""
        return self.start + int(self.y.size)
