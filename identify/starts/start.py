"""From which values does the joint fit start?"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identify.blocks import Play
from identify.chain import Chain
from identify.fit import total_chi_squared
from identify.identification import StairPoint
from identify.model import Model
from identify.observe import Observation
from identify.sections import is_stable, mirrored
from identify.staircase import borders


def stabilised(model: Model) -> tuple[Model, tuple[str, ...]]:
    """Return the model with the poles of unstable blocks mirrored, and a sentence on each.

    A rig is stable; coefficients of third order and more that are some 30 % off need not be. Raises ValueError where
    such a block is not to be fitted.
    """
    sentences = []
    for name, block in (("G1", model.g1), ("G2", model.g2)):
        if is_stable(block.den):
            continue
        worst = max(np.roots(block.den), key=lambda pole: float(pole.real))
        same_sign = min(block.den) > 0.0 or max(block.den) < 0.0
        if len(block.den) <= 3 or not same_sign or {name, f"{name}.den"} & set(model.fixed):
            raise ValueError(f"{name} is not stable: a pole at {worst:.4g}/s")
        model = replace(model, g1=mirrored(block)) if name == "G1" else replace(model, g2=mirrored(block))
        sentences.append(
            f"{name} is not stable as the rig file gives it (a pole at {worst:.4g}/s): the fit started from the same "
            "poles mirrored to the left of 0"
        )
    return model, tuple(sentences)


def started(model: Model, chain: Chain, observations: Sequence[Observation], stairs: Sequence[StairPoint]) -> Chain:
    """Return the chain with the borders that leave the smaller residual."""
    if chain.stage_of(Play) is None:
        return chain
    from_stairs = borders(stairs, model.g1.dc_gain, model.g2.dc_gain)
    other = chain.with_values({k: v for k, v in from_stairs.items() if k not in model.fixed and "F" not in model.fixed})
    return min((chain, other), key=lambda c: total_chi_squared(c, observations))
