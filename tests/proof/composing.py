"""Which law is put together by chance for a stage, and with which values?"""

import numpy as np

from tests.proof.composed import WHAT, named, names
from tests.proof.detect import Reach
from tests.proof.kinds import Draw, Kind, Scaled, sign
from tests.proof.physics import Place
from tests.proof.rigs import Rng, between

STAGES = tuple(dict.fromkeys(stage for stage, _, _ in WHAT.values()))


def composed(rng: Rng, stage: str) -> Kind:
    """Return a law drawn for a stage: what is changed first, then by what, then how."""
    laws = [words for words in names() if WHAT[words[0]][0] == stage]
    for at in range(3):
        word = str(rng.choice(list(dict.fromkeys(words[at] for words in laws))))
        laws = [words for words in laws if words[at] == word]
    name = named(*laws[0])
    return Kind(name, stage, name, _values(WHAT[laws[0][0]][1]))


def _values(place: Place) -> Draw:
    """Return the draw of a law's values at a place: how far and how fast the signal goes there, and its times."""

    def draw(rng: Rng, reach: Reach) -> Scaled:
        behind = place in ("w", "x", "y")
        scale = reach.rig.s_l if behind else 1.0
        fixed = {
            "top": reach.u_v if place == "drive" else max(reach.high_w_v, -reach.low_w_v) if behind else reach.v_v,
            "speed": reach.speed_v * scale,
            "u": reach.u_v,
            "w": reach.high_w_v - reach.low_w_v,
            "tau": between(rng, 0.01, 1.0),
            "pole": between(rng, 1e-3, 20e-3),
            "span": reach.moving_s[-1],
            "moment": float(rng.uniform(*np.quantile(reach.moving_s, [0.2, 0.8]))),
            "frequency": between(rng, 2.0, 140.0),
        }
        up = sign(rng)
        return lambda strength: {**fixed, "k": up * strength}

    return draw
