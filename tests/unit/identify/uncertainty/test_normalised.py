"""Are borders and blocks told in the paper's scale, whatever scale the rig file has, and how sure are they there?"""

from dataclasses import replace

import numpy as np
import pytest

from identify.blocks import LinearBlock
from identify.chain import plain_chain
from identify.coordinate import coordinates_of
from identify.fit import Fit
from identify.model import Backlash, Model, Rational
from identify.uncertainty.certainty import certainty
from identify.uncertainty.normalised import peak_interval, scale_of, scaled_borders
from identify.uncertainty.response import points

PLAIN = Model("m", Rational((1.0,), (0.04, 0.4, 1.0)), Backlash(8.0, 1.25, 7.0, -1.0), Rational((1.0,), (0.1, 1.0)))
HZ = (0.1, 0.5, 2.0)


def scaled(k1: float, k2: float) -> Model:
    """Return the same rig with G1 k1 times and G2 k2 times as large (eq. 5a); k1 < 0 exchanges the borders."""
    f = PLAIN.f
    s_l, d_l, s_u, d_u = (f.s_l, f.d_l_v, f.s_u, f.d_u_v) if k1 > 0 else (f.s_u, f.d_u_v, f.s_l, f.d_l_v)
    gain = 1.0 / (k1 * k2)
    return replace(
        PLAIN, g1=Rational((k1,), PLAIN.g1.den), g2=Rational((k2,), PLAIN.g2.den),
        f=Backlash(s_l * gain, d_l * k1, s_u * gain, d_u * k1),
    )  # fmt: skip


def fit_of(model: Model, relative_sd: float = 1e-3) -> Fit:
    """Return a fit that ended at the model's values, every search coordinate known to ``relative_sd``."""
    chain = plain_chain(model)
    coordinates = coordinates_of(chain, chain.values, ["run"])
    covariance = relative_sd**2 * np.eye(len(coordinates))
    return Fit(chain, coordinates, np.zeros(len(coordinates)), 0.0, covariance, True, "converged")


def blocks(fit: Fit) -> dict[str, LinearBlock]:
    return {s.name: s for s in fit.chain.stages if isinstance(s, LinearBlock)}


@pytest.mark.parametrize(("k1", "k2"), [(2.0, 3.0), (0.1, -4.0), (-2.0, -3.0), (-0.5, 2.0)])
def test_the_normalised_answer_is_the_same_in_every_scale(k1, k2):
    expected, found = fit_of(PLAIN), fit_of(scaled(k1, k2))
    one, other = scale_of(expected), scale_of(found)
    assert other.v_p(found.chain) == pytest.approx(k1 * one.v_p(expected.chain))
    borders, again = scaled_borders(expected, one, 1.0)[1], scaled_borders(found, other, 1.0)[1]
    for name in borders:
        assert again[name].value == pytest.approx(borders[name].value)
    for name, first, second in (("G1", one.v_p, other.v_p), ("G2", None, lambda chain: k2)):
        at = points(expected, blocks(expected)[name], HZ, 1.0, first)
        for mine, his in zip(at, points(found, blocks(found)[name], HZ, 1.0, second), strict=True):
            assert (his.gain.value, his.phase_rad.value) == pytest.approx((mine.gain.value, mine.phase_rad.value))


def test_an_overshoot_counts_in_the_scale_and_in_its_doubt():
    fit = fit_of(replace(PLAIN, g1=Rational((1.0,), (0.04, 0.1, 1.0))))
    scale = scale_of(fit)
    v_p = peak_interval(fit, scale, 1.0)
    assert v_p.value == pytest.approx(1.0 + np.exp(-np.pi * 0.25 / np.sqrt(1.0 - 0.25**2)), rel=1e-6)
    assert v_p.high > v_p.value > v_p.low
    own, normalised = scaled_borders(fit, scale, 1.0)
    assert normalised["D_L"].value == pytest.approx(own["D_L"].value / v_p.value)
    relative = [(i.high - i.low) / abs(i.value) for i in (own["D_L"], v_p, normalised["D_L"])]
    assert relative[2] == pytest.approx(np.hypot(relative[0], relative[1]), rel=1e-4)  # independent errors


def test_an_overshoot_that_noise_would_make_counts_as_none():
    g1 = Rational((1.0,), (1.0, 1.9, 1.0))  # a damping ratio of 0.95: V_p = 1.00007
    doubtful, sure = (fit_of(replace(PLAIN, g1=g1), sd) for sd in (0.2, 1e-4))
    assert scale_of(doubtful).v_p(doubtful.chain) == 1.0
    assert scale_of(sure).v_p(sure.chain) == pytest.approx(1.0 + np.exp(-np.pi * 0.95 / np.sqrt(1.0 - 0.95**2)))


def test_the_covariance_of_the_rig_files_values_comes_from_the_search_coordinates():
    fit = fit_of(PLAIN)
    sure = certainty(PLAIN, fit, 2.0)
    assert set(sure.names) == {"G1.den.s2", "G1.den.s1", "F.S_L", "F.D_L", "F.S_U", "F.D_U", "G2.den.s1"}
    sd = np.sqrt(np.diag(sure.covariance))
    for name, one in zip(sure.names, sd, strict=True):
        assert one == pytest.approx(2.0 * fit.sd(name), rel=1e-6)
    low, high = fit.ci95("G2.den.s1", 2.0)
    assert (sure.interval("G2.den.s1").low, sure.interval("G2.den.s1").high) == pytest.approx((low, high), rel=1e-6)
    assert sure.interval("G1.dead_time").low == sure.interval("G1.dead_time").high == 0.0


def test_a_fit_that_failed_is_sure_of_nothing():
    fit = fit_of(PLAIN)
    lost = replace(fit, covariance=np.full_like(fit.covariance, np.inf))
    scale = scale_of(fit)
    assert scaled_borders(lost, scale, 1.0)[1]["S_L"].high == np.inf
    assert all(p.gain.high == np.inf for p in points(lost, blocks(lost)["G1"], HZ, 1.0, scale.v_p))
