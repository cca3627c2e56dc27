"""What is the answer to "why do simulation and recording differ"?"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from identify.explain.rig_file import HeldToRigFile
from identify.explain.shape import Shape
from identify.explain.survey import StageShare
from identify.fit import Fit
from identify.interval import Interval, number
from identify.model import Model
from identify.noise import Noise
from identify.notebook.glance import Glance, Seen
from identify.observe import Observation
from identify.of_device import devices_dict
from identify.trace import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from identify.explain.contenders import Contender

SCHEMA = "rig.explain/1"
Verdict = Literal["consistent", "explained", "partly_explained", "unexplained"]


@dataclass(frozen=True)
class Range:
    """A stretch of a coordinate, and the share of the mismatch's energy that lies in it."""

    axis: str
    low: float
    high: float
    unit: str
    share: float

    def to_dict(self) -> dict[str, object]:
        """Return the form of the charter."""
        return {
            "axis": self.axis, "from": number(self.low, 4), "to": number(self.high, 4), "unit": self.unit,
            "share": number(self.share, 3),
        }  # fmt: skip


@dataclass(frozen=True)
class Profile:
    """The mismatch along one coordinate, for the picture of where it sits: bins (B+1,), rms per bin (B,), V."""

    axis: str
    unit: str
    edges: Array
    before_v: Array
    after_v: Array


@dataclass(frozen=True)
class Location:
    """The stage at which the mismatch enters, and where on that stage's own coordinate.

    ``alternatives`` are stages that the data cannot exclude, ``same_data`` those of them at which what enters would
    give exactly the same data, whatever is played.
    """

    stage: str
    where: tuple[Range, ...]
    sentence: str
    alternatives: tuple[str, ...] = ()
    same_data: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, object]:
        """Return the form of the charter."""
        return {
            "stage": self.stage, "where": [w.to_dict() for w in self.where], "sentence": self.sentence,
            "alternatives": list(self.alternatives), "same_data": list(self.same_data),
        }  # fmt: skip


@dataclass(frozen=True)
class Alternative:
    """Another physics that the data cannot exclude."""

    id: str
    stage: str
    probability: float

    def to_dict(self) -> dict[str, object]:
        """Return the form of the charter."""
        return {"id": self.id, "stage": self.stage, "probability": number(self.probability, 3)}


@dataclass(frozen=True, repr=False)
class Finding(Seen):
    """One piece of missing physics; ``id`` is ``unnamed`` when its place and shape are proven but no name is.

    ``shape`` draws what an unnamed one adds, where a curve can.
    """

    id: str
    stage: str
    form: str
    probability: float
    parameters: dict[str, tuple[Interval, str]]
    equation: str
    sentence: str
    could_also_be: tuple[Alternative, ...]
    would_separate: str | None
    shape: Shape | None = None

    @property
    def stages(self) -> dict[str, float]:
        """Return the probability of every stage at which it may be, all its names together, the likeliest first."""
        total = {self.stage: self.probability}
        for other in self.could_also_be:
            total[other.stage] = total.get(other.stage, 0.0) + other.probability
        return dict(sorted(total.items(), key=lambda item: -item[1]))

    def glance(self) -> Glance:
        """Return the name, the values and what they are doubted by."""
        from identify.notebook.answers import of_finding

        return of_finding(self)

    def to_dict(self) -> dict[str, object]:
        """Return the form of the charter."""
        return {
            "id": self.id, "stage": self.stage, "form": self.form or None, "probability": number(self.probability, 3),
            "parameters": {name: interval.to_dict(unit) for name, (interval, unit) in self.parameters.items()},
            "equation": self.equation, "sentence": self.sentence,
            "could_also_be": [other.to_dict() for other in self.could_also_be], "would_separate": self.would_separate,
            "shape": self.shape.to_dict() if self.shape else None,
        }  # fmt: skip


@dataclass(frozen=True)
class Residuals:
    """Residual rms in V of the plain and the improved model on the same samples."""

    before_v: float
    after_v: float


@dataclass(frozen=True)
class HeldOut:
    """The proof: residuals on data used neither for fitting nor for choosing. ``how`` says which data those are.

    ``named_v`` is what the named physics alone leaves: more than the improved model where that has an unnamed part.
    """

    runs: tuple[str, ...]
    how: str
    residuals: Residuals
    named_v: float


@dataclass(frozen=True)
class Remaining:
    """What the improved model leaves: held-out residual over noise, and where it would sit."""

    over_noise: float
    stage: str | None
    sentence: str


@dataclass(frozen=True, repr=False)
class Explanation(Seen):
    """The mismatch, the physics left out, the better model, and the proof."""

    verdict: Verdict
    sentence: str
    noise: Noise
    mismatch_v: float
    p_value: float
    location: Location | None
    effects: tuple[Finding, ...]
    training: Residuals
    held_out: HeldOut
    remaining: Remaining
    model: Model
    plain: Fit
    improved: Fit
    train: tuple[Observation, ...]
    test: tuple[Observation, ...]
    profiles: tuple[Profile, ...]
    survey: tuple[StageShare, ...]
    warnings: tuple[str, ...]
    rig_file: HeldToRigFile
    entered: "tuple[Contender, ...]" = ()  # where what has no name may have come in, the likeliest first

    @property
    def is_open(self) -> bool:
        """Return whether anything is undecided: which of several names, or where what has none comes in."""
        return any(f.could_also_be for f in self.effects) or len(self.entered) > 1

    def glance(self) -> Glance:
        """Return the verdict, the physics and the proof."""
        from identify.notebook.answers import of_explanation

        return of_explanation(self)

    def plot(self) -> "list[Axes]":
        """Draw where recording and plain model differ most, and along what, on axes of pyplot; return the axes."""
        from identify.notebook.plots import explanation

        return explanation(self)

    def to_dict(self) -> dict[str, object]:
        """Return the answer of ``rig explain --json``, schema rig.explain/1, without the rig-file form of the model."""
        noise, held = self.noise.rms_v, self.held_out
        return {
            "schema": SCHEMA, "verdict": self.verdict, "sentence": self.sentence,
            "noise": {"rms": number(noise), "unit": "V", "from": self.noise.origin},
            "mismatch": {
                "rms": number(self.mismatch_v), "unit": "V", "over_noise": number(self.mismatch_v / noise),
                "p_value": number(self.p_value, 3),
            },
            "location": self.location.to_dict() if self.location else None,
            "stages": [share.to_dict() for share in self.survey],
            "effects": [finding.to_dict() for finding in self.effects],
            "fit": {
                "unit": "V",
                "training": {"before": number(self.training.before_v), "after": number(self.training.after_v)},
                "held_out": {
                    "runs": list(held.runs), "how": held.how, "before": number(held.residuals.before_v),
                    "named": number(held.named_v), "after": number(held.residuals.after_v), "noise": number(noise),
                },
            },
            "remaining": {
                "over_noise": number(self.remaining.over_noise), "stage": self.remaining.stage,
                "sentence": self.remaining.sentence,
            },
            "rig_file": self.rig_file.to_dict(noise),
            "warnings": list(self.warnings),
            "device": devices_dict([o.trace for o in (*self.train, *self.test)]),
        }  # fmt: skip
