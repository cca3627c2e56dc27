"""Which corrections are worth a fit, and what do they promise?"""

import numpy as np
import pytest

from identify.effects import chain_of
from identify.evidence import Evidence
from identify.explain.bench import Bench
from identify.explain.corrections import (
    APART,
    RESTS,
    RINGS,
    corrections,
    dwelt_levels,
    fast_s,
    speeds,
    with_zero,
)
from identify.explain.sought import finer, of_one_knot
from identify.explain.suspect import MOST, Suspect, contenders, explainable, overlooked, products_of, suspect
from identify.stage import Place
from identify.unnamed.contact import AfterContact, AfterEither, Giving, Sticking
from identify.unnamed.correction import Correction
from identify.unnamed.hysteresis import Relays
from identify.unnamed.lines import Flutter
from identify.unnamed.maps import LevelMap
from identify.unnamed.past import AFTER, OffsetAfterLoad
from identify.unnamed.rates import BorderOverRate, GapOverRate, Trailing
from identify.unnamed.timed import GainSteps, GapSteps, LeadSteps, OffsetSteps, Timed
from tests.proof.cases import Concealed
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, observed, recorded

STARTS_S = (0.0, 3.0, 7.0)


def evidence(*levels_v: float, physics: tuple[Concealed, ...] = ()) -> Evidence:
    """Return what two staircases over some levels and a sine leave of the op-amp rig's own model."""
    stimuli = (staircase("up", levels_v, 0.02), staircase("more", levels_v[::2], 0.03), sine("wave", 20.0, 3.0, 3, 1))
    begun = enumerate(zip(stimuli, STARTS_S, strict=True))
    traces = [recorded(OP_AMP, s, physics, 0.01, i, at, 4) for i, (s, at) in begun]
    bench = Bench(chain_of(model_of(OP_AMP)), tuple(observed(t, 0.01, 1) for t in traces), (), ())
    return bench.evidence(bench.fitted(bench.plain, (), 1))


@pytest.mark.parametrize(
    "law", [OffsetSteps(Place.SENSE, STARTS_S), GainSteps(Place.G1, STARTS_S), GapSteps(Place.F, STARTS_S),
            LeadSteps(Place.G2, STARTS_S)], ids=lambda law: law.form
)  # fmt: skip
def test_what_every_run_has_of_its_own_is_moved_at_once(law: Timed, monkeypatch: pytest.MonkeyPatch) -> None:
    there = evidence(*FIG13_LEVELS_V)
    names, at_once = products_of(there, law)
    monkeypatch.setattr(type(law), "only_knot", lambda _law, _start_s, _stop_s: None)
    again, one_by_one = products_of(there, law)
    assert names == again
    assert np.allclose(at_once.square, one_by_one.square, rtol=1e-12, atol=1e-9 * np.max(at_once.square))
    assert np.allclose(at_once.along, one_by_one.along, rtol=1e-9, atol=1e-9 * np.max(np.abs(at_once.along)))
    assert np.allclose(at_once.mimic, one_by_one.mimic, rtol=1e-9, atol=1e-9 * np.max(np.abs(at_once.mimic)))
    assert np.all(at_once.energies > 0.0)


def test_a_knot_inside_a_run_is_not_the_only_one() -> None:
    held = OffsetSteps(Place.SENSE, (0.0, 0.25, 3.0))
    assert [held.only_knot(0.0, 0.2), held.only_knot(0.0, 0.3), held.only_knot(3.0, 9.0)] == [0, None, 2]


def test_a_table_has_the_levels_that_u_rests_on_and_the_ends_of_its_range() -> None:
    """Levels that differ by next to nothing are one; those a sine passes are none."""
    there = evidence(-1.0, 0.3, 0.3 + 0.5 * APART * 6.0, 0.3 + 1e-9, 0.3 + 3.0 * APART * 6.0, 2.0, -1.0)
    assert dwelt_levels(there) == pytest.approx((-3.0, -1.0, 0.3, 0.318, 2.0, 3.0), abs=1e-3)
    assert 0.02 * there.observations[0].trace.rate_hz > RESTS


def promising(place: Place, gain: float, knots: int = 8) -> Suspect:
    """Return a map of the level that promises a fall of chi-squared, its eight weights seen equally well."""
    law = LevelMap(place, tuple(np.linspace(-1.0, 1.0, knots).tolist()))
    return Suspect(law, np.full(8, 1e6), np.full(8, gain / 8), {})


