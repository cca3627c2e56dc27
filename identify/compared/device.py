"""Could the device alone have made a change: other gains of its output and its input, another delay?

u and y are what the device says it put out and read. A gain of its input that changed scales all of F's levels, one of
its output scales v and so the slopes one way and the crossings the other, and a delay adds to the dead time. No
recording tells such a change from one of the rig; a change that is none of these is not the device's.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from identify.compared.account import LEFT, Moved
from identify.interval import number

Weights = dict[str, float]
INPUT_GAIN: Weights = {"F.S": 1.0, "F.gain": 1.0, "F.offset": 1.0, "F.loading": 1.0, "F.unloading": 1.0}
OUTPUT_GAIN: Weights = {"F.S": 1.0, "F.D": -1.0, "F.gain": 1.0}
"""By which share a number grows with that gain, by the beginning of its name."""


@dataclass(frozen=True)
class ByDevice:
    """Whether gains and delay of the device account for a change: ``left_p`` is how often chance leaves as much."""

    left_p: float

    @property
    def is_possible(self) -> bool:
        """Return whether nothing but chance is left."""
        return self.left_p >= LEFT

    def to_dict(self) -> dict[str, object]:
        """Return the form of ``rig compare --json``."""
        return {"possible": self.is_possible, "left_p": number(self.left_p, 3)}


def by_device(change: Moved) -> ByDevice:
    """Return whether the device alone could have made a change."""
    ways = np.column_stack([_along(change, INPUT_GAIN), _along(change, OUTPUT_GAIN), _late(change)])
    ways = ways[:, np.any(ways != 0.0, axis=0)]
    held = len(change.names) - int(np.linalg.matrix_rank(ways)) if ways.size else len(change.names)
    return ByDevice(float(chi2.sf(change.left_along(ways), held)) if held else 1.0)


def _along(change: Moved, gain: Weights) -> NDArray[np.float64]:
    shares = [next((w for head, w in gain.items() if name.startswith(head)), 0.0) for name in change.names]
    return np.asarray(shares * change.size)


def _late(change: Moved) -> NDArray[np.float64]:
    return np.array([float(name == "G2.dead_time") for name in change.names])
