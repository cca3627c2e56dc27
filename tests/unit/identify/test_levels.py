"""Does the map of a level promise what a simulation of the law keeps?"""

import numpy as np
import pytest

from identify.chain import plain_chain
from identify.effects import catalogue
from identify.evidence import Evidence
from identify.fit import fit
from identify.levels import Levels, knots_between
from identify.stage import Place
from tests.proof.cases import Concealed
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, observed, recorded

PLAYED = (staircase("stairs", FIG13_LEVELS_V, 0.02), sine("sine", 31.25, 8.0, 4, 1))


@pytest.fixture(scope="module")
def evidence():
    clamp = (Concealed("diode_clamp", {"drop": 1.3e-5, "knee": 1.27}),)
    seen = tuple(observed(recorded(OP_AMP, s, clamp, 0.01, 3), 0.01) for s in PLAYED)
    return Evidence(fit(plain_chain(model_of(OP_AMP)), seen), seen)


@pytest.mark.parametrize(("name", "form", "values"), [
    ("diode_clamp", "upper", {"knee": 14.6, "n_vt": 1.3}),
    ("diode_clamp", "both, resistor", {"knee": 15.5, "n_vt": 1.0, "slope": 0.2}),
    ("soft_saturation", "tanh both", {"level": 60.0}),
])
def test_the_gain_of_a_law_is_that_of_its_simulation(evidence, name, form, values):
    effect = catalogue()[name](Place.F, form)
    levels = evidence.levels(Place.F)
    run, _ = effect.begin(tuple(values.values()), None, None)
    change = run(_Block(levels.knots)) - levels.knots
    assert levels.gain(change) == pytest.approx(evidence.gain(effect, values), rel=0.02, abs=0.02 * evidence.left)


class _Block:
    """The one thing a memoryless law looks at."""

    def __init__(self, signal):
        self.signal = signal


def test_the_best_option_has_most_merit_and_nothing_is_better_than_a_change_that_points_backward():
    levels = Levels(np.array([-1.0, 0.0, 1.0]), np.eye(3), np.array([0.0, 0.0, -0.3]))
    options = [{"cut": cut} for cut in (0.1, 0.3, 0.9)]
    assert levels.best(_limited, options) == {"cut": 0.3}
    assert levels.best(lambda w, values: 2.0 * w - _limited(w, values), options) == {}
    assert levels.best(lambda w, values: w, options) == {}
    assert levels.best(_limited, []) == {}


def test_a_start_too_large_to_gain_counts_for_its_shape_unless_far_too_large():
    levels = Levels(np.array([-1.0, 0.0, 1.0]), np.eye(3), np.array([0.0, 0.0, -0.3]))
    large, far_too_large = {"cut": 0.9}, {"cut": 3.1}
    assert levels.gain(_limited(levels.knots, large) - levels.knots) < 0.0
    assert levels.best(_limited, [large]) == large
    assert levels.best(_limited, [far_too_large]) == {}


def _limited(w, values):
    """Cut what exceeds 1 V less ``cut``, at the highest of the three knots alone."""
    return np.where(w > 0.5, np.minimum(w, 1.0 - values["cut"]), w)


def test_knots_lie_closer_at_the_ends_and_end_there():
    knots = knots_between(-3.0, 7.0)
    gaps = np.diff(knots)
    assert (knots[0], knots[-1]) == (-3.0, 7.0)
    assert np.all(gaps > 0.0)
    assert gaps[0] < 0.6 * gaps[len(gaps) // 2]
