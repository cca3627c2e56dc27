"""Are mains found where they are, off their own frequency too, and none in noise alone?"""

import numpy as np
import pytest
from scipy.signal import lfilter

from identify.effects import catalogue, chain_of
from identify.effects.hum import MAINS_HZ
from identify.explain.bench import Bench
from identify.explain.plain import prepared
from identify.holdout import split
from identify.mains import Mains
from identify.spectrum import matched
from identify.stage import Place
from identify.trace import Trace
from tests.proof.ask import known_effects, parted
from tests.proof.bench import record
from tests.proof.rigs import RC
from tests.proof.trial import Key, drawn
from tests.trials import model_of, observed

NOISE_V = 0.01
HUMS = tuple(catalogue()["hum"](Place.SENSE, form) for form in catalogue()["hum"].forms)


def idle(seconds, seed, line_v=0.0, line_hz=50.0, pole=0.0, rate_hz=1000.0):
    """Return a bench with recordings of nothing but noise, and of a line that begins where it likes in each of them.

    The noise is white, or what one pole makes of that, of three times the variance it is taken for.
    """
    rng, runs = np.random.default_rng(seed), []
    for number, size in enumerate(np.round(np.asarray(seconds) * rate_hz).astype(int)):
        t = np.arange(size) / rate_hz + rng.uniform(0.0, 1.0)
        noise = rng.normal(0.0, NOISE_V * np.sqrt(3.0 * (1.0 - pole**2) if pole else 1.0), size)
        y = line_v * np.sin(2.0 * np.pi * line_hz * t) + lfilter([1.0], [1.0, -pole], noise)
        runs.append(observed(Trace(f"idle {number}", rate_hz, np.zeros(size), y), NOISE_V, 1))
    return Bench(chain_of(model_of(RC)), tuple(runs), (), (catalogue()["hum"],))


def p_values(bench):
    """Return how likely noise alone would do as well as the best fit of every form."""
    base = bench.fitted(bench.plain, ())
    evidence = bench.evidence(base)
    found = []
    for hum in HUMS:
        near = [Mains(evidence, hum, hum.lines, mains_hz) for mains_hz in MAINS_HZ]
        chains = [hum.put_in(base.fit.chain, mains.values()) for mains in near]
        found.append(min(bench.fitted(chain, (hum,)).p_value(base) for chain in chains))
    return found


@pytest.mark.parametrize(("line_hz", "seconds"), [(50.0, (2.0, 3.0)), (49.93, (60.0,)), (60.41, (30.0, 20.0, 30.0))])
def test_a_line_of_a_third_of_the_noise_is_found_where_it_is(line_hz, seconds):
    """In a minute, mains 0.07 Hz off are four turns away from where they should be."""
    bench = idle(seconds, 5, 0.003, line_hz)
    evidence = bench.evidence(bench.fitted(bench.plain, ()))
    near = Mains(evidence, HUMS[0], HUMS[0].lines, round(line_hz, -1))
    assert near.frequency_hz == pytest.approx(line_hz, abs=0.5 / max(seconds))  # half a turn
    assert min(p_values(bench)) < 1e-9


@pytest.mark.parametrize("seconds", [(2.0,) * 4, (10.0,) * 2], ids=["short", "long"])
def test_what_noise_alone_makes_is_as_likely_as_said(seconds):
    """Two mains, each searched for within half a hertz, and a line's angle in every run: noise makes much of that."""
    told = np.array([p_values(idle(seconds, seed)) for seed in range(12)]).ravel()
    assert np.count_nonzero(told < 0.1) <= 7  # of 24: one time in 500 more, were they as likely as said
    assert np.median(told) < 0.999  # nor is it taken for far less likely than it is


