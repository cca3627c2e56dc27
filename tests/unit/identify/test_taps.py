"""Is what a changed chain answers from kept signals the same as from the source on?"""

import numpy as np
import pytest

from identify.chain import CHUNK, plain_chain, simulate
from identify.effects import catalogue
from identify.effects.effect import short
from identify.stage import Place
from identify.taps import Taps
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import sine
from tests.trials import model_of, observed, recorded

HALF = 0.5  # of an example: what the sine meets
TRACE = recorded(OP_AMP, sine("long", 31.25, 9.9, 260, 1), (), fine=1)
PLAIN = plain_chain(model_of(OP_AMP))
TAPS = Taps(PLAIN, (observed(TRACE, 0.02, 1),))


@pytest.mark.parametrize("kind", ["dead_time", "extra_pole", "saturation", "plateau_droop", "feedthrough"])
def test_the_change_is_that_of_the_whole_answers(kind):
    assert TRACE.size > CHUNK
    for effect in catalogue()[kind].variants():
        values = {short(p.name): HALF * catalogue()[kind].example[short(p.name)] for p in effect.parameters()}
        chain = effect.put_in(PLAIN, values)
        expected = (simulate(chain, TRACE) - simulate(PLAIN, TRACE)) / 0.02
        assert np.max(np.abs(expected)) > 0.01
        assert np.allclose(TAPS.changes([chain])[0], expected, rtol=0.0, atol=1e-6)


def test_the_same_chain_changes_nothing():
    assert not np.any(TAPS.changes([PLAIN]))


def test_a_moved_plain_value_is_a_change():
    moved = PLAIN.with_values({"G2.den.s1": 1.1 * PLAIN.values["G2.den.s1"]})
    assert np.max(np.abs(TAPS.changes([moved]))) > 0.1
    assert TAPS.runs[0].signals[PLAIN.index(Place.F) - 1].shape == (TRACE.size,)
