"""What is the answer to "which rig made these recordings"?"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal

from identify.bent.curves import Bend, curves_dict
from identify.fit import Fit
from identify.harmonic.measured import Measured
from identify.interval import Interval, number
from identify.model import Model, Rational
from identify.noise import Noise
from identify.notebook.glance import Glance, Seen
from identify.observe import Observation
from identify.of_device import devices_dict
from identify.uncertainty.certainty import Certainty

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from identify.planning.advice import Advice
    from identify.planning.information import StepInformation

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
        mean = self.mean_v.to_dict()
        return {
            "run": self.run, "level_V": number(self.level_v), "mean_V": mean["value"], "ci95": mean["ci95"],
            "branch": self.branch,
        }  # fmt: skip


@dataclass(frozen=True)
class OwnPoints:
    """The blocks in the circuit's own scale: V_p and the gains that normalisation divides out, V/V."""

    v_p: Interval
    g1: tuple[FrequencyPoint, ...]
    g2: tuple[FrequencyPoint, ...]


@dataclass(frozen=True)
class Unidentifiable:
    """A direction in which the model can move without the data noticing, and what holds it."""

    what: str
    because: str
    fixed_by: str

    def to_dict(self) -> dict[str, object]:
        """Return the form of the charter."""
        return {"what": self.what, "because": self.because, "fixed_by": self.fixed_by}


@dataclass(frozen=True, repr=False)
class Identification(Seen):
    """The refitted model with intervals, what the staircase showed, and what the data cannot tell.

    ``borders`` (S_L, D_L, S_U, D_U), ``g1`` and ``g2`` are normalised as in the paper, V_p = 1 and G2(0) = 1; borders
    are empty for a rig without backlash, and the nearest straight ones where they are bent. ``own_scale`` and
    ``own_points`` have the same as the rig file's DC gains leave them, ``certainty`` every number of ``model``;
    ``delay`` is the sum of all dead times, s. ``bend`` tells the shape of the borders where it was asked for.
    ``measured`` are the points of G1 and G2 that need no rational form.
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
    own_points: OwnPoints | None = None
    certainty: Certainty | None = None
    measured: Measured = field(default_factory=Measured)
    advice: "tuple[Advice, ...]" = ()
    steps: "tuple[StepInformation, ...]" = ()
    bend: Bend | None = None

    @property
    def blocks(self) -> tuple[Rational, Rational]:
        """Return G1 without dead time and G2 with all of it: only the sum shows. ``model`` keeps its file's shares."""
        return replace(self.model.g1, dead_time_s=0.0), replace(self.model.g2, dead_time_s=self.delay.value)

    @property
    def noise_words(self) -> str:
        """Return where the figure of the noise is from, and whether it is coloured."""
        coloured = any(o.colour.taps for o in self.observations)
        return f"{'coloured ' if coloured else ''}noise from {self.noise.origin}"

    def glance(self) -> Glance:
        """Return the borders, the blocks and how well they fit."""
        from identify.notebook.answers import of_identification

        return of_identification(self)

    def plot(self) -> "list[Axes]":
        """Draw borders, G1 and G2 on axes of pyplot; return the axes."""
        from identify.notebook.plots import identification

        return identification(self)

    def to_dict(self) -> dict[str, object]:
        """Return the answer of ``rig identify --json``, schema rig.identify/1, less the rig-file form of the model."""
        own = self.own_points
        blocks = {
            name: {
                "points": [point.to_dict() for point in points], **_own_points(mine),
                "measured": [point.to_dict() for point in read], "rational": self._rational(name),
            }
            for name, points, mine, read in (
                ("G1", self.g1, own.g1 if own else None, self.measured.g1),
                ("G2", self.g2, own.g2 if own else None, self.measured.g2),
            )
        }  # fmt: skip
        return {
            "schema": SCHEMA,
            **self._backlash(),
            **blocks,
            "delay_s": self.delay.to_dict(),
            "normalisation": {"V_p": own.v_p.to_dict(), "G2(0)": number(self.model.g2.dc_gain)} if own else None,
            "staircase": [point.to_dict() for point in self.staircase],
            "fit": self._fit(),
            "not_identifiable": [item.to_dict() for item in self.not_identifiable],
            "warnings": list(self.warnings),
            "covariance": self.certainty.to_dict() if self.certainty else None,
            "profiled": sorted(self.certainty.profiled) if self.certainty else [],
            "advice": [item.to_dict() for item in self.advice],
            "steps": [step.to_dict() for step in self.steps],
            "device": devices_dict([o.trace for o in self.observations]),
        }  # fmt: skip

    def _backlash(self) -> dict[str, object]:
        """Return the borders in both scales, their curves beside the straight ones."""
        if not self.borders:
            return {"backlash": None, "backlash_own_scale": None}
        shape, own_shape = {}, {}
        if self.bend is not None:
            shape = {"curves": curves_dict(self.bend.normalised), "bend": self.bend.to_dict()}
            own_shape = {"curves": curves_dict(self.bend.curves)}
        return {
            "backlash": {**{k: v.to_dict() for k, v in self.borders.items()}, "unit": "V", **shape},
            "backlash_own_scale": {**{k: v.to_dict() for k, v in self.own_scale.items()}, **own_shape},
        }

    def _fit(self) -> dict[str, object]:
        """Return how well the model fits, and what the noise is."""
        return {
            "rms_V": number(self.rms_v), "noise_rms_V": number(self.noise.rms_v), "noise_from": self.noise.origin,
            "noise_colour": _colours(self.observations), "fit_percent": number(self.fit_percent),
            "converged": self.fit.converged, "sentence": self.fit.sentence,
        }  # fmt: skip

    def _rational(self, name: str) -> dict[str, object]:
        """Return a block's coefficients in its own scale, with intervals where the fit gave them."""
        block = self.blocks[0 if name == "G1" else 1]
        told: dict[str, object] = {"num": list(block.num), "den": list(block.den), "dead_time_s": block.dead_time_s}
        if self.certainty is None:
            return told
        sides = {side: self._ends(name, side, values) for side, values in (("num", block.num), ("den", block.den))}
        delay = PUNCTUAL if name == "G1" else self.delay
        return {**told, "ci95": {**sides, "dead_time_s": [number(delay.low), number(delay.high)]}}

    def _ends(self, name: str, side: str, values: tuple[float, ...]) -> list[list[float | None]]:
        """Return the 95 % interval of every coefficient of one side; the constant term is held."""
        assert self.certainty is not None
        last, found = values[-1], []
        for k in range(len(values) - 1, 0, -1):
            interval = self.certainty.interval(f"{name}.{side}.s{k}")
            found.append([number(end) for end in sorted((interval.low * last, interval.high * last))])
        return [*found, [number(last), number(last)]]


def _own_points(points: tuple[FrequencyPoint, ...] | None) -> dict[str, object]:
    return {} if points is None else {"points_own_scale": [point.to_dict() for point in points]}


def _colours(observations: Sequence[Observation]) -> list[dict[str, object]] | None:
    """Return the autoregression of the noise at every sample rate at which it is not white, None when there is none."""
    found = {o.trace.rate_hz: o.colour.to_dict() for o in observations if o.colour.taps}
    return [{"rate_hz": number(rate), **colour} for rate, colour in sorted(found.items())] or None
