"""Is physics of no catalogue located at its stage, on the coordinate that it goes with?

What is planted comes from the bench's own integrator. The corrections are families: none of them is the law planted.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from identify.effects import chain_of
from identify.explain.bench import Bench
from identify.explain.entered import entered
from identify.explain.locate import LIKELY, Located, doubted, entered_at, located
from identify.explain.phrases import described
from identify.explain.shape import shape_of
from identify.explain.sought import one_again
from identify.explain.suddenly import WINDOW_S, from_a_run_on, in_breaks, suddenly
from identify.explain.suspects import suspects
from identify.stage import Place
from identify.unnamed.contact import Giving, Kicking
from identify.unnamed.hysteresis import Hysteresis
from identify.unnamed.linear import Filter
from identify.unnamed.maps import BrokenMap, LevelMap
from identify.unnamed.past import GapAfterLoad, GapAfterUse, Swiftness
from identify.unnamed.rates import GainOverRate, RateMap
from identify.unnamed.sudden import GainSince, Sudden, SuddenDynamics, SuddenGain
from identify.unnamed.timed import (
    GainOverClock,
    GainSteps,
    GapOverClock,
    LeadOverClock,
    OffsetInRun,
    OffsetOverClock,
    OffsetSteps,
    Timed,
)
from identify.unnamed.turned import LeadSinceTurn
from identify.unnamed.what import Offset
from tests.proof.cases import Concealed
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, Stimulus, sine, staircase
from tests.trials import model_of, observed, recorded

NOISE_V = 0.01
WALK, WAVE = staircase("walk", FIG13_LEVELS_V, 0.02), sine("wave", 20.0, 3.0, 3, 1)
SMALL, AGAIN = sine("small", 20.0, 1.9, 3, 1), staircase("again", FIG13_LEVELS_V, 0.02)
PLANTED = {  # law -> its values, the stage, the forms that may tell it, the least share of the misfit they explain
    "remembering_gap": ({"k": 0.02}, Place.F, {"gap after a turn", "gap within a run"}, 0.9),
    "rippling_gain": ({"share": 0.005, "frequency": 71.3}, Place.G1, {"ripple of the gain"}, 0.9),
    "plastic_gap": ({"k": 0.02}, Place.F, {"gap after the farthest"}, 0.99),
    "sawtooth": ({"size": 0.05, "frequency": 72.08}, Place.G1, {"line with overtones"}, 0.9),
    "one_way_slew": ({"rate": 400.0}, Place.F, {"lag behind a rate"}, 0.9),
    "drifting_pole in G1": ({"rate": 2e-3, "tau": 5e-3}, Place.G1, {"drift of the dynamics"}, 0.9),
    "drifting_pole in G2": ({"rate": 2e-3, "tau": 5e-3}, Place.G2, {"drift of the dynamics"}, 0.9),
    "touched_part in G1": ({"share": 0.3, "tau": 2e-3, "moment": 1.5}, Place.G1, {"sudden dynamics"}, 0.8),
    "touched_part in G2": ({"share": 0.3, "tau": 2e-3, "moment": 1.5}, Place.G2, {"sudden dynamics"}, 0.8),
    "varistor in G1": ({"k": 0.02, "top": 3.0, "tau": 0.02}, Place.G1, {"current over the level"}, 0.9),
    "varistor in G2": ({"k": 0.2, "top": 20.0, "tau": 2e-3}, Place.G2, {"current over the level"}, 0.9),
    "detents": ({"pull": 2.0, "pitch": 7.0}, Place.F, {"creep on plateaus"}, 0.9),
    "trigger": ({"size": 0.3, "level": 5.0}, Place.F, {"relays"}, 0.99),
    "stick_slip": ({"stuck": 0.3}, Place.F, {"stick and slip"}, 0.7),
    "giving_contact": ({"tau": 1e-3}, Place.F, {"contact that gives way"}, 0.99),
    "kicking_contact": ({"kick": 0.2}, Place.F, {"kick at opening"}, 0.99),
    "debounced_contact": ({"wait": 2e-3}, Place.F, {"after impact"}, 0.9),
    "switching_gain": ({"share": 0.05, "level": 4.0}, Place.SENSE, {"relays"}, 0.99),
    "adc_averaging": ({"length": 1e-3}, Place.G2, {"filter"}, 0.99),
    "ringing_contact": ({"size": 0.2, "frequency": 150.0}, Place.F, {"after contact", "after either contact"}, 0.7),
    "worked_gain": ({"k": 0.02, "tau": 0.1, "top": 600.0}, Place.F, {"gain after motion"}, 0.9),
    "rectified_offset": ({"k": 0.05, "tau": 0.1}, Place.G1, {"offset after use"}, 0.9),
    "late_converter": ({"late": 2e-5}, Place.SENSE, {"ripple of the delay"}, 0.9),
    "later_contact": ({"k": 1e-3}, Place.F, {"either border over the rate", "map of the rate"}, 0.9),
    "crosstalk": ({"size": 0.2, "level": 0.7}, Place.SENSE, {"map of the source"}, 0.6),
    "wavy_adc": ({"size": 0.1, "period": 6.0}, Place.SENSE, {"map of the level"}, 0.6),
    "hurried_reading": ({"k": 0.05, "top": 600.0}, Place.SENSE, {"gain over the rate"}, 0.9),
    "dac_glitch": ({"size": 0.05, "tau": 3e-3}, Place.SOURCE, {"pulse at zero"}, 0.99),
    "dead_dac": ({"dead": 0.6}, Place.SOURCE, {"corners of the level"}, 0.9),
    "tired_source": ({"k": 0.05}, Place.SOURCE, {"gain after use"}, 0.9),
    "sagging_supply": ({"k": 4e-3, "tau": 0.05}, Place.SENSE, {"gain after use"}, 0.9),
}  # fmt: skip
AROUND = {"top": 6.0, "speed": 100.0, "u": 3.0, "tau": 0.01, "span": 50.0, "moment": 3.03}
PLANTED |= {  # put together by chance (tests/proof/composed.py)
    "gap by history, straight": ({**AROUND, "k": 0.3}, Place.F, {"gap after level", "gap after motion"}, 0.9),
    "gain of v by speed, beyond": ({**AROUND, "k": 0.3}, Place.G1, {"gain over the rate"}, 0.9),
    "gain of v by peak, square": ({**AROUND, "k": 0.2}, Place.G1, {"gain after the farthest"}, 0.9),
    "gain of u by moment, straight": ({**AROUND, "k": 0.1}, Place.SOURCE, {"sudden gain"}, 0.9),
}
LASTING = {  # told by more than a walk and a wave: by what another wave, or the same walk 40 s later, has another of
    "drifting_pole in G1", "drifting_pole in G2", "touched_part in G1", "touched_part in G2", "worked_gain",
    "late_converter", "hurried_reading", "rippling_gain", "sawtooth",
    *(law for law in PLANTED if " by " in law),
}  # fmt: skip


def bench_of(*runs: Stimulus, physics: Concealed) -> Bench:
    """Return the bench of recordings of the op-amp rig; the last begin 40 s after the first."""
    starts_s = [3.0 * i for i in range(len(runs) - 1)] + [40.0]
    traces = [
        recorded(OP_AMP, s, (physics,), NOISE_V, i, at, 8) for i, (s, at) in enumerate(zip(runs, starts_s, strict=True))
    ]
    return Bench(chain_of(model_of(OP_AMP)), tuple(observed(t, NOISE_V, 1) for t in traces), (), ())


def found(*runs: Stimulus, physics: Concealed) -> Located:
    """Return where the mismatch of recordings of the op-amp rig enters."""
    bench = bench_of(*runs, physics=physics)
    return located(bench, bench.fitted(bench.plain, ()))


@cache
def planted(law: str) -> Located:
    """Return where the mismatch of recordings with a law of the list enters; several tests look at some of them."""
    runs = (WALK, WAVE, SMALL, AGAIN) if law in LASTING else (WALK, WAVE)
    return found(*runs, physics=Concealed(law, PLANTED[law][0]))


@pytest.mark.parametrize("law", [pytest.param("trigger", marks=pytest.mark.counted) if law == "trigger" else law
                                 for law in PLANTED])  # fmt: skip
def test_a_law_that_nobody_listed_is_located_on_what_it_goes_with(law: str) -> None:
    _, place, forms, least = PLANTED[law]
    told = planted(law)
    assert told.significant
    assert (told.best.place, told.best.form in forms) == (place, True), told.best
    assert told.share > least
    assert told.places[place] > 0.3


def test_fits_that_came_out_the_same_once_more_are_compared(monkeypatch: pytest.MonkeyPatch) -> None:
    told, asked = planted("giving_contact"), []
    again = replace(told, fitted=tuple((law, replace(fitted)) for law, fitted in told.fitted))
    monkeypatch.setattr("identify.explain.locate._others", lambda *_: again)
    monkeypatch.setattr("identify.explain.locate._doubt", lambda _, found: asked.append(found) or 1.0)
    assert doubted(None, told).doubt == 1.0  # type: ignore[arg-type]  # nothing is asked of the bench
    assert [id(one) for one in asked] == [id(told), id(again)]


def test_what_is_left_beside_the_law_is_noise_where_nothing_would_be_found_in_it() -> None:
    """The noise was measured 3 % low: so much is left by the right law, and by one at F only by half as much more."""
    told = planted("varistor in G1")
    (law, best), (other, second) = told.fitted[0], next(pair for pair in told.fitted if pair[0].place is Place.F)
    count, known = best.count, 0.04
    right = replace(best, chi2=1.06 * count, noise_known=known), replace(second, chi2=1.09 * count, noise_known=known)
    found = replace(told, fitted=((law, right[0]), (other, right[1])), prices=told.prices[:2])
    assert found.alternatives() == replace(found, doubt=30.0).alternatives() == (Place.F,)
    assert replace(found, doubt=0.0).alternatives() == ()
    assert described(replace(found, doubt=0.0)).endswith(" accounts for all of the misfit but what may be noise")
    assert described(found).endswith(f" accounts for {100 * found.share:.0f} % of the misfit")
    sure = replace(found, fitted=tuple((c, replace(h, noise_known=0.01)) for c, h in found.fitted))
    assert replace(sure, doubt=0.0).alternatives() == (Place.F,)  # the noise is known better than that


def test_the_current_that_a_varistor_draws_is_drawn_over_its_level() -> None:
    """As planted, 0.02 v (v / 3 V)^4 over the resistance, but for a straight line, which G1 and F make up for."""
    told = planted("varistor in G1")
    shape = shape_of(told.best, told.fitted[0][1].fit, told.base.data)
    assert shape is not None
    assert (shape.values, shape.value_unit, shape.axis) == ("drawn", "V", "level of v")
    bent = [c - np.polyval(np.polyfit(shape.at, c, 1), shape.at) for c in (shape.curves[0], shape.at**5 * 0.02 / 81.0)]
    assert np.max(np.abs(bent[0] - bent[1])) < 0.1 * np.ptp(bent[1])  # most at the ends, which ten knots leave straight


def test_one_lag_is_one_again_beside_the_plain_values_that_the_law_leaves() -> None:
    """These stand in for a contact that gives way, and first order does not lead back from there."""
    told = planted("giving_contact")
    law, fitted = next((law, fitted) for law, fitted in told.fitted if isinstance(law, Giving))
    assert law.knots == pytest.approx((1e-3,), rel=0.02)
    there = bench_of(WALK, WAVE, physics=Concealed("giving_contact", {"tau": 1e-3}))
    plain = there.fitted(told.base.fit.chain.with_values(fitted.fit.chain.values), (), 0)
    once, again = (one_again(there.evidence(h), law).correction.knots[0] for h in (told.base, plain))
    assert abs(once - 1e-3) > 2.0 * abs(again - 1e-3)


def test_a_gain_over_the_rate_that_g2_hardly_changes_may_be_of_f_or_of_the_reading() -> None:
    """With 2 % both leave the same to a few of chi-squared: one alone would be a guess."""
    told = found(WALK, WAVE, SMALL, AGAIN, physics=Concealed("hurried_reading", {"k": 0.02, "top": 600.0}))
    assert told.best.form == "gain over the rate"
    assert min(told.places[place] for place in (Place.F, Place.SENSE)) > LIKELY
    members = entered(told, unproven=False)
    assert members[0].stage == told.best.place.label
    fits = {c.stage: c.fit for c in members if not c.exact}
    for stage in ("F", "sense"):
        assert fits[stage].chain.stage_of(GainOverRate).place.label == stage
    assert [(c.stage, c.fit) for c in members if c.exact] in ([], [("G2", None)])


def test_a_gap_that_follows_the_past_is_a_disguise_where_an_offset_in_front_of_it_foretells_what_it_does() -> None:
    """Both borders moved alike are an offset of v: with a number less, and no gap that changes."""
    told = planted("rectified_offset")
    gaps = [(law, fitted) for law, fitted in told.fitted if isinstance(law, GapAfterLoad | GapAfterUse)]
    assert min(fitted.chi2 for _, fitted in gaps) == min(fitted.chi2 for _, fitted in told.fitted)
    assert all(told.foretold(law, fitted) for law, fitted in gaps)
    assert told.places[Place.G1] > 2.0 * told.places[Place.F]


def test_linear_dynamics_are_the_same_on_either_side_of_a_linear_block() -> None:
    """What is behind G2 is what is read; a contact that kicks as it opens is v kicked as it turns, nearly."""
    assert Filter(Place.G1, (1e-3,)).same_at == (Place.G1, Place.SOURCE)
    assert Filter(Place.G2, (1e-3,)).same_at == (Place.G2, Place.SENSE)
    assert Swiftness(Place.G2, (-1.0, 1.0)).same_at == (Place.G2, Place.SENSE)
    assert Swiftness(Place.G1, (-1.0, 1.0)).same_at == (Place.G1,)
    assert Kicking(Place.F, (-1.0, 1.0)).like_at == (Place.F, Place.G1)
    told = planted("adc_averaging")
    assert told.alternatives()[0] is Place.SENSE


@pytest.mark.parametrize(("kind", "exact"), [
    (OffsetOverClock, False), (GainOverClock, False), (OffsetInRun, False),
    (OffsetSteps, False), (GainSteps, True), (GainSince, True),
])  # fmt: skip
def test_what_is_slow_is_the_same_on_either_side_of_a_linear_block(kind: type[Timed | GainSince], exact: bool) -> None:
    """A gain that goes with the clock passes G1 nearly as it is, one that holds in every run exactly so."""
    told = {place: kind(place, (0.0, 1.0)) for place in kind.places}
    added = (Place.F,) if issubclass(kind, Offset) else ()  # to v, which is either border moved as far
    assert told[Place.G1].like_at == (Place.G1, *added, Place.SOURCE)
    assert told[Place.SENSE].like_at == (Place.SENSE, Place.G2, Place.F)
    assert told[Place.G1].same_at == (Place.G1, *added, *((Place.SOURCE,) if exact else ()))
    assert told[Place.SENSE].same_at == (Place.SENSE, Place.G2, *((Place.F,) if exact else ()))


@pytest.mark.parametrize("law", [LevelMap(Place.G1, (-6.0, -2.0, 2.0, 6.0)), BrokenMap(Place.G1, (1.4,))])
def test_a_law_of_v_alone_gives_the_data_of_borders_bent_alike(law: LevelMap | BrokenMap) -> None:
    """F compares w with its borders at every instant: whether v or they are bent, it finds the same."""
    assert law.same_at == (Place.G1, Place.F)
    assert [replace(law, place=place).same_at for place in (Place.SOURCE, Place.F)] == [(Place.SOURCE,), (Place.F,)]


def test_a_lag_that_changes_is_nearly_the_same_in_front_of_g1() -> None:
    """One that only the clock tells when is read so late."""
    assert [LeadSinceTurn(place, (0.0, 0.1)).like_at for place in LeadSinceTurn.places] == [
        (Place.G1, Place.SOURCE), (Place.G2, Place.SENSE)
    ]  # fmt: skip
    assert LeadOverClock(Place.SENSE, (0.0, 0.1)).like_at == (Place.SENSE, Place.G2)


def test_what_shows_only_while_f_moves_may_have_entered_in_front_of_it() -> None:
    """A table as fine as the data says no more than when; one of few numbers that does better at F is at F."""
    fine = tuple(np.linspace(0.0, 1.0, 1000).tolist())
    assert entered_at(OffsetOverClock(Place.F, fine)) == (Place.F, Place.G1, Place.SOURCE)
    assert entered_at(OffsetOverClock(Place.SENSE, fine)) == (Place.SENSE, Place.G2, Place.F)
    assert entered_at(GapOverClock(Place.F, (0.0, 0.5, 1.0))) == (Place.F,)


def test_where_a_fit_keeps_little_of_what_was_promised_others_are_fitted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Though all that is left may be what nobody knows of the noise's size."""
    stuck = Concealed("stick_slip", {"stuck": 0.3})
    traces = [recorded(OP_AMP, s, (stuck,), NOISE_V, i, 3.0 * i, 8) for i, s in enumerate((WALK, WAVE, SMALL))]
    seen = tuple(observed(t, NOISE_V, 1) for t in traces)
    bench = Bench(chain_of(model_of(OP_AMP)), seen, (), (), noise_known=1.0)
    monkeypatch.setattr("identify.explain.free_form.contenders", lambda ranked, noise: [
        s for s in ranked if (s.correction.form, s.correction.place) == (Hysteresis.form, Place.G1)
    ])  # fmt: skip
    told = located(bench, bench.fitted(bench.plain, ()))
    assert told.best.place is Place.F
    assert len(told.fitted) > 1


