"""Which directions of the model do these data leave open, and what holds them?"""

import numpy as np

from identify.fit import Fit
from identify.identification import Unidentifiable
from identify.model import Model
from identify.natural_units import shown

UNSEEN = 0.7  # share of its prior's width above which a parameter was not determined by the data


def unidentifiable(model: Model, fit: Fit) -> tuple[Unidentifiable, ...]:
    """Return the directions the data cannot tell: those of every such rig, and parameters no run excited."""
    found = [
        Unidentifiable(
            "delay shared between G1 and G2", "a delay before F gives the same output as one behind it",
            _delay_assumed(model),
        ),
        Unidentifiable(
            "gain shared between G1, F and G2", "only the product reaches the reading",
            f"G1(0) = {model.g1.dc_gain:.4g} and G2(0) = {model.g2.dc_gain:.4g} as in the rig file",
        ),
    ]  # fmt: skip
    for i, c in enumerate(fit.coordinates):
        if float(np.sqrt(fit.covariance[i, i])) > UNSEEN * c.prior_sd and not c.parameter.local:
            kept = f"the rig file's value {shown(c.centre, c.parameter.unit)} is kept"
            found.append(Unidentifiable(c.name, "no run excites it", kept))
    return tuple(found)


def _delay_assumed(model: Model) -> str:
    """Return where the delay is put, and where the rig file puts it when that is elsewhere."""
    kept = "G1 assumed without dead time, all of it given to G2"
    first_s, second_s = model.g1.dead_time_s, model.g2.dead_time_s
    if first_s == 0.0:
        return kept
    there = f"{shown(first_s, 's')} to G1" + (f" and {shown(second_s, 's')} to G2" if second_s else "")
    return f"{kept}; the rig file gives {there}"
