"""Are the steps of a linear block exact, as scipy and the closed forms know them?"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from identify import kernels
from identify.discretise import companion, stepper

STEP_S = 1e-4
BLOCKS = {
    "gain": ((3.0,), (2.0,)),
    "first order": ((1000.0,), (20.0, 1000.0)),
    "lead-lag": ((1e-3, 1.0), (4e-3, 1.0)),
    "op-amp G1": ((1000.0,), (1e-4, 20.0, 1000.0)),
    "op-amp G2": ((1000.0,), (1e-6, 2.0, 1000.0)),
    "resonance": ((4e5,), (1.0, 120.0, 4e5)),
    "third order": ((2e-3, 1.0), (1e-9, 3e-6, 3e-3, 1.0)),
    "fourth order": ((1.0,), (1e-12, 4e-9, 6e-6, 4e-3, 1.0)),
}
BLOCK = pytest.mark.parametrize(("num", "den"), BLOCKS.values(), ids=BLOCKS)


def levels(count, seed=0):
    return np.repeat(np.random.default_rng(seed).uniform(-3.0, 3.0, count // 20), 20)


def run(step, inputs):
    out = np.empty(inputs.size)
    kernels.linear(step.one, step.four, step.at_rest(), 0.0, inputs, out)
    return out


@BLOCK
def test_ramp_input_agrees_with_lsim(num, den):
    u = np.concatenate([[0.0], np.random.default_rng(1).normal(size=400)])
    _, expected, _ = signal.lsim((num, den), u, STEP_S * np.arange(u.size), interp=True)
    assert np.allclose(run(stepper(num, den, STEP_S, "ramp"), u), expected, rtol=0, atol=1e-8)


@BLOCK
def test_held_input_agrees_with_lsim_one_instant_on(num, den):
    """s[j] holds before instant j; lsim's U[j] holds after it, and a direct path still shows the level before."""
    u = levels(400)
    _, y, x = signal.lsim((num, den), np.concatenate([u, u[-1:]]), STEP_S * np.arange(u.size + 1), interp=False)
    direct = signal.tf2ss(num, den)[3].item()
    expected = y[1:] - direct * np.concatenate([u[1:], u[-1:]]) + direct * u
    assert np.all(np.isfinite(x))
    assert np.allclose(run(stepper(num, den, STEP_S, "held"), u), expected, rtol=0, atol=1e-8)


@BLOCK
@pytest.mark.parametrize("fraction", [1 / 8, 3 / 8, 7 / 8])
def test_late_update_agrees_with_eight_times_finer_steps(num, den, fraction):
    u = levels(200)
    late = round(8 * fraction)
    fine = np.concatenate([np.zeros(late), np.repeat(u, 8)])[: 8 * u.size]
    expected = run(stepper(num, den, STEP_S / 8, "held"), fine)[7::8]
    assert np.allclose(run(stepper(num, den, STEP_S, "held", fraction), u), expected, rtol=0, atol=1e-9)


def test_first_order_steps_are_exponentials_written_out():
    tau_s = 2.5e-4
    held, ramp = stepper((1.0,), (tau_s, 1.0), STEP_S, "held"), stepper((1.0,), (tau_s, 1.0), STEP_S, "ramp")
    fall = np.exp(-STEP_S / tau_s)
    assert held.rows[0][0] == pytest.approx(fall, rel=1e-13)
    assert held.c[0] * held.g1[0] == pytest.approx(1.0 - fall, rel=1e-13)
    assert held.g0 == (0.0,)
    assert ramp.c[0] * ramp.g1[0] == pytest.approx(1.0 - (1.0 - fall) * tau_s / STEP_S, rel=1e-12)


@settings(deadline=None, max_examples=50)
@given(
    st.lists(st.floats(1e-5, 1e-1), min_size=1, max_size=4), st.floats(0.1, 10.0),
    st.sampled_from(["ramp", "held"]), st.floats(0.0, 0.99),
)  # fmt: skip
def test_a_level_held_for_ever_comes_out_with_the_dc_gain(taus_s, gain, shape, fraction):
    den = (1.0,)
    for tau in taus_s:
        den = tuple(np.convolve(den, (tau, 1.0)).tolist())
    step = stepper((gain,), den, STEP_S, shape, fraction)
    rows, push = np.array(step.rows), np.array(step.g0) + np.array(step.g1)
    settled = np.linalg.solve(np.eye(len(push)) - rows, push)
    assert np.array(step.c) @ settled + step.d == pytest.approx(gain, rel=1e-6)


def test_states_are_scaled_so_that_entries_stay_near_one():
    a, _, _, _, w0 = companion((1.0,), (1e-12, 4e-9, 6e-6, 4e-3, 1.0))
    assert w0 == pytest.approx(1000.0)
    assert np.abs(a).max() < 10.0


def test_a_block_without_dynamics_is_a_gain_with_one_idle_state():
    step = stepper((3.0,), (2.0,), STEP_S, "held")
    assert (step.d, step.order, step.at_rest()) == (1.5, 1, (0.0,))


@pytest.mark.parametrize("den", [(1.0,), (2e-3, 1.0), (1e-6, 2e-3, 1.0)])
def test_zeros_in_front_of_a_numerator_say_nothing(den):
    assert stepper((0.0, 0.0, 0.0, 5.0), den, STEP_S, "held") == stepper((5.0,), den, STEP_S, "held")


@pytest.mark.parametrize(
    ("num", "den", "message"),
    [
        ((1.0, 2.0, 3.0), (1.0, 1.0), "numerator of order 2 over denominator of order 1 is not realisable"),
        ((1.0, 2.0), (1.0,), "numerator of order 1 over denominator of order 0 is not realisable"),
        ((1.0,), (1.0, 0.0), "must not be 0"),
        ((1.0,), (0.0, 1.0), "must not be 0"),
    ],
)
def test_blocks_no_circuit_can_be_are_refused(num, den, message):
    with pytest.raises(ValueError, match=message):
        stepper(num, den, STEP_S, "held")
