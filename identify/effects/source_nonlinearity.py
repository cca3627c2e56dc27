"""The generator's output is not quite what it is told: its gain depends on the level."""

from typing import TYPE_CHECKING, ClassVar, final

from identify.effects.effect import Confusion, Effect
from identify.stage import Grid, Parameter, Place, Run, Shape, Values, memoryless

if TYPE_CHECKING:
    from identify.evidence import Evidence

K = Parameter("source_nonlinearity.k", "1/V^2", scale=1e-3)
SMALL = 1e-5  # 1/V^2: 1 % of third order at 30 V, well above rounding


@final
class SourceNonlinearity(Effect):
    """A term of third order in the generator's voltage: an output stage that compresses (k < 0) or expands."""

    id = "source_nonlinearity"
    title = "curved source"
    equation = "u' = u + k u^3"
    sentence = (
        "The gain of the generator depends on its level: {}. Its output stage is overdriven or loaded; lower the level "
        "and raise the gain behind it, or calibrate the source with a voltmeter at several levels."
    )
    axis = "level of u"
    fingerprint = "grows with abs(u), before all dynamics"
    quick = True
    places = (Place.SOURCE,)
    declared = (K,)
    absent: ClassVar = {"k": 0.0}
    confused_with = (
        Confusion("input_clipping", "a staircase of small steps up to the top: a clip leaves low levels alone"),
        Confusion(
            "curved_border",
            "the same amplitude of u at a frequency that G1 lets pass and at one it holds back: a law at v sees less",
        ),
        Confusion(
            "adc_nonlinearity", "offsets of u that the gap swallows: a law of the reading depends on y alone"
        ),
        Confusion("soft_saturation", "a fast sine of large u and small v: compression at w does not see it"),
    )  # fmt: skip
    example: ClassVar = {"k": 7e-4}

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the law at work."""
        (k,) = values
        return memoryless(lambda u: u + k * u * u * u, shape)

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the term that explains most, the answer taken as proportional to it, and once more at its size."""
        best = evidence.proportion(self, "k", SMALL)
        again = evidence.proportion(self, "k", best["k"]) if best.get("k") else {}
        found = evidence.best(self, [start for start in (best, again) if start])
        return [found] if found else []