@pytest.mark.parametrize(("behind", "listed"), [(2e-4, True), (2e-2, False)])
def test_what_knots_round_off_a_large_mismatch_excludes_no_other_place(behind: float, listed: bool) -> None:
    """Far above the noise a table of the rate is not the law: the right one may be behind one at another stage."""
    told = planted("one_way_slew")
    best = told.fitted[0][1]
    base = replace(told.base, chi2=best.chi2 + 1e6)
    other = RateMap(Place.G2, (-1.0, 0.0, 1.0))
    pair = (told.fitted[0], (other, replace(best, chi2=best.chi2 + behind * 1e6)))
    places = Located(base, pair, 0.0, (0.0, 0.0)).places
    assert next(iter(places)) is told.best.place
    assert (places[Place.G2] > LIKELY) is listed


def test_the_moment_at_which_something_came_in_is_known_to_the_sample() -> None:
    """In the middle of a sine: at the source it is behind G1 a little later, and so told from the same at v."""
    told = planted("gain of u by moment, straight")
    assert told.best.knots[-1] == pytest.approx(3.03, abs=1.5e-4)
    assert told.places[Place.SOURCE] > 5.0 * told.places[Place.G1] > 0.0


@pytest.mark.parametrize("law", ["gain of u by moment, straight", "gain of v by moment, straight"])
def test_what_came_in_between_two_runs_is_told_as_from_a_run_on(law: str) -> None:
    """The source and G1 give exactly the same data then, and the moment is nowhere in particular."""
    told = found(WALK, WAVE, SMALL, AGAIN, physics=Concealed(law, {**AROUND, "k": 0.1, "moment": 2.0}))
    assert (told.best.form, told.best.place) == ("gain from a run on", Place.G1)
    assert told.best.knots == pytest.approx((0.5 * (WALK.u.size * 1e-4 + 3.0),), abs=1e-3)
    assert told.best.same_at == (Place.G1, Place.SOURCE)
    assert told.places[Place.G1] > told.places[Place.SOURCE] > LIKELY
    assert [c.exact for c in entered(told, unproven=False) if c.stage == "source"] == [True]


