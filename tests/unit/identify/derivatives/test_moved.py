"""Is what several chains answer, run abreast from where they differ, what each of them answers alone?"""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from identify import taps
from identify.chain import Chain, grid_of, simulate
from identify.derivatives import moved, sensitivities
from identify.derivatives.sensitivities import DIFFERENCE
from identify.effects import catalogue, chain_of
from identify.model import Model, Physics
from identify.observe import Observation
from identify.stage import Held, Parameter, Place, Ramp, Stage
from identify.taps import Taps
from identify.trace import Trace
from identify.unnamed.maps import LevelMap
from tests.unit.identify.derivatives.test_tangents import PLAY, block, observed, own_sizes

DELAY_S = 4.3e-4  # four steps and a part of one
PHYSICS = {
    "a law of every value on its own": (Physics("diode_clamp", {"n_vt": 0.3, "knee": 2.0}, form="upper"),),
    "a stage with a memory of its own": (Physics("slew_limit", {"rate": 900.0}),),
    "a stage for eight at once": (
        Physics("capacitor_nonlinearity", {"k1": 0.03, "k2": 0.02, "tau": 2e-3}, "G2", form="straight and square"),
    ),
    "F with more in it": (Physics("curved_border", {"k2": 0.01, "k3": 1e-3}),),
}


def rig(physics: tuple[Physics, ...], order: int = 2) -> Chain:
    late = replace(block(order), dead_time_s=DELAY_S)
    return chain_of(Model("rig", block(order), PLAY, late, physics=physics))


def alone(chain: Chain, name: str, by: float, seen: Observation) -> np.ndarray:
    """Return by how much an answer differs once one value is moved, from two simulations."""
    there = chain.with_values({name: chain.values[name] + by})
    return simulate(there, seen.trace, seen.substeps) - simulate(chain, seen.trace, seen.substeps)


@pytest.mark.parametrize("physics", PHYSICS)
@pytest.mark.parametrize("substeps", [1, 3])
def test_every_number_moved_changes_the_answer_as_it_does_alone(physics, substeps, monkeypatch):
    monkeypatch.setattr(sensitivities, "AT_ONCE", 400)  # several stretches, the last of which is no multiple of eight
    chain, seen = rig(PHYSICS[physics]), observed(y=0.5, substeps=substeps)
    assert len(own_sizes(chain)) > moved.TOGETHER
    assert_as_alone(chain, seen)


def assert_as_alone(chain: Chain, seen: Observation) -> None:
    sizes = own_sizes(chain)
    found = sensitivities.sensitivities(chain, sizes, seen).slopes()
    for (name, size), slopes in zip(sizes.items(), found, strict=True):
        expected = alone(chain, name, DIFFERENCE * size, seen) / DIFFERENCE
        assert np.abs(slopes - expected).max() < 1e-6 * max(np.abs(expected).max(), 1.0), name


def test_a_value_that_follows_another_moves_with_it():
    chain = replace(rig(PHYSICS["a stage with a memory of its own"]), tied=(("F.S_U", "F.S_L"),))
    sizes, seen = {"F.S_L": 1.0}, observed(y=0.5)
    (slopes,) = sensitivities.sensitivities(chain, sizes, seen).slopes()
    expected = alone(chain, "F.S_L", DIFFERENCE, seen) / DIFFERENCE
    apart = alone(replace(chain, tied=()), "F.S_L", DIFFERENCE, seen) / DIFFERENCE
    assert np.abs(slopes - expected).max() < 1e-6 * np.abs(expected).max() < np.abs(expected - apart).max()


def test_a_signal_that_is_held_and_comes_later_is_another_to_what_is_behind_it():
    """The delay of blocks without dynamics moves the instant at which what they put out jumps."""
    chain, seen = rig((Physics("feedthrough", {"k": 0.1}),), order=0), observed(y=0.5)
    grid = grid_of(seen.trace)
    later = chain.with_values({"delay": DELAY_S + 1e-5})
    assert chain.begun(grid)[1][-1] != later.begun(grid)[1][-1]
    assert_as_alone(chain, seen)


