"""The generator cannot reach the levels it is told to."""

from typing import TYPE_CHECKING, ClassVar, final

from identify.effects.effect import Confusion
from identify.effects.limit import Limit
from identify.stage import Parameter, Place

if TYPE_CHECKING:
    from identify.evidence import Evidence

UPPER = Parameter("input_clipping.upper", "V")
LOWER = Parameter("input_clipping.lower", "V")
DEPTHS = (1e-3, 2e-3, 3.5e-3, 7e-3, 1.5e-2, 4e-2, 0.12, 0.3, 0.55)  # of the range of u, cut off
CLOSER = (0.5, 1.8)  # times the best of those
APART = (0.05, 0.3, 0.6, 1.6, 3.0)  # times the same depth on both sides, one side after the other


@final
class InputClipping(Limit):
    """u limited to [lower, upper]: the range of the DAC, the rails of the amplifier behind it."""

    id = "input_clipping"
    title = "clipping of the source"
    equation = "u' = min(max(u, lower), upper)"
    sentence = (
        "The generator does not reach the levels asked for: u stops at {}. Keep the protocol within the range of the "
        "DAC and of the amplifier behind it."
    )
    axis = "level of u"
    fingerprint = "nothing changes above a level of u"
    quick = True
    places = (Place.SOURCE,)
    declared = (UPPER, LOWER)
    confused_with = (
        Confusion("saturation", "a slow and a fast sine of the same u: what reaches rails at w, G1 lets pass or not"),
        Confusion("source_nonlinearity", "a staircase of small steps up to the top: a clip leaves low levels alone"),
        Confusion("adc_clipping", "a fast sine of the same u: a clipped reading is flat, a clipped source is rounded"),
    )  # fmt: skip
    example: ClassVar = {"upper": 2.7, "lower": -2.6}

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the limits, tried at levels inside the range of u, that explain most.

        A limit on one side alone also moves the middle: where there are two, they are looked for together.
        """
        evidence = evidence.coarse
        ends = dict(zip(("lower", "upper"), evidence.range(Place.SOURCE), strict=True))
        if 0.0 in ends.values():
            return []
        if self.form != "both":
            return self._at_best(evidence, ends, [{self.form: depth} for depth in DEPTHS], CLOSER)
        tried = [{"upper": depth, "lower": depth} for depth in DEPTHS]
        return self._at_best(evidence, ends, tried, APART)

    def _at_best(
        self, evidence: "Evidence", ends: dict[str, float], tried: list[dict[str, float]], closer: tuple[float, ...]
    ) -> list[dict[str, float]]:
        """Return the limits at the depth that explains most, and then closer to it one side after the other."""

        def limits(depths: dict[str, float]) -> dict[str, float]:
            return {side: (1.0 - depth) * ends[side] for side, depth in depths.items()}

        best = max(tried, key=lambda depths: evidence.gain(self, limits(depths)))
        for side in best:
            near = [best, *({**best, side: share * best[side]} for share in closer)]
            best = max(near, key=lambda depths: evidence.gain(self, limits(depths)))
        return [limits(best)]
