"""Is the size of a step found among all sizes, and are levels judged as a simulation judges them?"""

import numpy as np
import pytest

from identify.chain import plain_chain
from identify.comb import Comb, centred, comb, rounded
from identify.effects.dac_quantisation import DacQuantisation
from identify.evidence import Evidence
from identify.fit import fit
from identify.stage import Place
from tests.proof.cases import Concealed
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, observed, recorded

LEVELS = np.array([-3.5, -2.87, -1.91, -1.3, -0.44, 0.31, 0.97, 1.66, 2.23, 2.81])
LSB = 0.01573


def of_error(error, rng, noise_v=1e-5):
    """Return the comb of ten levels that are heard one by one, each with a little noise."""
    return Comb(LEVELS, np.diag(np.full(LEVELS.size, 1e9)), 1e9 * (error + noise_v * rng.standard_normal(LEVELS.size)))


@pytest.mark.parametrize("lsb", [LSB, 4.87e-5], ids=["10 bits", "19 bits"])
def test_the_step_is_found_among_all(lsb):
    found = of_error(rounded(LEVELS, lsb) - LEVELS, np.random.default_rng(3), 6e-4 * lsb).best(20.0, 4)
    assert found[0] == pytest.approx(lsb, rel=1e-3)
    assert len(found) == len(set(found)) <= 4


def test_one_level_or_none_says_nothing_of_steps():
    one = np.array([1.0])
    assert Comb(one, np.eye(1), one).best(20.0, 4) == []
    assert Comb(one[:0], np.eye(0), one[:0]).best(20.0, 4) == []


def test_a_run_at_one_level_says_nothing_of_steps():
    """Of a pulse that is up nearly all the time; it was divided by what other levels there are."""
    pulse = staircase("pulse", (0.0, 2.5), 0.05)
    seen = observed(recorded(OP_AMP, pulse, (), 1e-3, 1, fine=8), 1e-3)
    evidence = Evidence(fit(plain_chain(model_of(OP_AMP)), [seen]), [seen])
    assert comb(evidence).levels.size == 0
    assert DacQuantisation(Place.SOURCE).starts(evidence) == []


def test_steps_that_round_alike_are_one_to_a_fit():
    """Within these no level changes its code: all that a derivative sees is the size of the steps."""
    u = np.linspace(-10.0, 10.0, 2001)
    lsb = centred(0.0312345)
    for near in (lsb - 1e-10, lsb + 1e-10):
        assert np.allclose(rounded(u, near) / near, rounded(u, lsb) / lsb, rtol=0, atol=1e-9)
    least, most = Comb(LEVELS, np.eye(10), LEVELS).alike(lsb)
    assert least < lsb < most
    codes = np.round(LEVELS / lsb)
    assert np.array_equal(np.round(LEVELS / (least + 1e-9)), codes)
    assert np.array_equal(np.round(LEVELS / (most - 1e-9)), codes)
    assert not np.array_equal(np.round(LEVELS / (most + 1e-6)), codes)


def test_a_step_at_the_edge_of_those_that_round_alike_is_moved_inside():
    """As it is searched in whole parts of a nanovolt, a held level may be rounded to another step there."""
    teeth = Comb(LEVELS, np.eye(10), LEVELS)
    least, most = teeth.alike(0.0312345)
    inner = np.linspace(least, most, 5)[1:-1]
    assert [teeth.inside(lsb) for lsb in inner] == pytest.approx(inner)
    for edge in (least, most):
        step = centred(teeth.inside(edge + np.sign(0.0312345 - edge) * 1e-12))
        assert least < step < most
        assert np.array_equal(np.rint(rounded(LEVELS, step) / step), np.round(LEVELS / 0.0312345))


@pytest.fixture(scope="module")
def evidence():
    steps = (Concealed("dac_quantisation", {"lsb": LSB}),)
    played = (staircase("stairs", tuple(0.93 * v for v in FIG13_LEVELS_V), 0.05), sine("sine", 10.0, 3.4, 2, 1))
    seen = [observed(recorded(OP_AMP, s, steps, 0.01, i), 0.01, 1) for i, s in enumerate(played)]
    return Evidence(fit(plain_chain(model_of(OP_AMP)), seen), seen)


def test_what_a_comb_promises_a_simulation_gives(evidence):
    steps = DacQuantisation(Place.SOURCE)
    promised = comb(evidence).gains(np.array([LSB]))[0]
    assert promised == pytest.approx(evidence.gain(steps, {"lsb": LSB}), rel=0.02)


def test_steps_do_not_start_at_the_edge_of_those_that_round_alike(evidence, monkeypatch):
    """There the size next to it, to which the start is rounded, puts a held level on another step."""
    least, most = comb(evidence.coarse).alike(LSB)
    edges, compared = [most - 1e-12, least + 1e-12], []
    monkeypatch.setattr(Comb, "best", lambda teeth, range_v, count: edges)
    monkeypatch.setattr(DacQuantisation, "_left", lambda steps, there, values: compared.append(values["lsb"]) or 0.0)
    DacQuantisation(Place.SOURCE).starts(evidence)
    room = 0.01 * (most - least)
    assert len(compared) == len(edges)
    assert all(least + room < lsb < most - room for lsb in compared)


def test_steps_start_where_they_are(evidence):
    (start,) = DacQuantisation(Place.SOURCE).starts(evidence)
    assert start["lsb"] == pytest.approx(LSB, abs=2e-5)
