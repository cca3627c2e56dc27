"""Is a border that a run never meets drawn in to where it would, and is what it had hidden told?"""

from dataclasses import replace

import numpy as np
import pytest

from identify.chain import signals
from identify.effects import chain_of
from identify.explain.explain import explain
from identify.explain.plain import prepared
from identify.holdout import split
from identify.observe import Observation
from identify.starts.unmet import LOADING, UNLOADING, drawn_in
from tests.proof.ask import known_effects
from tests.proof.cases import Concealed
from tests.proof.rigs import RC, Rig
from tests.proof.stimuli import Stimulus, sine
from tests.trials import model_of, recorded

NOISE_V = 0.01
SMALL = sine("small", 8.0, 1.0, 8, 1)  # v goes 0.71 V either way: the gap of RC ends at 1.25 V
UP_AND_BACK = Stimulus("up and back", 2.0 * np.sin(np.linspace(0.0, np.pi, 10_000)) ** 2, ())


def seen(stimulus: Stimulus, rig: Rig = RC) -> tuple[Observation, ...]:
    trace = recorded(rig, stimulus, (), NOISE_V, 1)
    return (Observation(trace, np.ones(trace.size, dtype=bool), NOISE_V),)


def moves(values: dict[str, float], stimulus: Stimulus) -> tuple[bool, bool]:
    """Return whether w of RC with such borders goes up, and down."""
    chain = chain_of(model_of(RC)).with_values(values)
    step = np.diff(signals(chain, seen(stimulus)[0].trace)[2], prepend=0.0)
    return bool(np.any(step > 0.0)), bool(np.any(step < 0.0))


def test_borders_that_are_never_met_are_drawn_in_each_alone_and_both() -> None:
    chain = chain_of(model_of(RC))
    assert moves(chain.values, SMALL) == (False, False)
    loading, unloading, both = (found.values for found in drawn_in(chain, seen(SMALL), ()))
    assert (moves(loading, SMALL)[0], loading[UNLOADING]) == (True, RC.d_u_v)
    assert (moves(unloading, SMALL)[1], unloading[LOADING]) == (True, RC.d_l_v)
    assert moves(both, SMALL) == (True, True)
    for values in (loading, unloading, both):
        assert values[UNLOADING] < values[LOADING]


def test_of_two_borders_only_the_one_that_is_never_met_is_moved() -> None:
    chain = chain_of(model_of(RC))
    assert moves(chain.values, UP_AND_BACK) == (True, False)
    (found,) = drawn_in(chain, seen(UP_AND_BACK), ())
    assert found.values[LOADING] == RC.d_l_v
    assert RC.d_u_v < found.values[UNLOADING] < RC.d_l_v
    assert moves(found.values, UP_AND_BACK) == (True, True)
    (other,) = drawn_in(chain, seen(replace(UP_AND_BACK, u=-UP_AND_BACK.u)), ())
    turned = -found.values[UNLOADING], RC.d_u_v
    assert (other.values[LOADING], other.values[UNLOADING]) == pytest.approx(turned, rel=1e-3)


def test_nothing_is_moved_that_is_met_or_fixed_or_not_there() -> None:
    chain = chain_of(model_of(RC))
    assert drawn_in(chain, seen(sine("large", 5.0, 3.0, 4, 1)), ()) == ()
    assert drawn_in(chain, seen(SMALL), ("F",)) == ()
    (unloading,) = drawn_in(chain, seen(SMALL), (LOADING,))
    assert unloading.values[LOADING] == RC.d_l_v
    assert drawn_in(chain, seen(Stimulus("still", np.zeros(2_000), ())), ()) == ()
    linear = replace(RC, linear=True, d_l_v=0.0, d_u_v=0.0)
    assert drawn_in(chain_of(model_of(linear)), seen(SMALL, linear), ()) == ()


@pytest.mark.parametrize("wider", [1.2, 1.6])
def test_a_rig_file_with_too_wide_a_gap_is_no_physics_that_is_missing(wider: float) -> None:
    """The run leaves the gap of the rig by a seventh, and never that of the rig file."""
    rig = replace(RC, d_l_v=0.65, d_u_v=-0.65)
    trace = recorded(rig, SMALL, (), NOISE_V, 2)
    model = model_of(replace(rig, d_l_v=wider * rig.d_l_v, d_u_v=wider * rig.d_u_v))
    _, plain = prepared(model, split(model, [trace]), sorted(known_effects()))
    assert plain.misfit < 0.05
    assert plain.fit.chain.values[LOADING] == pytest.approx(rig.d_l_v, abs=0.01)
    assert explain(model, [trace]).verdict == "consistent"


@pytest.mark.parametrize(
    ("physics", "named"),
    [
        (Concealed("hum at sense", {"amplitude": 0.02, "frequency": 50.02}), "hum"),
        (Concealed("feedthrough", {"k": 0.02}), "feedthrough"),
    ],
)
def test_what_is_missing_beside_a_gap_that_is_stuck_is_told(physics: Concealed, named: str) -> None:
    """w rests: a law of its level has no level to be one of."""
    told = explain(model_of(RC), [recorded(RC, SMALL, (physics,), NOISE_V, 3)])
    assert (told.verdict, [effect.id for effect in told.effects]) == ("explained", [named])
    assert told.location.stage == "sense"


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_where_the_gap_is_stuck_in_earnest_no_border_is_drawn_in_for_noise(seed: int) -> None:
    """A border that is met with a slope of next to nothing fits noise as well, and foretells nothing of another run."""
    model = model_of(replace(RC, d_l_v=1.2, d_u_v=-1.3, s_l=7.7))
    still, moving = (recorded(RC, run, (), NOISE_V, seed) for run in (SMALL, sine("large", 8.0, 3.5, 8, 1)))
    _, plain = prepared(model, split(model, [still], [moving]), sorted(known_effects()))
    assert plain.fit.chain.values["F.S_L"] == pytest.approx(7.7, rel=1e-6)
    assert explain(model, [still], [moving]).verdict == "consistent"
