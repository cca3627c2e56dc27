"""What comes back from a device: which samples, and what happened to them?"""

from dataclasses import dataclass, field
from enum import IntFlag

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Flag(IntFlag):
    """What happened to a block, or to the samples between the block before and this one."""

    NONE = 0
    OVERRUN = 1
    LINK_LOSS = 2
    CLIPPED = 4
    RESENT = 8


@dataclass(frozen=True)
class Block:
    """Samples y (V) of the run from index ``start`` on; indices skipped since the block before are lost."""

    start: int
    y: Array
    flags: Flag = field(default=Flag.NONE)

    @property
    def stop(self) -> int:
        """Return the index after the last sample."""
        return self.start + int(self.y.size)
