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
            f"G1 assumed with a dead time of {shown(model.g1.dead_time_s, 's')}",
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