@pytest.mark.parametrize(("gain", "fitted"), [(1e5, [Place.G1]), (900.0, [])])
def test_what_promises_a_part_is_fitted_too_where_the_mismatch_leaves_first_order(
    gain: float, fitted: list[Place]
) -> None:
    """Of all that were not: no second of those that were, none that promises little, none too fine to fit."""
    shares = {Place.F: 1.0, Place.G1: 0.2, Place.G2: 0.1}
    ranked = [promising(place, share * gain) for place, share in shares.items()]
    ranked.insert(1, promising(Place.SENSE, 0.9 * gain, 2 * MOST))
    assert [s.correction.place for s in overlooked(ranked, contenders(ranked[:1], 1.0))] == fitted


def test_what_corrections_find_beyond_chance_is_there_to_explain() -> None:
    """Eight weights gain eight from noise alone; what noise may make of the best of several is nothing."""
    chance, found = promising(Place.F, 12.0), promising(Place.G2, 200.0)
    assert explainable([chance, found]) == pytest.approx(192.0)
    assert explainable([chance]) == 0.0
    assert explainable([]) == 0.0


@pytest.mark.parametrize(("taus_s", "lags"), [((0.07,), 1), ((0.004, 0.3), 5)])
def test_one_lag_that_is_sought_is_put_in_the_place_of_several_where_it_does(
    taus_s: tuple[float, ...], lags: int
) -> None:
    warm = tuple(Concealed("warm_joint", {"k": 0.3, "tau": tau, "top": 12.0}) for tau in taus_s)
    there = evidence(*FIG13_LEVELS_V, physics=warm)
    several = suspect(there, OffsetAfterLoad(Place.SENSE, (1e-3, 0.008, 0.05, 0.4, 3.0)))
    kept = finer(there, several, 1.0)
    assert len(kept.correction.knots) == lags
    if lags == 1:
        assert kept.correction.knots[0] == pytest.approx(taus_s[0], rel=0.1)
        assert kept.gain > several.gain
        assert 0.0 < kept.looks < kept.worth(1.0)[1]


@pytest.mark.parametrize(("physics", "law", "threshold_v"), [
    (Concealed("trigger", {"size": 0.3, "level": 5.0}), Relays(Place.F, (1.0, 2.5, 4.0, 7.0, 10.0)), 5.0),
    (Concealed("stick_slip", {"stuck": 0.3}), Sticking(Place.F, (0.05, 0.1, 0.2, 0.4, 0.8)), 0.3),
], ids=["relays", "sticking"])  # fmt: skip
def test_one_threshold_is_sought_between_those_that_are_fixed(
    physics: Concealed, law: Correction, threshold_v: float
) -> None:
    there = evidence(*FIG13_LEVELS_V, physics=(physics,))
    several = suspect(there, law)
    kept = finer(there, several, 1.0)
    assert kept.correction.knots == pytest.approx((threshold_v,), rel=0.05)
    assert kept.gain > several.gain


