"""Does sharing values cost two recordings what chance makes it, and a change what it should?"""

from dataclasses import replace

import numpy as np
import pytest

from identify.chain import plain_chain
from identify.compared.together import Side, chance, rise
from identify.compared.unproven import unproven
from identify.fit import fit
from identify.model import Backlash, Model, Rational
from identify.trace import Trace
from tests.trials import observed

NOISE_V = 0.01
RATE_HZ = 1000.0
MODEL = Model("quick", Rational((1.0,), (0.02, 1.0)), Backlash(2.0, 0.5, 2.0, -0.5), Rational((1.0,), (0.005, 1.0)))
U = np.concatenate([np.repeat([0.0, 1.5, -1.5, 0.7, -1.1, 1.3], 120), 1.4 * np.sin(np.arange(600) / 40.0)])


def side(seed: int, model: Model = MODEL, wider: float = 1.0) -> Side:
    """Return one side, fitted from the plain model to what another one answers."""
    from identify.chain import simulate

    blank = Trace(f"run{seed}", RATE_HZ, U, np.zeros_like(U))
    y = simulate(plain_chain(model), blank, 2) + np.random.default_rng(seed).normal(0.0, NOISE_V, U.size)
    seen = (observed(replace(blank, y=y), NOISE_V),)
    return Side(fit(plain_chain(MODEL), seen), seen, wider)


MOVED = replace(MODEL, f=replace(MODEL.f, d_l_v=0.502))


def test_one_rig_twice_rises_as_a_chi_squared_of_its_values() -> None:
    pairs = [rise((side(2 * i), side(2 * i + 1))) for i in range(16)]
    assert [r.freedom for r in pairs] == pytest.approx([6.0] * 16, abs=0.05)
    assert np.mean([r.chi2 for r in pairs]) == pytest.approx(6.0, abs=4 * np.sqrt(12.0 / 16))
    assert sum(r.p_value < 0.05 for r in pairs) <= 4


def test_a_moved_value_costs_what_its_standard_errors_say() -> None:
    one, other = side(100), side(101, MOVED)
    both = rise((one, other))
    alone = rise((one, other), ("F.D_L",))
    z = (other.fit.chain.values["F.D_L"] - one.fit.chain.values["F.D_L"]) / np.hypot(
        one.fit.sd("F.D_L"), other.fit.sd("F.D_L")
    )
    assert alone.chi2 == pytest.approx(z**2, rel=0.1)
    assert both.chi2 >= alone.chi2
    assert both.p_value < 1e-4


def test_the_answer_is_the_same_whichever_side_comes_first() -> None:
    one, other = side(5), side(6, MOVED)
    there, back = rise((one, other)), rise((other, one))
    assert there.chi2 == pytest.approx(back.chi2, rel=1e-3)
    assert there.freedom == pytest.approx(back.freedom)


def test_wider_intervals_make_the_same_difference_worth_less() -> None:
    plain, wide = (rise((side(7, wider=w), side(8, MOVED, w))).chi2 for w in (1.0, 2.0))
    assert wide == pytest.approx(plain / 4.0, rel=0.02)


def test_what_neither_side_tells_is_no_degree_of_freedom() -> None:
    stuck = Trace("stuck", RATE_HZ, 0.1 * U, np.random.default_rng(0).normal(0.0, NOISE_V, U.size))
    seen = (observed(stuck, NOISE_V),)
    dead = Side(fit(plain_chain(MODEL), seen), seen)
    assert rise((dead, dead)).freedom < 0.5
    assert rise((dead, dead)).p_value == pytest.approx(1.0)


def test_a_noise_known_from_few_readings_makes_a_rise_less_sure() -> None:
    assert chance(20.0, 6.0, float("inf")) < chance(20.0, 6.0, 30.0) < 0.05
    assert chance(20.0, 0.0, 30.0) == 1.0


def test_values_prove_a_change_only_where_the_model_follows_or_lacks_the_same_under_one_stimulus() -> None:
    good, wide = side(9), side(10, wider=1.5)
    assert unproven((good, side(11)), searched=False) == ""
    assert "the later one" in unproven((good, wide), searched=True)
    assert unproven((wide, wide), searched=True) == ""
    other = replace(good.observations[0], trace=replace(good.observations[0].trace, u=0.9 * U))
    played = replace(good, observations=(other,))
    assert "other stimuli were played" in unproven((good, played), searched=False)
    assert unproven((good, played), searched=True) == ""
    assert "other parts" in unproven((wide, played), searched=True)
