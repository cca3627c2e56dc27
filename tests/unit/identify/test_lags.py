"""Does the block of the rig file keep its poles, and the lag that is not drawn the one that is new?"""

import numpy as np
import pytest

from identify.blocks import LinearBlock
from identify.chain import Chain, plain_chain
from identify.effects import catalogue
from identify.effects.effect import Effect
from identify.lags import as_drawn, time_constants
from identify.model import Backlash, Model, Rational
from identify.sections import product
from identify.stage import Place

LAGS = {1: (4e-3,), 2: (4e-3, 1.1e-3), 3: (4e-3, 1.1e-3, 3e-4)}
NEW_S = 2.3e-3


def den(*lags_s: float) -> tuple[float, ...]:
    """Return the denominator of lags in a row."""
    return tuple(product([(lag_s,) for lag_s in lags_s]))


def chain(place: Place, drawn: tuple[float, ...], fitted: tuple[float, ...], lag_s: float, effect: str) -> Chain:
    """Return a chain whose block at a place was drawn with one denominator and came out with another, beside a lag."""
    other = Rational((1.0,), den(7e-3))
    blocks = {Place.G1: other, Place.G2: other, place: Rational((1.0,), drawn)}
    law = law_of(effect, place)
    gap = Backlash(8.0, 1.25, 8.0, -1.25)
    there = law.put_in(plain_chain(Model("m", blocks[Place.G1], gap, blocks[Place.G2], 0.01)), {"tau": lag_s})
    block = at(there, place)
    moved = plain_chain(Model("m", Rational((1.0,), fitted), gap, Rational((1.0,), fitted), 0.01))
    names = [p.name for p in block.coefficients()]
    return there.with_values({name: moved.values[name] for name in names})


def law_of(effect: str, place: Place) -> Effect:
    """Return the lag beside the block at a place."""
    return catalogue()[effect](Place.SOURCE if effect == "source_pole" else place)


def at(chain: Chain, place: Place) -> LinearBlock:
    """Return the block at a place."""
    return next(stage for stage in chain.stages if isinstance(stage, LinearBlock) and stage.place is place)


def whole(chain: Chain, place: Place, lag: str) -> tuple[float, ...]:
    """Return the denominator of block and lag together."""
    block = at(chain, place)
    return product([*block.parts(chain.of(block, "")), (chain.values[lag],)])


@pytest.mark.parametrize(
    ("place", "effect"), [(Place.G1, "extra_pole"), (Place.G2, "extra_pole"), (Place.G1, "source_pole")]
)
@pytest.mark.parametrize("order", LAGS)
def test_the_block_takes_back_the_pole_it_is_drawn_with(place, effect, order):
    own, lag = LAGS[order], f"{effect}.tau"
    drawn, mistaken = tuple(1.04 * lag_s for lag_s in own), (NEW_S, *own[1:])
    found = chain(place, den(*drawn), den(*mistaken), own[0], effect)
    right = law_of(effect, place).upright(found)
    assert right.values[lag] == pytest.approx(NEW_S, rel=1e-6)
    assert np.allclose(whole(right, place, lag), whole(found, place, lag), rtol=1e-6)
    assert as_drawn(right, place, lag) is right


def test_a_block_with_a_pair_of_complex_poles_keeps_them():
    found = chain(Place.G1, (1e-6, 1e-3, 1.0), (1e-6, 0.9e-3, 1.0), NEW_S, "extra_pole")
    assert as_drawn(found, Place.G1, "extra_pole.tau") is found


def test_a_block_without_poles_and_a_lag_of_none_stay():
    found = chain(Place.G2, (1.0,), (1.0,), NEW_S, "extra_pole")
    assert as_drawn(found, Place.G2, "extra_pole.tau") is found
    none = found.with_values({"extra_pole.tau": 0.0})
    assert as_drawn(none, Place.G2, "extra_pole.tau") is none


def test_a_block_of_which_a_value_is_held_stays():
    drawn, mistaken = den(1.04 * 4e-3, 1.1e-3), den(NEW_S, 1.1e-3)
    found = chain(Place.G1, drawn, mistaken, 4e-3, "extra_pole")
    assert as_drawn(found, Place.G1, "extra_pole.tau") is not found
    held = found.with_values({"G1.den.s1": at(found, Place.G1).start_values()[1]})
    assert as_drawn(held, Place.G1, "extra_pole.tau") is held


def test_time_constants_are_those_of_the_block_the_slowest_first():
    blocks = Rational((1.0,), den(1.1e-3, 4e-3)), Rational((1.0,), (1e-6, 1e-3, 1.0))  # the second rings
    there = plain_chain(Model("m", blocks[0], Backlash(8.0, 1.25, 8.0, -1.25), blocks[1], 0.01))
    assert time_constants(there, Place.G1) == pytest.approx((4e-3, 1.1e-3))
    assert time_constants(there, Place.G2) == pytest.approx((2e-3, 2e-3))
    assert time_constants(there, Place.SENSE).size == 0