@pytest.mark.parametrize("level_v", [6.9, 11.5])
def test_a_level_at_which_something_switches_is_sought_wherever_a_recording_rests(
    level_v: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where a recording goes from rest to rest, what a level explains says nothing of the next: it was told at 2 V."""
    law = Relays(Place.SENSE, (1.5, 4.6, 9.2))

    def told(_: Evidence, one: Correction) -> Suspect:
        near, right = (abs(one.knots[0] / at - 1.0) < 0.1 for at in (2.0, level_v))
        return Suspect(one, np.ones(1), np.array([2e3 if right else 1e3 if near else 900.0 / one.knots[0]]), {})

    monkeypatch.setattr("identify.explain.sought.suspect", told)
    there = evidence(*FIG13_LEVELS_V)
    assert of_one_knot(there, told(there, law)).correction.knots == pytest.approx((level_v,), rel=0.1)


@pytest.mark.parametrize(("physics", "law", "tau"), [
    (Concealed("giving_contact", {"tau": 3e-4}), Giving(Place.F, (7e-4, 5e-3, 0.03)), 3e-4),
    (Concealed("warm_joint", {"k": 0.3, "tau": 0.15, "top": 12.0}),
     OffsetAfterLoad(Place.SENSE, (1e-3, 8e-3, 0.05)), 0.15),
], ids=["below", "above"])  # fmt: skip
def test_one_lag_is_sought_beyond_those_that_are_fixed(physics: Concealed, law: Correction, tau: float) -> None:
    """A contact that follows within two samples was taken for a pole: the fixed lags began at six of them."""
    there = evidence(*FIG13_LEVELS_V, physics=(physics,))
    several = suspect(there, law)
    kept = finer(there, several, 1.0)
    assert kept.correction.knots == pytest.approx((tau,), rel=0.3)
    assert kept.gain > several.gain


@pytest.mark.parametrize(("gain", "fitted"), [(8.5e3, True), (7e3, False)])
def test_a_place_that_promises_nearly_as_much_is_fitted_too(gain: float, fitted: bool) -> None:
    """First order is that rough: a slow amplifier of G1 promised a seventh less than the one of F it was taken for."""
    chosen = contenders([promising(Place.F, 1e4), promising(Place.G1, gain)], 1.0)
    assert (Place.G1 in {s.correction.place for s in chosen}) is fitted


def test_a_gap_over_the_rate_has_one_law_where_both_borders_have_the_same() -> None:
    """As far as the noise lets them be told: six weights for twelve. Later on rises alone each border has its own."""
    for law, form in (("rate_dependent_gap", GapOverRate.form), ("later_contact", BorderOverRate.form)):
        there = evidence(*FIG13_LEVELS_V, physics=(Concealed(law, {"k": 1e-4}),))
        both = BorderOverRate(Place.F, speeds(there, Place.G1))
        assert finer(there, suspect(there, both), 1.0).correction.form == form


def test_what_goes_on_after_contact_has_a_law_of_its_own_on_either_side_where_it_differs() -> None:
    rings = Concealed("ringing_contact", {"size": 0.2, "frequency": 150.0, "falling": 0.0})
    there = evidence(*FIG13_LEVELS_V, physics=(rings,))
    both = suspect(there, AfterContact(Place.F, fast_s(there)))
    kept = finer(there, both, 1.0)
    assert kept.correction.form == AfterEither.form
    assert len(kept.correction.knots) == RINGS
    assert kept.gain > 1.5 * max(both.gain, suspect(there, AfterContact(Place.F, kept.correction.knots)).gain)


def test_what_follows_the_recent_past_and_a_delay_that_ripples_are_tried_wherever_they_may_be() -> None:
    tried = list(corrections(evidence(*FIG13_LEVELS_V)))
    for kind in (*AFTER, Flutter, AfterContact):
        assert {c.place for c in tried if type(c) is kind} == set(kind.places)
    assert {c.form for c in tried} >= {
        f"{what} after {past}" for what in ("gain", "offset", "gap") for past in ("load", "use", "motion")
    }
    assert Place.SOURCE in {c.place for c in tried if c.form == "gain after motion"}


def test_one_largest_rate_is_sought_on_either_side_of_zero() -> None:
    there = evidence(*FIG13_LEVELS_V, physics=(Concealed("slow_g1", {"rate": 90.0}),))
    top = max(there.rates(Place.G1))
    several = suspect(there, Trailing(Place.G1, tuple(share * top for share in (-0.9, -0.6, -0.3, 0.3, 0.6, 0.9))))
    kept = finer(there, several, 1.0)
    falling, rising = kept.correction.knots
    assert falling == -rising
    assert rising == pytest.approx(90.0, rel=0.1)
    assert kept.gain > several.gain


def test_the_inner_knot_next_to_zero_is_moved_there_and_no_other() -> None:
    assert with_zero((-3.0, -1.0, 0.4, 2.0)) == (-3.0, -1.0, 0.0, 2.0)
    assert with_zero((-0.1, 1.0, 2.0)) == (-0.1, 0.0, 2.0)  # the ends hold the range
    assert with_zero((0.5, 1.0, 2.0)) == (0.5, 1.0, 2.0)


def test_weights_that_the_data_hardly_tell_are_paid_for_by_what_they_gain_by_chance() -> None:
    """A law of one weight that tells a hundred, with and without ten idle ones that gain one each, as noise has it."""
    law = LevelMap(Place.F, (-1.0, 0.0, 1.0), "map")
    one = Suspect(law, np.ones(1), np.array([100.0]), {})
    many = Suspect(law, np.concatenate([np.full(10, 1e-4), np.ones(1)]), np.append(np.ones(10), 100.0), {})
    assert many.gain == one.gain + 10.0
    for suspected in (one, many):
        worth, price = suspected.worth(1.0)
        assert worth == pytest.approx(0.5 * suspected.gain - price)
    assert many.worth(1.0)[0] == pytest.approx(one.worth(1.0)[0], abs=0.5)
    assert many.worth(1.0)[1] == pytest.approx(one.worth(1.0)[1] + 5.0, abs=0.5)
