"""What can be made to go wrong on an emulated link, for tests?"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Faults:
    """What goes wrong, nothing by default.

    ``drop`` and ``corrupt`` are probabilities per byte, on both directions, of all but the first ``spare`` bytes.
    ``delay_s`` holds back what the device sends. At sample ``mute_at`` the device stops sending for ``mute_s``; at
    ``hang_at`` it neither hears nor speaks any more, its output staying on; at ``die_at`` its link is torn. Times are
    real ones.
    """

    drop: float = 0.0
    corrupt: float = 0.0
    spare: int = 0
    delay_s: float = 0.0
    mute_at: int | None = None
    mute_s: float = 0.0
    hang_at: int | None = None
    die_at: int | None = None
    seed: int = 0


NO_FAULTS = Faults()


class NoisyLine:
    """One direction of a link: what goes in comes out with the faults of the link."""

    def __init__(self, faults: Faults, direction: int) -> None:
        """Start with a fresh line; equal seeds and directions give equal faults."""
        self._faults = faults
        self._random = np.random.default_rng((faults.seed, direction))
        self._spared = faults.spare

    def carry(self, data: bytes) -> bytes:
        """Return what arrives of ``data``."""
        spared, data = data[:self._spared], data[self._spared:]
        self._spared -= len(spared)
        if not data or not (self._faults.drop or self._faults.corrupt):
            return spared + data
        values = np.frombuffer(data, dtype=np.uint8).copy()
        hit = self._random.random(values.size) < self._faults.corrupt
        values[hit] ^= self._random.integers(1, 256, int(hit.sum()), dtype=np.uint8)
        return spared + values[self._random.random(values.size) >= self._faults.drop].tobytes()
