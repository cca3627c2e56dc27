"""A hard rail: the output of F cannot pass a level."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar, final

import numpy as np

from identify.effects.effect import Confusion
from identify.effects.limit import Limit
from identify.stage import Parameter, Place
from identify.trace import Array

if TYPE_CHECKING:
    from identify.evidence import Evidence

UPPER = Parameter("saturation.upper", "V")
LOWER = Parameter("saturation.lower", "V")
DEPTHS = np.geomspace(3e-4, 0.7, 24)  # of the range of w, cut off: a rail may only just be met
TOUCHED = np.geomspace(1e-6, 1e-3, 8)  # of the level: how far a limit cuts that is only just met


@final
class Saturation(Limit):
    """w limited to [lower, upper] behind the play operator; a clip and a play commute (physics.md 4)."""

    id = "saturation"
    title = "supply rails"
    equation = "w' = min(max(w, lower), upper)"
    sentence = (
        "An amplifier in F, or the one that drives it, runs into its supply rails (the data are the same): the level "
        "of w stops at {}."
    )
    axis = "level of w"
    fingerprint = "flat at a fixed w, at any frequency"
    places = (Place.F,)
    elsewhere: ClassVar = {Place.SENSE: "adc_clipping"}
    declared = (UPPER, LOWER)
    confused_with = (
        Confusion(
            "adc_clipping",
            "a faster sine of the same amplitude: a rail at w is rounded by G2, a clipped reading stays flat",
        ),
        Confusion("soft_saturation", "a staircase with small steps just below the level"),
    )
    quick = True  # a limit that is only just met
    example: ClassVar = {"upper": 9.7, "lower": -10.4}

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the limits, tried at levels inside the range of w, that explain most; one side after the other."""
        low, high = evidence.range(Place.F)
        best: dict[str, float] = {}
        for name, end in (("upper", high), ("lower", low)):
            if self.form in ("both", name):
                levels = [(1.0 - depth) * end for depth in DEPTHS] if end else []
                likely = evidence.levels(Place.F).best(_clipped, [{**best, name: level} for level in levels])
                least = [{**best, name: (1.0 - depth) * end} for depth in TOUCHED] if end else []
                best = self._simulated(evidence, [likely, *least] if likely else least) or likely or best
        return [best] if len(best) == len(self.parameters()) else []

    def _simulated(self, evidence: "Evidence", options: list[dict[str, float]]) -> dict[str, float]:
        """Return the limit that explains most, of a likely one and those that are only just met; {} for none."""
        if self.form == "both":  # one side after the other: the one that is not there yet limits nothing
            options = [{**self.absent, **values} for values in options]
        found = evidence.best(self, options)
        if not found or evidence.merit(self, found) <= 0.0:
            return {}
        return {name: level for name, level in found.items() if np.isfinite(level)}


def _clipped(w: Array, values: Mapping[str, float]) -> Array:
    """Return w between the limits there are."""
    return np.clip(w, values.get("lower", -np.inf), values.get("upper", np.inf))
