"""Do sections multiply back to the denominator they were taken from, and are unstable ones mirrored?"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.model import Rational
from identify.sections import is_stable, mirrored, product, sections

real = st.floats(-3.0, 5.0).map(lambda power: [-(10.0**power)])
pair = st.tuples(st.floats(-3.0, 5.0), st.floats(0.01, 1.0)).map(
    lambda drawn: [10.0 ** drawn[0] * (-drawn[1] + turn * 1j * np.sqrt(1.0 - drawn[1] ** 2)) for turn in (1, -1)]
)


@settings(max_examples=200)
@given(st.lists(st.one_of(real, pair), min_size=1, max_size=3))
def test_sections_multiply_to_their_denominator(poles):
    roots = [pole for group in poles for pole in group]
    den = np.poly(roots).real / np.prod(np.abs(roots))
    parts = sections(den.tolist())
    assert all(value > 0.0 for part in parts for value in part)
    assert [len(part) for part in parts] == [2] * (len(roots) // 2) + [1] * (len(roots) % 2)
    assert product(parts) == pytest.approx((den / den[-1]).tolist(), rel=1e-7)


def test_poles_that_lie_close_share_a_section():
    fast, slow = sections(np.poly([-1.0, -20.0, -30.0]).tolist())
    assert np.sort(np.roots((*fast, 1.0))) == pytest.approx([-30.0, -20.0])
    assert slow == pytest.approx((1.0,))
    inner, outer = sections(np.poly([-1.0, -20.0, -30.0, -900.0]).tolist())
    assert [np.sort(np.roots((*part, 1.0))).tolist() for part in (inner, outer)] == [
        pytest.approx([-30.0, -20.0]), pytest.approx([-900.0, -1.0])
    ]  # fmt: skip


def test_an_order_of_two_keeps_its_coefficients():
    assert sections((1e-4, 20.0, 1000.0)) == (pytest.approx((1e-7, 0.02)),)
    assert sections((2.0, 4.0)) == ((0.5,),)
    assert sections((3.0,)) == ()
    assert product(()) == (1.0,)


def test_unstable_sections_are_refused():
    with pytest.raises(ValueError, match="not stable"):
        sections((1.0, 0.5, 1.0, 1.0))


def test_mirrored_poles_keep_frequency_and_gain():
    block = Rational((2.0,), (1.0, 0.5, 1.0, 1.0), 0.1)
    assert not is_stable(block.den)
    turned = mirrored(block)
    assert is_stable(turned.den)
    assert turned.dc_gain == pytest.approx(block.dc_gain)
    assert turned.dead_time_s == 0.1
    assert np.sort(np.abs(np.roots(turned.den))) == pytest.approx(np.sort(np.abs(np.roots(block.den))), rel=3e-2)
    stable = Rational((2.0,), (1.0, 3.0, 3.0, 1.0))
    assert mirrored(stable) is stable


def test_a_pole_on_the_edge_gets_some_damping():
    poles = np.roots(mirrored(Rational((1.0,), (1.0, 1.0, 1.0, 1.0))).den)
    assert np.max(poles.real / np.abs(poles)) == pytest.approx(-0.2, rel=0.05)