def test_a_moment_may_be_that_of_a_break_beside_it_the_more_the_nearer_it_is() -> None:
    there = bench_of(WALK, WAVE, SMALL, AGAIN, physics=Concealed("gain of v by moment, straight", {**AROUND, "k": 0.0}))
    starts = [o.trace.start_s for o in there.observations]
    near, far = (in_breaks(SuddenGain(Place.SOURCE, (starts[2] + by,)), there.observations) for by in (0.01, 0.05))
    assert len(near) == len(far) == 2
    assert starts[1] < near[0][0].knots[0] < starts[2] < near[1][0].knots[0] < starts[3]
    assert near[0][1] > far[0][1] > 0.0
    assert far[1][1] > near[1][1] > 0.0
    assert from_a_run_on(near[0][0]) == GainSince(Place.G1, near[0][0].knots)
    assert in_breaks(SuddenDynamics(Place.G1, (1e-3, 20.0)), there.observations) == []


def test_a_moment_is_sought_only_where_more_than_chance_would_be_there() -> None:
    there = bench_of(WALK, WAVE, physics=Concealed("gain of v by moment, straight", {**AROUND, "k": 0.0}))
    assert not [s for s in suspects(there.evidence(there.fitted(there.plain, ()))) if isinstance(s.correction, Sudden)]


