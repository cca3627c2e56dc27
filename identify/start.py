"""From which values does the joint fit start?"""

from collections.abc import Sequence

from identify.blocks import Play
from identify.chain import Chain
from identify.fit import chi_squared
from identify.identification import StairPoint
from identify.model import Model
from identify.observe import Observation
from identify.staircase import borders


def started(model: Model, chain: Chain, observations: Sequence[Observation], stairs: Sequence[StairPoint]) -> Chain:
    """Return the chain with the borders that leave the smaller residual."""
    if chain.stage_of(Play) is None:
        return chain
    from_stairs = borders(stairs, model.g1.dc_gain, model.g2.dc_gain)
    other = chain.with_values({k: v for k, v in from_stairs.items() if k not in model.fixed and "F" not in model.fixed})
    return min((chain, other), key=lambda c: sum(chi_squared(c, o) for o in observations))
