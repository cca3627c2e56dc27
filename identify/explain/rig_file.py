"""What do the recordings say of the values in the rig file?

Values are fitted before anything is said to be missing. Where they come out as others, that is what a simulation with
the rig file's differs by, and the first thing its reader wants to know: a part of another value is no missing physics.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import log

import numpy as np

from identify.chain import Chain
from identify.coordinate import Coordinate
from identify.fit import Fit
from identify.interval import Interval, number
from identify.natural_units import shown, shown_interval
from identify.observe import Observation, pooled_rms

TOLD = 3  # values that are named, the farthest off
ALIKE = 1.05  # times the noise that is left with the rig file's values: none need be another
TOLERANCE = 0.3  # of a value: one natural size of a linear one, or that much of a log


@dataclass(frozen=True)
class Moved:
    """A value of which the recordings say that it is another than the rig file's."""

    name: str
    unit: str
    rig_file: float
    fitted: Interval

    def to_dict(self) -> dict[str, object]:
        """Return its name, what the rig file has and what the recordings say."""
        return {"name": self.name, "rig_file": number(self.rig_file), **self.fitted.to_dict(self.unit)}

    @property
    def told(self) -> str:
        """Return what is said of it."""
        return f"{self.name} is {shown_interval(self.fitted, self.unit)}, not {shown(self.rig_file, self.unit)}"


@dataclass(frozen=True)
class HeldToRigFile:
    """What a simulation with the values of the rig file leaves of the fitted runs, V rms, and those that are others."""

    rms_v: float
    moved: tuple[Moved, ...]

    def to_dict(self, noise_v: float) -> dict[str, object]:
        """Return the form of ``rig explain --json``: the mismatch of the rig file as it is, and the values it is of."""
        return {
            "rms": number(self.rms_v), "unit": "V", "over_noise": number(self.rms_v / noise_v),
            "values": [value.to_dict() for value in self.moved],
        }  # fmt: skip

    @property
    def rows(self) -> tuple[tuple[str, str, str], ...]:
        """Return what is shown of the values: name, what the rig file has, what the recordings say."""
        return tuple((v.name, shown(v.rig_file, v.unit), shown_interval(v.fitted, v.unit)) for v in self.moved)

    def told(self, noise_v: float) -> str:
        """Return what is said of the values that are farthest off; empty where those of the rig file do as well."""
        if not self.moved or self.rms_v <= ALIKE * noise_v:
            return ""
        values = "; ".join(value.told for value in self.moved[:TOLD])
        differ = f"With the values of the rig file they differ by {shown(self.rms_v, 'V', 2)} rms"
        return f"{differ}; farthest off: {values}."


def held_to_rig_file(
    given: Chain, found: Fit, observations: Sequence[Observation], inflation: float = 1.0
) -> HeldToRigFile:
    """Return what the plain chain as ``given`` leaves, and its values that a fit says are others, farthest first."""
    with np.errstate(over="ignore", invalid="ignore"):
        rms_v = pooled_rms([o.used_residual(given) for o in observations])
    moved = []
    for coordinate in (c for c in found.coordinates if c.name in given.values and not c.parameter.local):
        name, parameter = coordinate.name, coordinate.parameter
        fitted = Interval(found.chain.values[name], *found.ci95(name, inflation))
        if not fitted.low <= given.values[name] <= fitted.high:
            value = Moved(name.removeprefix("F."), parameter.unit.removesuffix("^1"), given.values[name], fitted)
            moved.append((_by(coordinate, value), value))
    return HeldToRigFile(rms_v, tuple(value for _, value in sorted(moved, key=lambda pair: -pair[0])))


def _by(coordinate: Coordinate, value: Moved) -> float:
    """Return by how many tolerances a value is off."""
    if coordinate.parameter.coordinate == "log":
        return abs(log(value.fitted.value / value.rig_file)) / TOLERANCE
    return abs(value.fitted.value - value.rig_file) / coordinate.parameter.scale
