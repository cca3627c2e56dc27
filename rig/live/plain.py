"""What would the rig have answered if it were as its file says, and by how much does the recording differ?

The model carries its state along, so that an hour costs no more memory than a second. Its values are those of the rig
file: nothing is fitted here, and what remains may be values as well as physics.
"""

from dataclasses import dataclass, replace
from math import ceil, sqrt
from typing import final

import numpy as np

from identify.model import Backlash, LinearF, Model
from identify.simulate import Player
from identify.trace import Array
from rig.errors import FileError, MisfitError
from rig.linearblock import poles, settling_time_s
from rig.live.following import About
from rig.rigfile import parse_rig

STEPS_TO_TAU = 20  # substeps to the shortest time constant, where that takes no more than FINEST
FINEST = 8
SETTLED = 1e-3  # of a step, that a dwell may still be away from its end
Line = tuple[float, float]
"""Slope, V/V, and where it crosses the axis of v, V."""


@dataclass
class Squares:
    """A root mean square that grows."""

    total: float = 0.0
    count: int = 0

    def add(self, values: Array) -> None:
        """Take further values, those that are numbers."""
        known = values[np.isfinite(values)]
        self.total, self.count = self.total + float(known @ known), self.count + known.size

    @property
    def rms(self) -> float | None:
        """Return it; None before the first value."""
        return sqrt(self.total / self.count) if self.count else None


@final
class Plain:
    """The model of a rig file, played along with a run from rest."""

    def __init__(self, model: Model, about: About) -> None:
        """Begin at rest; raise ValueError for a model that has no values, or physics nobody knows."""
        self.model = model
        substeps = _substeps(model, about.rate_hz) if about.intersample == "held" else 1
        self._player = Player(replace(model, noise_v=None), about.rate_hz, start_s=about.start_s, substeps=substeps,
                              probes=("G1",), intersample=about.intersample)
        blocks = [(block.num, block.den) for block in (model.g1, model.g2)]
        dead_time_s = model.g1.dead_time_s + model.g2.dead_time_s
        self.settling_s = settling_time_s(blocks, dead_time_s, SETTLED)
        self.noise_v = model.noise_v

    def answer(self, u: Array) -> tuple[Array, Array]:
        """Return y and v, V, shape (n,) each, to the next n samples of u."""
        y, v = self._player.probed(u)
        return y, v

    def borders(self) -> tuple[Line, ...]:
        """Return the straight borders of F as they show in y over v, both settled; none where they are curved."""
        f, gain = self.model.f, self.model.g2.dc_gain
        if isinstance(f, Backlash):
            return (f.s_l * gain, f.d_l_v), (f.s_u * gain, f.d_u_v)
        if isinstance(f, LinearF) and f.gain:
            return ((f.gain * gain, -f.offset_v / f.gain),)
        return ()


def plain_of(about: About) -> tuple[Plain | None, str]:
    """Return the model of the rig a recording keeps, and a sentence that says what it is, or why there is none."""
    if not about.rig_text.strip():
        return None, "no model: the recording keeps no rig file"
    try:
        model = parse_rig(about.rig_text, "the rig file in the recording").model
        if model.unknown:
            return None, f"no model: the rig file gives no values for {model.unknown[0]}"
        return Plain(model, about), f"plain model: {model.title}, values as in its rig file, not fitted"
    except (FileError, MisfitError, ValueError) as error:
        return None, f"no model: {error}"


def _substeps(model: Model, rate_hz: float) -> int:
    """Return how finely the model is stepped between two samples."""
    taus_s = [float(-1.0 / pole.real) for block in (model.g1, model.g2) for pole in poles(block.den)]
    finest = ceil(STEPS_TO_TAU / (rate_hz * min(taus_s))) if taus_s else 1
    return min(max(finest, 1), FINEST)