def test_a_moment_is_found_where_no_plain_value_is_free_and_not_at_the_beginning() -> None:
    """What is there from the beginning, as a pole is, did not come in."""
    names = tuple(p.name for p in chain_of(model_of(OP_AMP)).parameters())
    physics = Concealed("gain of v by moment, straight", {**AROUND, "k": 0.05})
    there = replace(bench_of(WALK, WAVE, SMALL, AGAIN, physics=physics), fixed=names)
    promised = list(suddenly(there.evidence(there.fitted(there.plain, ())).fine))
    ((best, gain),) = (pair for pair in promised if (pair[0].form, pair[0].place) == ("sudden gain", Place.G1))
    assert gain == pytest.approx(max(most for _, most in promised), rel=1e-9)  # the source's does the same
    assert all(law.place in (Place.SOURCE, Place.G1) for law, most in promised if most > 0.9 * gain)
    assert best.knots[-1] == pytest.approx(3.03, abs=2.0 * WINDOW_S)  # then sought as far
    always = bench_of(WALK, WAVE, SMALL, AGAIN, physics=Concealed("extra_pole in G1", {"tau": 2e-3}))
    found = [law for law, _ in suddenly(always.evidence(always.fitted(always.plain, ())).fine)]
    assert {law.place for law in found} == set(Place)
    assert min(law.knots[-1] for law in found) > 0.05 * sum(o.trace.size for o in always.observations) * 1e-4


def test_a_law_that_leaves_something_may_be_one_of_another_stage_by_as_much() -> None:
    law = "gain of v by speed, beyond"
    told, there = planted(law), bench_of(WALK, WAVE, SMALL, AGAIN, physics=Concealed(law, PLANTED[law][0]))
    doubt = doubted(there, told)
    assert doubt.doubt < 1e-3 * (told.base.chi2 - told.fitted[0][1].chi2)  # the law leaves nothing
    assert doubt.alternatives() == told.alternatives()
    (_, best), (other, second) = told.fitted[0], next(pair for pair in told.fitted if pair[0].place is Place.F)
    behind = second.chi2 - best.chi2
    assert told.places[Place.F] < LIKELY < replace(told, doubt=3.0 * behind).places[Place.F]
    assert other.place in replace(told, doubt=3.0 * behind).alternatives()
    (wrong,) = ((law, fitted) for law, fitted in told.fitted if (law.place, law.form) == (other.place, other.form))
    assert doubted(there, replace(told, fitted=(wrong,), prices=(0.0,))).doubt > 0.3 * behind  # it leaves some