@pytest.mark.parametrize("line_v", [0.0, 0.008], ids=["none", "a line"])
def test_mains_stand_out_of_noise_that_hangs_together_or_are_none(line_v):
    """Noise of 50 Hz of bandwidth has twice the power at the mains that its white part has: no line begins there."""
    bench = idle((4.0,) * 3, 3, line_v, 50.1, pole=0.7)
    evidence = bench.evidence(bench.fitted(bench.plain, ()))
    assert [bool(hum.starts(evidence)) for hum in HUMS] == [line_v > 0.0, False]


def test_a_line_is_not_told_from_the_mains_by_one_too_fast_for_the_samples():
    """Five times 55 Hz, 333 times a second, looks like 58 Hz, and so 60.41 Hz like five times 54.59 Hz."""
    bench = idle((10.0,) * 2, 3, 0.01, 60.41, rate_hz=1000.0 / 3.0)
    (start,) = HUMS[0].starts(bench.evidence(bench.fitted(bench.plain, ())))
    assert start["frequency"] == pytest.approx(60.41, abs=0.02)
    assert start["amplitude"] == pytest.approx(0.01, rel=0.1)


@pytest.mark.parametrize("rate_hz", [80.0, 100.0, 200.0])
def test_of_mains_too_fast_for_the_samples_nothing_is_told(rate_hz):
    """At 200 Hz the first line of the mains is still seen, no line of a rectifier is; at 100 Hz none is."""
    bench = idle((10.0,) * 2, 3, 0.05, 50.1, rate_hz=rate_hz)
    evidence = bench.evidence(bench.fitted(bench.plain, ()))
    found = [hum.starts(evidence) for hum in HUMS]
    assert found[1] == []
    assert [round(start["frequency"], 1) for start in found[0]] == ([50.1] if rate_hz == 200.0 else [])


def trial(key):
    """Return what the plain model leaves of a sealed trial, and the trial."""
    case = drawn(key, known_effects())
    model = model_of(case.nominal)
    bench, plain = prepared(model, split(model, *parted(record(case))))
    return bench.evidence(plain), case


def test_mains_at_v_stand_out_of_the_plateaus_that_the_gap_makes_of_them():
    """Lines at 55 Hz explain four tenths of these plateaus, too, but what they leave is twice that."""
    evidence, case = trial(Key(61, "single", "hum", 0))
    (start,) = catalogue()["hum"](Place.G1, "").starts(evidence)
    assert start["frequency"] == pytest.approx(case.expected[0].parameters["frequency"], abs=0.02)


def test_noise_at_v_that_the_gap_makes_plateaus_of_is_no_mains():
    evidence, _ = trial(Key(50, "single", "process_noise", 1))
    assert float(np.mean(np.square(evidence.residual))) > 1000.0
    hums = [catalogue()["hum"](place, form) for place in (Place.G1, Place.F) for form in catalogue()["hum"].forms]
    assert [start for hum in hums for start in hum.starts(evidence)] == []


def test_lines_that_make_nearly_the_same_explain_it_once():
    """Against least squares at every frequency, of lines that a gap has made alike, and of some samples that count."""
    rng, rate_hz, size = np.random.default_rng(5), 1000.0, 4000
    use = rng.random(size) < 0.8
    t, orders = np.flatnonzero(use) / rate_hz, np.array([1, 3])
    shared = rng.normal(size=t.size) + 1j * rng.normal(size=t.size)
    lines = np.stack([np.exp(2j * np.pi * 50.0 * t) + shared, 0.5 * shared + 0.1 * np.exp(2j * np.pi * 150.0 * t)])
    residual = rng.normal(size=t.size) + 0.3 * shared.real
    told = matched(residual, lines, orders, use, 1.0 / rate_hz, 0.5, 9)
    for off_hz, fall in zip(np.linspace(-0.5, 0.5, 9), told, strict=True):
        turning = lines * np.exp(2j * np.pi * np.outer(orders * off_hz, t))
        rows = np.concatenate([turning.real, turning.imag])
        left = residual - np.linalg.lstsq(rows.T, residual)[0] @ rows
        assert fall == pytest.approx(float(residual @ residual - left @ left), rel=0.01, abs=0.2)
