"""Do fewer samples tell the same of a mismatch, and are they refused where they would not?"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from identify.candidates import candidates
from identify.chain import plain_chain, simulate
from identify.colour import Colour, Sizes, whitening
from identify.discretise import stepper
from identify.effects import catalogue
from identify.evidence import Evidence
from identify.explain.promise import promised
from identify.fit import fit
from identify.innovations import Wander
from identify.readings.coloured_noise import Coloured
from identify.readings.spectra import lines_of, power_of
from identify.stage import Place
from identify.thinning import fewest, thinned
from identify.trace import Trace
from tests.proof.cases import Concealed
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, observed, recorded

NOISE_V = 0.01
PLAYED = (staircase("stairs", FIG13_LEVELS_V, 0.12, 2), sine("sine", 31.25, 8.0, 25, 1))
CONCEALED = (
    ("offset_drift", Place.SENSE, Concealed("offset_drift", {"rate": 0.005}), {"rate": 0.005}),
    ("soft_saturation", Place.F, Concealed("soft_saturation", {"level": 90.0}), {"level": 90.0}),
    ("second_play", Place.F, Concealed("second_play", {"gap": 1.0, "weight": 0.01}), {"gap": 1.0, "weight": 0.01}),
    ("plateau_tilt", Place.F, Concealed("plateau_tilt", {"k": 0.002}), {"k": 0.002}),
    ("ac_coupling", Place.SENSE, Concealed("ac_coupling", {"tau": 300.0}), {"T": 300.0}),
)


def evidences(*physics, played=PLAYED, noise_v=NOISE_V):
    """Return what all samples of a fitted recording tell, and what fewer do."""
    traces = [recorded(OP_AMP, s, physics, noise_v, seed=3, start_s=9.0 * i) for i, s in enumerate(played)]
    seen = [observed(trace, noise_v, 8) for trace in traces]
    plain = fit(plain_chain(model_of(OP_AMP)), seen)
    return Evidence(plain, seen), Evidence(plain, thinned(plain, seen).observations)


@pytest.mark.parametrize(("name", "place", "concealed", "values"), CONCEALED, ids=[c[0] for c in CONCEALED])
def test_fewer_samples_promise_the_same_gain(name, place, concealed, values):
    every, fewer = evidences(concealed)
    effect = catalogue()[name](place, catalogue()[name].forms[0])
    assert not effect.quick
    assert len(fewer.residual) < 0.4 * len(every.residual)
    assert every.gain(effect, values) > 100.0
    assert fewer.gain(effect, values) == pytest.approx(every.gain(effect, values), rel=0.05)


def test_what_is_over_in_a_few_samples_is_looked_at_in_every_sample():
    every, fewer = evidences()
    both = Evidence(every.fitted, fewer.observations, every.observations)
    looked_at = both.seen_by(catalogue()["dead_time"](Place.G2))
    assert looked_at.observations == every.observations
    assert looked_at.coarse is both
    assert both.seen_by(catalogue()["offset_drift"](Place.SENSE)) is both


def test_a_knee_that_is_over_within_a_few_samples_is_looked_at_in_every_sample():
    """Of what a knee of 10 mV changes means of three samples keep less than half, and it began too wide to be named."""
    slow = (sine("slow", 4.0, 3.0, 2, 8), sine("sine", 10.0, 3.0, 4, 16), staircase("walk", FIG13_LEVELS_V, 0.02, 2))
    values, kind = {"width": 0.01}, catalogue()["soft_knee"]
    every, fewer = evidences(Concealed("soft_knee", values), played=slow, noise_v=0.001)
    both, effect = Evidence(every.fitted, fewer.observations, every.observations), kind(Place.F)
    assert every.gain(effect, values) > 300.0
    assert fewer.gain(effect, values) < 0.5 * every.gain(effect, values)
    begun = candidates(both, [kind])[0]
    assert begun.values == pytest.approx(candidates(every, [kind])[0].values)
    assert promised(both, begun).gain > 0.9 * every.gain(effect, values)


def test_means_keep_the_noise_of_a_sample():
    _, fewer = evidences()
    count = len(fewer.residual)
    assert float(fewer.residual @ fewer.residual) == pytest.approx(count, abs=4.0 * np.sqrt(2.0 * count))


def test_a_mean_counts_where_all_its_samples_do():
    every, fewer = evidences()
    holes = [replace(o, use=o.use & (np.arange(o.use.size) % 1000 != 7)) for o in every.observations]
    whole = thinned(every.fitted, holes).observations
    factor = round(every.observations[0].trace.rate_hz / whole[0].trace.rate_hz)
    lost = sum(int(np.sum(~o.use)) for o in holes)
    assert factor > 1
    counted, instead = (sum(o.count for o in some) for some in (fewer.observations, whole))
    assert instead == counted - lost


def test_a_mismatch_that_differs_from_sample_to_sample_is_judged_in_every_sample():
    every, fewer = evidences()
    assert thinned(every.fitted, every.observations).whole
    buzz = [
        replace(o, trace=replace(o.trace, y=o.trace.y + 0.02 * (-1.0) ** np.arange(o.trace.size)))
        for o in every.observations
    ]
    shown = thinned(every.fitted, buzz)
    assert not shown.whole
    assert [o.count for o in shown.observations] == [o.count for o in fewer.observations]


def test_coloured_noise_is_judged_in_every_sample_and_what_is_slow_of_it_scatters_as_told():
    rng, colour = np.random.default_rng(5), Colour((0.5,), 1.0 / np.sqrt(0.75))
    every, _ = evidences()
    clean = [simulate(every.chain, o.trace) for o in every.observations]
    noise = [lfilter([1.0 / colour.gain], [1.0, -0.5], rng.normal(size=y.size)) * NOISE_V for y in clean]
    coloured = [
        replace(o, trace=replace(o.trace, y=y + n), colour=colour, substeps=1)
        for o, y, n in zip(every.observations, clean, noise, strict=True)
    ]
    shown = thinned(every.fitted, coloured)
    assert not shown.whole
    residual = Evidence(every.fitted, shown.observations).residual
    slow = residual[: residual.size // 50 * 50].reshape(-1, 50).sum(axis=1) / np.sqrt(50.0)
    assert float(np.mean(np.square(slow))) == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / slow.size))


def test_means_of_what_wanders_are_made_as_white_as_its_readings():
    """What wanders in front of G2 by a walk of its own, here, beside the noise of a reading."""
    every, rng = evidences()[0], np.random.default_rng(7)
    chain, wandering = every.chain, []
    for o in every.observations:
        keeps, gains = np.full(o.use.size, 0.999), np.full(o.use.size, 0.04)
        w = lfilter([1.0], [1.0, -0.999], rng.normal(size=o.use.size) * np.sqrt(gains))
        lag = stepper((1.0,), (2e-3, 1.0), 1.0 / o.trace.rate_hz, "ramp")
        fades = np.exp(-1.0 / (2e-3 * o.trace.rate_hz))
        late = 1.0 - 2e-3 * o.trace.rate_hz * (1.0 - fades)
        passed = lfilter([late, 1.0 - fades - late], [1.0, -fades], w)
        y = simulate(chain, o.trace) + o.noise_v * (passed + rng.normal(size=w.size))
        trace = replace(o.trace, y=y)
        wandering.append(replace(o, trace=trace, substeps=1, colour=Colour(wander=Wander(keeps, gains, lag, o.use))))
    few = fewest(chain, wandering)
    assert [o.trace.rate_hz for o in few] == [o.trace.rate_hz / 3 for o in wandering]
    white = np.concatenate([part for o in few for part in o.whitened(chain)])
    assert np.mean(np.square(white)) == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / white.size))
    assert np.mean(white[1:] * white[:-1]) == pytest.approx(0.0, abs=0.03)
    bare = np.concatenate([o.used_residual(chain) / o.noise_v for o in few])
    assert np.mean(np.square(bare)) > 2.0  # beside the noise of means there is much that wanders
    shown = thinned(every.fitted, wandering)  # as much of it shows in means, where a mismatch is looked for
    assert shown.whole
    assert [o.trace.rate_hz for o in shown.observations] == [o.trace.rate_hz for o in few]
    assert all(o.colour.wander is not None for o in shown.observations)


def test_noise_that_is_told_reading_by_reading_is_not_thinned():
    every = evidences()[0]
    told = [replace(o, colour=Colour(sizes=Sizes(np.ones(o.use.size)))) for o in every.observations]
    taps = [replace(o, colour=Colour((0.5,), 1.0 / np.sqrt(0.75))) for o in every.observations]
    assert fewest(every.chain, told) is None
    assert fewest(every.chain, taps) is None
    assert fewest(every.chain, [o.until(2000) for o in every.observations]) is None  # too few
    assert fewest(every.chain, every.observations) is not None


def test_means_of_red_noise_are_made_as_white_as_its_readings():
    law, size = Coloured(1.0, 4.0, 1.7), 200_000
    run = Trace("run", 1e4, np.zeros(size), np.zeros(size))
    power = power_of(lines_of(run), lines_of(run), law.white_v, law.sd_v, law.slope)
    lines = np.fft.rfft(np.random.default_rng(6).normal(size=size))[1:] * np.sqrt(power)
    noise = np.fft.irfft(np.concatenate(([0.0], lines)), size) / law.rms_v
    means, colour = noise.reshape(-1, 5).mean(axis=1), law.colour(run)
    white = whitening(colour.of_means(5))(means, np.ones(means.size, dtype=bool))
    assert np.mean(np.square(white)) == pytest.approx(1.0, abs=0.1)
    slow = white.reshape(-1, 100).sum(axis=1) / 10.0
    assert 0.6 < np.std(slow) < 1.4
