"""Are candidates fitted from where it leads somewhere, and as long as it may matter?"""

from dataclasses import replace

import pytest

from identify.candidates import Candidate
from identify.effects import catalogue, chain_of
from identify.explain import race
from identify.explain.bench import Bench
from identify.explain.hypothesis import Hypothesis
from identify.explain.plain import prepared
from identify.explain.promise import Promise
from identify.explain.race import KEPT, doubled, raced
from identify.holdout import split
from identify.stage import Place
from tests.proof.ask import known_effects, parted
from tests.proof.bench import record
from tests.proof.cases import Concealed
from tests.proof.rigs import OP_AMP, RC
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.proof.trial import Key, drawn
from tests.trials import model_of, observed, recorded

NOISE_V = 0.010
RAIL = catalogue()["saturation"](Place.F, "lower")


@pytest.fixture(scope="module")
def bench() -> Bench:
    """Return a bench with a recording in which a rail is concealed."""
    concealed = (Concealed("saturation", {"upper": float("inf"), "lower": -12.3}),)
    seen = observed(recorded(OP_AMP, staircase("walk", FIG13_LEVELS_V, 0.02), concealed, NOISE_V, seed=7), NOISE_V)
    return Bench(chain_of(model_of(OP_AMP)), (seen,), (), tuple(catalogue().values()))


@pytest.fixture(scope="module")
def base(bench: Bench) -> Hypothesis:
    return bench.fitted(bench.plain, ())


@pytest.fixture(scope="module")
def rail(bench: Bench) -> Hypothesis:
    return bench.fitted(bench.with_effects((RAIL,), {"saturation.lower": -12.3}), (RAIL,))


def test_a_lag_of_which_the_plain_values_hold_back_a_part_is_found_from_twice_its_length():
    rig = replace(
        RC, g1_num=(1.0,), g1_den=(0.01257, 1.0), s_l=3.355, s_u=3.355, d_l_v=1.782, d_u_v=-1.202, g2_num=(1.0,),
        g2_den=(2.694e-3, 1.0),
    )  # fmt: skip
    runs = (
        staircase("walk", FIG13_LEVELS_V, 0.05), sine("slow", 20.0, 3.4, 10, 2), sine("fast", 62.5, 9.0, 20, 2),
    )  # fmt: skip
    late = (Concealed("source_pole", {"tau": 4e-3}),)
    seen = tuple(observed(recorded(rig, run, late, 0.015, seed=i), 0.015) for i, run in enumerate(runs))
    bench, lag = Bench(chain_of(model_of(rig)), seen, (), ()), catalogue()["source_pole"](Place.SOURCE)
    base = bench.fitted(bench.plain, ())
    held = bench.fitted(bench.with_effects((lag,), {**base.fit.chain.values, "source_pole.tau": 1e-3}), (lag,))
    assert held.fit.converged
    assert held.misfit > 1.0
    (found,) = doubled(bench, base, [held])
    assert abs(found.misfit) < 0.1
    assert found.fit.chain.values["source_pole.tau"] == pytest.approx(4e-3, rel=1e-3)
    assert doubled(bench, base, [found]) == [found]  # with nothing left there is nothing to look for
    fall = base.chi2 - held.chi2
    assert doubled(bench, base, [held], 5.0 * fall) == [held]  # twice as strong it explains four times as much


def test_a_fit_is_continued_only_where_its_slope_promises_more_and_it_gains(bench, base, rail, monkeypatch):
    """One sprint was not the end of it; whether there is a next lap is what its slope says, then what laps gain."""
    promise = Promise(Candidate(RAIL, {}, 0.0), bench.plain, 0.0)
    laps: list[int] = []
    near, far = (replace(rail, chi2=rail.chi2 - by) for by in (100.0, 0.5 * (base.chi2 - rail.chi2)))
    for beyond, gain, known, count in (
        (0.1, 5.0, [], 0), (5.0, 0.0, [], 1), (5.0, 5.0, [], 12),
        (50.0, 20.0, [near], 12), (50.0, 20.0, [near, far], 0),
    ):  # fmt: skip
        left = replace(rail, fit=replace(rail.fit, converged=False, beyond=beyond))

        def fitted(bench, chain, effects, iterations, left=left, gain=gain):
            laps.append(iterations)
            return replace(left, chi2=left.chi2 - len(laps) * gain)

        monkeypatch.setattr(race, "_extended", lambda bench, base, promise, left=left: left)
        monkeypatch.setattr(Bench, "fitted", fitted)
        laps.clear()
        (found,) = raced(replace(bench, asked={}), base, [promise], known)
        assert len(laps) == count  # none where what is known already is far ahead
        assert found.chi2 == pytest.approx(rail.chi2 - count * gain)


