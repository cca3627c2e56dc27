"""Is the information of a step what independent code makes of it, and are the shares those of the estimates?"""

from dataclasses import replace

import numpy as np
import pytest

from identify.chain import plain_chain
from identify.coordinate import coordinates_of
from identify.model import Backlash, LinearF, Model, Rational
from identify.observe import Observation
from identify.planning.information import Information, information
from identify.trace import Array, Step, Trace
from tests.proof.bench import answer
from tests.proof.integrator import Grid
from tests.proof.rigs import SKEWED, Rig
from tests.trials import model_of

RATE_HZ = 2000.0
NOISE_V = 0.01
RIG = replace(SKEWED, g1_den=(20.0, 1000.0), g2_den=(2.0, 1000.0))  # unequal slopes, one pole each


def played() -> Trace:
    """Return a sine that leaves the gap stuck, from rest, then a staircase and a sine of 10 Hz."""
    levels = np.repeat([0.8, 1.6, 2.2, 1.2, 0.0, -1.4, -2.2, -1.0], 100)
    t = np.arange(800) / RATE_HZ
    u = np.concatenate((np.sin(2 * np.pi * 60.0 * t), levels, 3.0 * np.sin(2 * np.pi * 10.0 * t)))
    steps = (Step("stuck", "sine", 0, 800), Step("walk", "staircase", 800, 1600), Step("sine", "sine", 1600, 2400))
    return Trace("planned", RATE_HZ, u, np.zeros(u.size), steps=steps)


def told_by(trace: Trace, model: Model, substeps: int = 8, noise_v: float = NOISE_V) -> Information:
    chain = plain_chain(model)
    seen = Observation(trace, np.ones(trace.size, dtype=bool), noise_v, substeps)
    return information(chain, coordinates_of(chain, chain.values, [trace.name], model.fixed), [seen])


def moved(rig: Rig, name: str, factor: float) -> Rig:
    """Return the rig with one value multiplied; G1.den.s1 is the coefficient over the constant term."""
    if not name.startswith("G"):
        field = {"F.S_L": "s_l", "F.D_L": "d_l_v", "F.S_U": "s_u", "F.D_U": "d_u_v"}[name]
        return replace(rig, **{field: getattr(rig, field) * factor})
    field = f"{name[:2].lower()}_den"
    den = list(getattr(rig, field))
    den[len(den) - 1 - int(name[-1])] *= factor
    return replace(rig, **{field: tuple(den)})


def independent_slopes(rig: Rig, trace: Trace, names: list[str]) -> Array:
    """Return d y / d log value by central differences of the integrator, shape (p, N)."""
    grid, h = Grid(RATE_HZ, trace.size, 32, 0.0), 1e-4
    return np.array([
        (answer(moved(rig, n, 1 + h), trace.u, grid) - answer(moved(rig, n, 1 - h), trace.u, grid)) / (2 * h)
        for n in names
    ])  # fmt: skip


def test_it_is_the_fisher_information_of_independent_code() -> None:
    trace, model = played(), model_of(RIG)
    found = told_by(trace, model)
    coordinates = coordinates_of(plain_chain(model), plain_chain(model).values, ["planned"])
    names = [c.name for c in coordinates]
    slopes = independent_slopes(RIG, trace, names) / NOISE_V
    # the product searches log values of the blocks and F in units of its scales
    slopes *= np.array([[c.slope(0.0) / c.value(0.0)] for c in coordinates])
    size = np.sqrt(np.outer(*[np.sum(slopes**2, axis=1)] * 2))
    for step, matrix in zip(trace.steps, found.matrices, strict=True):
        part = slopes[:, step.start : step.stop]
        np.testing.assert_allclose(matrix / size, part @ part.T / size, atol=0.01, err_msg=step.label)


def test_the_expected_error_of_a_border_is_that_of_the_inverse_fisher_matrix() -> None:
    trace, model = played(), model_of(RIG)
    chain = plain_chain(model)
    names = [c.name for c in coordinates_of(chain, chain.values, ["planned"])]
    slopes = independent_slopes(RIG, trace, names) / NOISE_V
    covariance = np.linalg.inv(slopes @ slopes.T + np.diag([1.0 if n.startswith("G") else 1e-3 for n in names]))
    for expected in told_by(trace, model).expected()[:4]:
        at = names.index(expected.quantity.name)
        relative = np.sqrt(covariance[at, at])
        assert expected.sd / abs(expected.quantity.value) == pytest.approx(relative, rel=0.05)


def test_shares_add_up_and_a_stuck_sine_has_none() -> None:
    found = told_by(played(), model_of(RIG))
    for expected in found.expected():
        assert expected.told
        assert 0.9 < sum(expected.shares.values()) < 1.0
        assert expected.shares["stuck"] == 0.0
    silent = [step.label for step in found.steps() if step.tells_nothing]
    assert silent == ["stuck"]


def test_leaving_a_silent_step_out_costs_nothing() -> None:
    whole = told_by(played(), model_of(RIG))
    part = replace(whole, labels=whole.labels[1:], matrices=whole.matrices[1:], kinds=whole.kinds[1:])
    for a, b in zip(whole.expected(), part.expected(), strict=True):
        assert b.sd == pytest.approx(a.sd)


def test_what_no_step_moves_is_not_told() -> None:
    trace = played()
    only_stuck = Trace("t", RATE_HZ, np.asarray(trace.u[:800]), np.zeros(800))
    found = told_by(only_stuck, model_of(RIG))
    assert not any(e.told for e in found.expected())
    assert all(e.to_dict()["half_width_95"] is None for e in found.expected())
    assert found.steps()[0].label == "t"


def test_readings_that_do_not_count_bring_nothing() -> None:
    trace, model = played(), model_of(RIG)
    chain = plain_chain(model)
    use = np.ones(trace.size, dtype=bool)
    use[800:1600] = False
    coordinates = coordinates_of(chain, chain.values, ["planned"])
    part = information(chain, coordinates, [Observation(trace, use, NOISE_V)])
    whole = information(chain, coordinates, [Observation(trace, np.ones(trace.size, dtype=bool), NOISE_V)])
    assert not part.matrices[1].any()
    np.testing.assert_allclose(part.matrices[2], whole.matrices[2])


def test_a_second_recording_of_a_step_doubles_its_information() -> None:
    trace, model = played(), model_of(RIG)
    chain = plain_chain(model)
    coordinates = coordinates_of(chain, chain.values, ["planned"])
    seen = Observation(trace, np.ones(trace.size, dtype=bool), NOISE_V)
    once, twice = (information(chain, coordinates, [seen] * n) for n in (1, 2))
    np.testing.assert_allclose(twice.matrices, 2.0 * once.matrices)
    assert twice.times_s == tuple(2.0 * t for t in once.times_s)


def test_a_linear_rig_is_asked_for_gain_offset_and_responses() -> None:
    model = Model("RC", Rational((1.0,), (0.02, 1.0)), LinearF(2.0, 0.1), Rational((1.0,), (1.0,)), NOISE_V)
    found = told_by(played(), model)
    names = [e.quantity.name for e in found.expected()]
    assert names[:2] == ["F.gain", "F.offset"]
    assert names[2].startswith("|G1| at ")
    assert not any(name.startswith("|G2|") for name in names)
    assert all(e.told for e in found.expected())


def test_a_backlash_of_no_width_still_has_sizes() -> None:
    flat = replace(model_of(RIG), f=Backlash(2.0, 0.0, 2.0, 0.0))
    assert all(np.isfinite(e.relative) for e in told_by(played(), flat).expected())
