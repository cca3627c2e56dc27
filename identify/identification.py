"""What is the answer to "which rig made these recordings"?"""

from dataclasses import dataclass, replace
from typing import Literal

from identify.fit import Fit
from identify.interval import Interval, number
from identify.model import Model, Rational
from identify.noise import Noise
from identify.observe import Observation

SCHEMA = "rig.identify/1"
PUNCTUAL = Interval(0.0, 0.0, 0.0)  # a rig without dead time, s
Branch = Literal["loading", "unloading", "plateau", "saturated"]


@dataclass(frozen=True)
class FrequencyPoint:
    """A linear block at one frequency: gain in V/V, phase in rad."""

    frequency_hz: float
    gain: Interval
    phase_rad: Interval

    def to_dict(self) -> dict[str, object]:
        """Return the form of the charter."""
        return {
            "frequency_hz": number(self.frequency_hz),
            "gain": self.gain.to_dict(), "phase_rad": self.phase_rad.to_dict(),
        }  # fmt: skip


@dataclass(frozen=True)
class StairPoint:
    """The settled reading of one level of a staircase, V, and the branch of F it lies on."""

    run: str
    level_v: float
    mean_v: Interval
    branch: Branch

    def to_dict(self) -> dict[str, object]:
        """Return the form of the charter."""
        return {
            "run": self.run, "level_V": number(self.level_v), "mean_V": number(self.mean_v.value),
            "ci95": [number(self.mean_v.low), number(self.mean_v.high)], "branch": self.branch,
        }  # fmt: skip


@dataclass(frozen=True)
class Unidentifiable:
    """A direction in which the model can move without the data noticing, and what holds it."""

    what: str
    because: str
    fixed_by: str

    def to_dict(self) -> dict[str, object]:
        """Return the form of the charter."""
        return {"what": self.what, "because": self.because, "fixed_by": self.fixed_by}


@dataclass(frozen=True)
class Identification:
    """The refitted model with intervals, what the staircase showed, and what the data cannot tell.

    ``delay`` is the sum of all dead times, s. ``borders`` (S_L, D_L, S_U, D_U) are normalised as in the paper,
    G1(0) = G2(0) = 1; empty for a rig without backlash. ``own_scale`` has the same borders as the rig file's DC gains
    leave them.
    """

    model: Model
    fit: Fit
    observations: tuple[Observation, ...]
    noise: Noise
    rms_v: float
    fit_percent: float
    borders: dict[str, Interval]
    own_scale: dict[str, Interval]
    g1: tuple[FrequencyPoint, ...]
    g2: tuple[FrequencyPoint, ...]
    staircase: tuple[StairPoint, ...]
    not_identifiable: tuple[Unidentifiable, ...]
    warnings: tuple[str, ...]
    delay: Interval = PUNCTUAL

    @property
    def blocks(self) -> tuple[Rational, Rational]:
        """Return G1 without dead time and G2 with all of it: only the sum shows. ``model`` keeps its file's shares."""
        return replace(self.model.g1, dead_time_s=0.0), replace(self.model.g2, dead_time_s=self.delay.value)

    def to_dict(self) -> dict[str, object]:
        """Return the answer of ``rig identify --json``, schema rig.identify/1, less the rig-file form of the model."""
        blocks = {
            name: {
                "points": [point.to_dict() for point in points],
                "rational": {"num": list(block.num), "den": list(block.den), "dead_time_s": block.dead_time_s},
            }
            for name, points, block in zip(("G1", "G2"), (self.g1, self.g2), self.blocks, strict=True)
        }
        return {
            "schema": SCHEMA,
            "backlash": {**{k: v.to_dict() for k, v in self.borders.items()}, "unit": "V"} if self.borders else None,
            "backlash_own_scale": {k: v.to_dict() for k, v in self.own_scale.items()} if self.own_scale else None,
            **blocks,
            "delay_s": self.delay.to_dict(),
            "staircase": [point.to_dict() for point in self.staircase],
            "fit": {
                "rms_V": number(self.rms_v), "noise_rms_V": number(self.noise.rms_v), "noise_from": self.noise.origin,
                "fit_percent": number(self.fit_percent), "converged": self.fit.converged, "sentence": self.fit.sentence,
            },
            "not_identifiable": [item.to_dict() for item in self.not_identifiable],
            "warnings": list(self.warnings),
        }  # fmt: skip