@pytest.mark.parametrize(
    ("level", "kept", "by", "begun"),
    [
        (-4.0, KEPT + 0.1, 1.02, 1), (-4.0, KEPT - 0.1, 1.02, 2), (-12.0, KEPT - 0.1, 1.02, 1),
        (-4.0, KEPT - 0.1, 1.0, 1),
    ],
)
def test_a_fit_begins_from_both_sides_where_first_order_keeps_not_what_it_promises(
    bench, base, rail, monkeypatch, level, kept, by, begun
):
    """A rail at -4 V leaves more than none, one at -12 V less; where nothing is promised to move the sides are one."""
    there = RAIL.put_in(base.fit.chain, {"lower": level})
    moved = there.with_values({"F.S_U": by * there.values["F.S_U"]})
    starts: list[float] = []

    def fitted(bench, chain, effects, iterations):
        starts.append(chain.values["F.S_U"])
        return replace(rail, chi2=base.chi2 - kept * 1000.0 - len(starts))

    monkeypatch.setattr(Bench, "fitted", fitted)
    found = race._extended(bench, base, Promise(Candidate(RAIL, {}, 0.0), moved, 1000.0))
    assert len(starts) == len(set(starts)) == begun
    assert found.chi2 == base.chi2 - kept * 1000.0 - begun  # the better one


def test_a_slew_limit_that_first_order_takes_for_sharp_is_rounded_all_the_same():
    """Its lag is then zero, where it has no slope: the fit ended there, 20 times above the noise."""
    rounded = Concealed("slew_limit, rounded", {"rate": 400.0, "lag": 2.6e-3})
    seen = observed(recorded(OP_AMP, staircase("walk", FIG13_LEVELS_V, 0.06), (rounded,), NOISE_V, seed=7), NOISE_V)
    bench, law = Bench(chain_of(model_of(OP_AMP)), (seen,), (), ()), catalogue()["slew_limit"](Place.F, "rounded")
    base = bench.fitted(bench.plain, ())
    sharp = law.put_in(base.fit.chain, {"rate": 420.0, "lag": 0.0})
    (found,) = raced(bench, base, [Promise(Candidate(law, {}, 0.0), sharp, 0.0)])
    assert abs(found.misfit) < 0.1
    assert found.fit.chain.values["slew_limit.lag"] == pytest.approx(2.6e-3, rel=0.02)


def test_a_law_is_fitted_once_from_where_it_is_promised(bench, base, monkeypatch):
    """Whether it foretells what repeats differ by is asked before a round asks what it explains."""
    there = RAIL.put_in(base.fit.chain, {"lower": -12.3})
    promises = [Promise(Candidate(RAIL, {}, gain), there, gain) for gain in (0.0, 1.0)]
    (first,) = raced(bench, base, promises[:1])
    monkeypatch.setattr(race, "_extended", lambda *asked: pytest.fail("it was fitted again"))
    (again,) = raced(bench.of_kinds(()), base, promises[1:])
    assert again is first


def test_a_round_of_some_kinds_is_remembered_and_answers_for_no_others(bench, base):
    some = bench.of_kinds((catalogue()["saturation"],))
    found = some.round(base)
    assert [h.names for h in found.tried[:1]] == [("saturation",)]
    assert bench.of_kinds(()).round(base).tried == ()
    assert bench.of_kinds(some.kinds).round(base) is found


def test_a_law_so_large_that_first_order_leads_nowhere_is_reached_by_a_part_of_the_way():
    """A sensor that loses four fifths of one sign: from all of what is promised it leaves more than no law does, and
    falls behind another that bends F there.
    """
    trial = drawn(Key(9400, "free", "rectifying_sensor", 27), known_effects())
    data = split(model_of(trial.nominal), *parted(record(trial)))
    others = tuple(known_effects() - {"rectifying_sensor", "soft_saturation"})
    there, plain = prepared(model_of(trial.nominal), data, others)
    this = there.round(plain, 0.0)
    assert this.best is not None
    assert abs(this.best.misfit) < 0.05
    (law,) = trial.physics
    assert this.best.fit.chain.values["rectifying_sensor.lost"] == pytest.approx(law.values["lost"], rel=0.01)