def test_what_moves_nothing_changes_nothing_to_the_last_bit():
    chain, seen = rig((Physics("saturation", {"upper": 500.0}, form="upper"),)), observed(y=0.5)
    sizes = {"G2.den.s1": 1e-4, "saturation.upper": 1.0, "G1.den.s1": 1e-4}
    slopes = sensitivities.sensitivities(chain, sizes, seen).slopes()
    assert [bool(np.any(row)) for row in slopes] == [True, False, True]


@pytest.mark.parametrize("place", [Place.SOURCE, Place.F, Place.SENSE])
@pytest.mark.parametrize("half", [False, True])
def test_changes_of_weights_are_those_of_each_alone(place, half):
    use = np.random.default_rng(0).random(observed().trace.size) < 0.5 if half else None
    chain, seen = rig(()), observed(use=use)
    law = LevelMap(place, tuple(np.linspace(-3.0, 3.0, 9)))
    there = law.put_in(chain)
    chains = [there.with_values({p.name: 0.01}) for p in law.parameters()]
    assert len(chains) > moved.TOGETHER
    found = Taps(chain, (seen,)).changes(chains, 0.01)
    for row, one in zip(found, chains, strict=True):
        expected = (simulate(one, seen.trace) - simulate(chain, seen.trace))[seen.use] / 0.01
        assert np.abs(row - expected).max() < 1e-10 * max(np.abs(expected).max(), 1.0)


def test_changes_by_a_stage_that_only_the_others_have_are_those_of_each_alone():
    chain, seen = rig(()), observed()
    law = catalogue()["capacitor_nonlinearity"](Place.G1, "square")
    there = law.put_in(chain, {"k2": 0.0, "tau": 3e-3})
    chains = [there.with_values({"capacitor_nonlinearity.k2": k2}) for k2 in np.linspace(0.002, 0.02, 9).tolist()]
    for row, one in zip(Taps(chain, (seen,)).changes(chains), chains, strict=True):
        expected = simulate(one, seen.trace) - simulate(chain, seen.trace)
        assert np.abs(expected).max() > 1e-3
        assert np.abs(row - expected).max() < 1e-10


@dataclass(frozen=True)
class Smoothed(Stage):
    """A gain behind which nothing is held any more: what is behind it is begun otherwise."""

    name: str = "smoothed"
    place: Place = Place.SOURCE

    def parameters(self):
        return (Parameter("smoothed.k", ""),)

    def begin(self, values, grid, shape):
        return (lambda block: block.signal * (1.0 + values[0])), Ramp()


@pytest.mark.parametrize("size", [1501, 70_000])
def test_what_makes_a_held_signal_another_shape_changes_it_as_each_alone_does(size):
    chain, u = rig(()), np.resize(observed().trace.u[:], size)
    seen = Observation(Trace("run", 1e4, u, np.zeros(size)), np.ones(size, dtype=bool), 1.0)
    there = chain.with_stage(Smoothed(), {"smoothed.k": 0.0})
    chains = [there.with_values({"smoothed.k": k}) for k in (0.0, 0.1, 0.2)]
    assert len(chains) >= taps.FEW
    shapes = [one.begun(grid_of(seen.trace))[1] for one in (chain, there)]
    assert (shapes[0][1], shapes[1][2]) == (Held(), Ramp())  # what enters G1
    for row, one in zip(Taps(chain, (seen,)).changes(chains), chains, strict=True):
        expected = simulate(one, seen.trace) - simulate(chain, seen.trace)
        assert np.abs(row - expected).max() < 1e-9 * np.abs(expected).max()


def test_what_was_left_by_what_overflowed_disturbs_nothing():
    chain, seen = rig(PHYSICS["a law of every value on its own"]), observed(y=0.5)
    expected = sensitivities.sensitivities(chain, own_sizes(chain), seen).slopes()
    moved._ROOM.of(4096)[:] = np.inf
    assert np.array_equal(sensitivities.sensitivities(chain, own_sizes(chain), seen).slopes(), expected)
