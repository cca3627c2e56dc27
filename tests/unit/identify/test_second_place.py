"""May the same law be at two places of one rig?"""

from dataclasses import replace

import numpy as np
import pytest

from identify.effects import catalogue, chain_of
from identify.explain.bench import Bench
from identify.explain.exchange import parted
from identify.explain.hypothesis import Hypothesis
from identify.explain.locate import Located
from identify.explain.rivals import odds
from identify.explain.round import Round
from identify.explain.select import selected
from identify.model import Physics
from identify.stage import Place
from identify.uncertainty.coefficients import coefficients, with_coefficients
from tests.proof.cases import Concealed
from tests.proof.detect import Sensed
from tests.proof.rigs import OP_AMP, RC
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.proof.trial import Key, drawn
from tests.trials import model_of, observed, recorded

POLE, HUM = catalogue()["extra_pole"], catalogue()["hum"]
FIRST, SECOND = POLE(Place.G1), POLE(Place.G2, placed=True)
NOISE_V = 1e-3


def test_a_law_at_a_second_place_has_values_of_its_own() -> None:
    chain = FIRST.put_in(chain_of(model_of(RC)), {"tau": 1e-3})
    other = POLE(Place.G2).told_apart(chain)
    assert other == SECOND
    both = other.put_in(chain, {"tau": 2e-3})
    assert (both.values["extra_pole.tau"], both.values["extra_pole@G2.tau"]) == (1e-3, 2e-3)
    assert POLE(Place.G2).told_apart(chain_of(model_of(RC))) == POLE(Place.G2)


def test_a_chain_has_a_law_once_at_a_place_and_each_under_a_name_of_its_own() -> None:
    chain = FIRST.put_in(chain_of(model_of(RC)), {"tau": 1e-3})
    assert not POLE(Place.G1).applicable(chain)
    assert not POLE(Place.G2).applicable(chain)  # its values would be those of the first
    assert SECOND.applicable(chain)
    assert not POLE(Place.G1, placed=True).applicable(chain)
    with pytest.raises(ValueError, match="extra_pole at G1 twice"):
        chain_of(model_of(RC, [Physics("extra_pole", {"tau": 1e-3}), Physics("extra_pole", {"tau": 2e-3}, "G1")]))


@pytest.mark.parametrize("kind", [kind for kind in catalogue().values() if len(kind.places) > 1])
def test_no_form_at_a_second_place_forgets_where_it_is(kind) -> None:
    """Its values are its own in every form, and those it begins with have a chain to go to."""
    chain = chain_of(model_of(OP_AMP))
    for effect in kind.variants():
        placed = type(effect)(effect.place, effect.form, placed=True)
        assert all(p.name.startswith(f"{kind.id}@{effect.place.label}.") for p in placed.parameters())
        assert [p.name.partition(".")[2] for p in placed.parameters()] == [
            p.name.partition(".")[2] for p in effect.parameters()
        ]
        assert {e.placed for e in (*placed.fuller(), *placed.simpler())} <= {True}
        there = placed.put_in(chain, {})
        assert placed.upright(there).values == there.values
        assert placed.plausible(there, ())
        assert placed.completed(there, None) is there


def test_what_a_line_upside_down_says_is_said_upright_at_a_second_place_too() -> None:
    hum = HUM(Place.G1, placed=True)
    chain = hum.put_in(chain_of(model_of(RC)), {"amplitude": -0.1, "phase": 1.0})
    upright = hum.upright(chain)
    assert upright.values["hum@G1.amplitude"] == pytest.approx(0.1)
    assert upright.values["hum@G1.phase"] == pytest.approx(1.0 + np.pi)


def test_numbers_of_a_model_tell_two_places_apart() -> None:
    model = model_of(RC, [Physics("extra_pole", {"tau": 1e-3}), Physics("extra_pole", {"tau": 2e-3}, "G2")])
    assert {name: value for name, value in coefficients(model).items() if "pole" in name} == {
        "extra_pole.tau": 1e-3, "extra_pole@G2.tau": 2e-3,
    }  # fmt: skip
    moved = with_coefficients(model, {"extra_pole@G2.tau": 3e-3})
    assert [piece.values["tau"] for piece in moved.physics] == [1e-3, 3e-3]


