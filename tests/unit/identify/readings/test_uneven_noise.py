"""Is noise told that goes with the level, the rate or the clock, weighed as it is, and nothing else taken for it?"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from identify.chain import plain_chain, simulate
from identify.colour import Colour, Sizes, whitening
from identify.explain.explain import explain
from identify.readings.mend import _is_tail, mended
from identify.readings.outliers import FarOut, Outliers
from identify.readings.uneven_noise import OverClock, OverLevel, OverRate, uneven_noise
from tests.proof.ask import parted
from tests.proof.bench import record
from tests.proof.cases import Concealed
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.proof.trial import Key, drawn
from tests.trials import model_of, recorded

NOISE_V = OP_AMP.noise_v
CHAIN = plain_chain(model_of(OP_AMP))
QUIET = [
    recorded(OP_AMP, stimulus, (), 0.0, 0, 3.0 * i, 8)
    for i, stimulus in enumerate((
        staircase("stairs", FIG13_LEVELS_V, 0.05, 2), sine("wave", 10.0, 3.4, 20, 2), sine("kept", 12.5, 3.1, 20, 2),
    ))
]  # fmt: skip
TOP_V = max(float(np.max(np.abs(trace.y))) for trace in QUIET)
TOP_RATE = max(float(np.max(np.abs(np.gradient(trace.y)))) for trace in QUIET)


def even(trace):
    return np.ones(trace.size)


def by_level(trace):
    return 1.0 + np.abs(trace.y) / TOP_V


def by_rate(trace):
    return 1.0 + 2.0 * np.abs(np.gradient(trace.y)) / TOP_RATE


def by_clock(trace):
    return 1.0 + (trace.start_s + np.arange(trace.size) / trace.rate_hz > 4.0)


def scattered(size, seed=0):
    """Return recordings of which every reading scatters ``size`` times the noise."""
    rng = np.random.default_rng(seed)
    return [replace(t, y=t.y + NOISE_V * size(t) * rng.normal(size=t.size)) for t in QUIET]


def told(traces):
    left = [(trace, trace.y - simulate(CHAIN, trace, 8)) for trace in traces]
    return uneven_noise(left[:2], left[2:])


def test_a_reference_that_is_not_quiet_is_told_though_most_readings_are_low():
    """A third more noise at the ends, a twentieth in the mean: all was said to agree."""
    trial = drawn(Key(95, "outside", "noisy_reference", 0))
    train, test = parted(record(trial))
    few = [trace for trace in train if trace.name in ("staircase", "sine_large", "sine_medium", "sine_fast")]
    told = explain(model_of(trial.nominal), few, test)
    assert told.verdict == "unexplained"
    assert [(f.id, f.form, f.stage) for f in told.effects] == [("unnamed", "uneven noise", "sense")]
    assert told.location.where[0].axis == "level of y"


@pytest.mark.parametrize(("size", "kind"), [(by_level, OverLevel), (by_rate, OverRate), (by_clock, OverClock)])
def test_noise_is_told_with_what_it_goes_and_how_large_it_is_there(size, kind):
    traces = scattered(size)
    noise = told(traces)
    assert isinstance(noise.blemish, kind)
    assert noise.blemish.p_value < 1e-6
    for trace, quiet in zip(traces, QUIET, strict=True):
        ratio = noise.of(trace) / (NOISE_V * size(quiet))
        assert np.quantile(np.abs(np.log(ratio)), 0.95) < 0.2
        assert np.sqrt(np.mean(np.square(ratio))) == pytest.approx(1.0, abs=0.03)
    most = noise.blemish.values["most"]
    assert most.low < most.value < most.high
    low, high, share = noise.blemish.span
    assert low < high
    assert 0.2 < share <= 1.0
    assert kind is not OverClock or low == pytest.approx(4.0, abs=0.2)


@pytest.mark.parametrize(("more", "told_of"), [(0.08, True), (0.04, False)])
def test_noise_is_uneven_where_it_moves_odds(more, told_of):
    """A twelfth more noise from a moment on; of a twenty-fifth more nobody need know."""
    assert (told(scattered(lambda trace: 1.0 + more * (by_clock(trace) - 1.0))) is not None) is told_of


def test_even_noise_is_even():
    assert [told(scattered(even, seed)) for seed in range(5)] == [None] * 5


def test_what_comes_through_g2_is_no_noise_of_the_reading():
    """As large where the reading moves, but each reading near the one before: physics, which may be missing."""
    rng = np.random.default_rng(1)
    smooth = [
        replace(t, y=t.y + 40.0 * NOISE_V * by_rate(t) * lfilter([0.02], [1.0, -0.98], rng.normal(size=t.size)))
        for t in scattered(even)
    ]
    assert told(smooth) is None


@pytest.mark.parametrize(("hangs", "told_of"), [(0.5, True), (0.86, False)])
def test_readings_that_are_late_by_chance_hang_together_less_than_what_g2_lets_pass(hangs, told_of):
    """Where one that is late makes the next one later; a lag of 240 Hz lets noise pass that hangs together by 0.86."""
    rng, traces = np.random.default_rng(7), []
    for t in QUIET:
        alike = lfilter([np.sqrt(1.0 - hangs**2)], [1.0, -hangs], rng.normal(size=t.size))
        traces.append(replace(t, y=t.y + NOISE_V * (rng.normal(size=t.size) + 3.0 * (by_rate(t) - 1.0) * alike)))
    noise = told(traces)
    assert (noise is not None) is told_of
    assert noise is None or isinstance(noise.blemish, OverRate)


def test_what_is_not_so_in_readings_kept_back_is_not_told():
    fitted, kept = scattered(by_level), scattered(even)
    assert told([*fitted[:2], kept[2]]) is None


def test_coarse_steps_of_an_adc_make_scatter_of_their_own():
    step_v = 2.0 * NOISE_V
    assert told([replace(t, y=step_v * np.round(t.y / step_v)) for t in scattered(even)]) is None


def test_readings_are_weighed_as_they_scatter_piece_by_piece_as_in_one():
    sizes, use = np.linspace(0.5, 2.0, 60), np.arange(60) % 7 > 0
    colour, values = Colour(sizes=Sizes(sizes)), np.random.default_rng(1).normal(size=(60, 2))
    whole, pieces = whitening(colour)(values, use), whitening(colour)
    assert np.allclose(whole, values[use] / sizes[use, None])
    assert np.allclose(whole, np.concatenate([pieces(values[:25], use[:25]), pieces(values[25:], use[25:])]))
    assert np.allclose(whole[:, 0], whitening(colour)(values[:, 0], use))
    assert not colour.white
    assert colour.of_one_run


def test_outliers_of_noise_that_goes_with_the_level_are_no_spikes():
    """They were, at the level at which the noise is largest."""
    traces = scattered(lambda t: 0.3 + 2.0 * np.square(t.y / TOP_V))
    seen = mended(CHAIN, traces[:2], traces[2:], NOISE_V)
    assert [blemish.id for blemish in seen.found] == []
    assert isinstance(seen.noise.blemish, OverLevel)
    level, noise = np.abs(QUIET[1].y), seen.noise.evened(traces[1], traces[1].y - QUIET[1].y)
    low, high = (float(np.std(noise[part])) for part in (level < 0.3 * TOP_V, level > 0.8 * np.max(level)))
    assert high == pytest.approx(low, rel=0.1)  # it was five times as large
    assert mended(CHAIN, traces[:2], traces[2:], NOISE_V, ("unnamed", "missing_samples")).noise is None


def test_a_reading_that_lies_far_out_once_all_scatter_alike_may_be_the_median_itself():
    """As recorded it is off by nothing, which was divided by nothing."""
    seen = Outliers(QUIET[0], np.array([0.0, 0.2]), np.array([8.0, -9.0]), NOISE_V, np.ones(2, dtype=bool),
                    np.zeros(2), np.zeros(2))  # fmt: skip
    far = FarOut([seen], 5.0, [np.arange(2)], 2, 1e-9)
    assert far.sizes_sd == pytest.approx([8.0, 9.0])
    assert not _is_tail(None, replace(far, threshold=1.0))  # and far above what any tail of it has


@pytest.mark.parametrize("size_v", [12.0 * NOISE_V, 40.0 * NOISE_V])
@pytest.mark.parametrize("seed", [0, 1])
def test_spikes_beside_uneven_noise_are_spikes_wherever_they_come(size_v, seed):
    """How fast readings move was asked of what they are as if all scattered alike, in which a spike moves."""
    rng = np.random.default_rng(seed + 50)
    thrown = [size_v * rng.choice([-1.0, 1.0], t.size) * (rng.uniform(size=t.size) < 0.002) for t in QUIET]
    traces = [replace(t, y=t.y + v) for t, v in zip(scattered(by_rate, seed), thrown, strict=True)]
    seen = mended(CHAIN, traces[:2], traces[2:], NOISE_V)
    (told_of,) = seen.found
    assert (told_of.id, type(seen.noise.blemish)) == ("spikes", OverRate)
    assert told_of.values["size"].low < size_v < told_of.values["size"].high
    rate = sum(np.count_nonzero(v) for v in thrown[:2]) / sum(t.size / t.rate_hz for t in QUIET[:2])
    assert told_of.values["rate"].low < rate < told_of.values["rate"].high


@pytest.mark.parametrize(("size", "freedom", "seed"), [(1.0, 4, 1), (2.0, 6, 0), (3.0, 6, 0)])
def test_the_tail_of_noise_that_is_large_where_readings_move_is_no_spike(size, freedom, seed, monkeypatch):
    rng = np.random.default_rng(seed)
    more = [size * np.sqrt(np.abs(np.gradient(t.y)) / TOP_RATE) for t in QUIET]
    traces = [
        replace(t, y=t.y + NOISE_V * (rng.normal(size=t.size) + each * rng.standard_t(freedom, size=t.size)))
        for t, each in zip(QUIET, more, strict=True)
    ]
    seen = mended(CHAIN, traces[:2], traces[2:], NOISE_V)
    assert ([blemish.id for blemish in seen.found], type(seen.noise.blemish)) == ([], OverRate)
    monkeypatch.setattr("identify.readings.mend.TAIL", 0.0)  # where that is not asked, they would be
    assert [blemish.id for blemish in mended(CHAIN, traces[:2], traces[2:], NOISE_V).found] == ["spikes"]


@pytest.mark.parametrize(
    ("concealed", "stage", "hold_s"),
    [
        (Concealed("feedthrough", {"k": 0.02}), "sense", 0.05),
        (Concealed("saturation", {"upper": 9.0, "lower": -9.0}), "F", 0.02),
    ],
    ids=["bypass", "rails"],
)
def test_beside_what_has_a_name_it_has_none_and_explains_nothing(concealed, stage, hold_s):
    """The rails are cut 50 times the noise; at their first place, with lags that make up for it, no step led on."""
    rng = np.random.default_rng(7)
    runs = (
        staircase("stairs", FIG13_LEVELS_V, hold_s, 2), sine("wave", 10.0, 3.4, 10, 2), sine("kept", 12.5, 3.1, 10, 2),
    )  # fmt: skip
    quiet = [recorded(OP_AMP, run, (concealed,), 0.0, 0, 3.0 * i, 8) for i, run in enumerate(runs)]
    traces = [replace(t, y=t.y + NOISE_V * by_level(t) * rng.normal(size=t.size)) for t in quiet]
    answer = explain(model_of(OP_AMP), traces[:2], traces[2:])
    assert answer.verdict == "explained"
    assert [finding.id for finding in answer.effects] == [concealed.name, "unnamed"]
    for name, true in concealed.values.items():
        told = answer.effects[0].parameters[name][0]
        assert abs(told.value - true) < told.high - told.low  # four standard deviations
    assert "unnamed" not in answer.sentence
    assert answer.location.stage == stage


def test_an_answer_places_it_at_the_sense_and_gives_it_no_name():
    traces = scattered(by_level)
    answer = explain(model_of(OP_AMP), traces[:2], traces[2:])
    assert answer.verdict == "unexplained"
    assert answer.location.stage == "sense"
    assert answer.location.where[0].axis == "level of y"
    assert [(finding.id, finding.stage, finding.form) for finding in answer.effects] == [
        ("unnamed", "sense", "uneven noise")
    ]
    assert "goes with the level of the reading" in answer.sentence
    assert answer.p_value < 1e-6
    assert answer.held_out.residuals.after_v == pytest.approx(answer.noise.rms_v, rel=0.05)