def bench_of(*physics: Concealed) -> Bench:
    """Return a bench with a walk and a fast sine of a rig with physics concealed in it."""
    played = (staircase("walk", FIG13_LEVELS_V, 0.02), sine("fast", 31.25, 8.0, 8, 1))
    seen = tuple(observed(recorded(RC, stimulus, physics, NOISE_V, seed=3), NOISE_V, 4) for stimulus in played)
    kinds = ("extra_pole", "dead_time", "saturation", "rate_dependent_gap", "resonance", "source_pole")
    return Bench(chain_of(model_of(RC)), seen, (), tuple(catalogue()[name] for name in kinds))


def chosen(bench: Bench) -> tuple[Hypothesis, list[Round]]:
    """Return the effects that are selected, and the rounds of that."""
    _, final, rounds = selected(bench, bench.fitted(bench.plain, ()), lambda sentence, share: None)
    return final, rounds


def test_two_lags_are_told_one_in_front_of_the_gap_and_one_behind_it() -> None:
    """Short ones of one length are nearly a resonance that does not ring, which is found first."""
    taus = 3e-4, 3e-4
    lags = [Concealed(f"extra_pole in {place}", {"tau": tau}) for place, tau in zip(("G1", "G2"), taus, strict=True)]
    final, _ = chosen(bench_of(*lags))
    found = {effect.place: final.fit.chain.values[f"{effect.name}.tau"] for effect in final.effects}
    assert {effect.id for effect in final.effects} <= {"extra_pole", "source_pole"}
    assert found.pop(Place.G2) == pytest.approx(taus[1], rel=0.05)
    assert [*found.values()] == [pytest.approx(taus[0], rel=0.05)]


def test_one_lag_that_was_tried_from_two_starts_is_no_pair_of_them() -> None:
    bench = bench_of(*(Concealed(f"extra_pole in {place}", {"tau": 3e-4}) for place in ("G1", "G2")))
    this = bench.round(bench.fitted(bench.plain, ()))
    ring, lag = (next(h for h in this.tried if h.effects[-1].id == name) for name in ("resonance", "extra_pole"))
    assert parted(bench, ring, replace(this, tried=(ring, lag, lag))) is ring


def test_what_rings_stays_a_resonance() -> None:
    final, _ = chosen(bench_of(Concealed("resonance in G1", {"w_n": 3e3, "zeta": 0.4})))
    assert [(effect.id, effect.place) for effect in final.effects] == [("resonance", Place.G1)]


def test_two_chosen_in_one_round_have_the_rivals_of_that_round() -> None:
    bench = bench_of(*(Concealed(f"extra_pole in {place}", {"tau": 3e-4}) for place in ("G1", "G2")))
    final, rounds = chosen(bench)
    assert len(rounds[0].best.effects) == 2
    beyond = Located(final, (), 1.0)
    told = {effect.place: odds(bench, final, effect, rounds, beyond) for effect in final.effects}
    before, behind = ({other.id for other in told[place][1]} for place in (min(told), Place.G2))
    assert before & {"source_pole", "extra_pole"}
    assert behind <= {"dead_time", "rate_dependent_gap", "resonance"}


def test_a_lag_hides_beside_another_whose_own_value_can_copy_it() -> None:
    """Alone each is as clear as can be; together all that tells is by how much a lag before the gap is another."""
    sensed = Sensed(drawn(Key(94, "pair", "pair", 11)))
    one, other = Concealed("extra_pole in G1", {"tau": 5e-6}), Concealed("extra_pole in G2", {"tau": 45e-6})
    assert sensed.z_with((), one) > 30.0
    assert sensed.z_with((other,), one) < 0.3 * sensed.z_with((), one)
    bypass = Concealed("feedthrough", {"k": 0.01})
    assert sensed.z_with((bypass,), one) == pytest.approx(sensed.z_with((), one), rel=0.1)
