"""Does every effect of the catalogue keep the contract? An effect from a plug-in is tested by being installed."""

import inspect
import math
import sys
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest

from identify.candidates import evidence_starts
from identify.chain import Chain, as_promised, plain_chain, simulate
from identify.effects import catalogue, physics_in, with_physics, would_separate
from identify.effects.effect import Effect, short
from identify.evidence import Evidence
from identify.fit import Fit, fit
from identify.model import Rational
from identify.observe import Observation, refined
from identify.stage import Place
from identify.trace import Trace
from tests.proof.cases import CLEAN, LIBRARY, Case
from tests.proof.rigs import LINEAR, ONE_SLOPE, OP_AMP, Rig
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, noisy, observed, recorded

STAGES = {  # the table of section 2 of physics.md: what may be missing, and where it may sit
    "dac_quantisation": "source", "source_pole": "source", "source_nonlinearity": "source",
    "input_ac_coupling": "source", "input_clipping": "source", "resonance": "G1 G2", "extra_pole": "G1 G2",
    "process_noise": "G1", "hum": "G1 F sense", "backlash": "F", "saturation": "F", "soft_saturation": "F",
    "diode_clamp": "F", "curved_border": "F", "unequal_slopes": "F", "soft_knee": "F", "plateau_droop": "F",
    "dielectric_absorption": "F G1", "plateau_tilt": "F", "second_play": "F", "rate_dependent_gap": "F",
    "slew_limit": "F", "dead_time": "G2", "feedthrough": "sense", "offset_drift": "sense", "gain_drift": "sense",
    "ac_coupling": "sense", "coloured_noise": "sense", "adc_clipping": "sense", "adc_quantisation": "sense",
    "adc_nonlinearity": "sense", "rectifying_sensor": "sense", "spikes": "sense", "clock_skew": "sense",
    "missing_samples": "sense",
    "self_heating": "G1 F", "capacitor_nonlinearity": "G1 G2", "diode_contact": "F",
    "adc_averaging": "sense",  # and what that table has not
}  # fmt: skip
UNITS = {"V", "s", "1/s", "V/s", "V/V", "Hz", "rad", "rad/s", "1/V", "1/V^2", "1", "A", "ohm", "ppm"}
KINDS = sorted(catalogue().values(), key=lambda kind: kind.id)
OWN = {kind.id for kind in KINDS if kind.__module__.startswith("identify.effects.")}
VARIANTS = [effect for kind in KINDS for effect in kind.variants()]
SUBSTEPS = 2


def name_of(item: object) -> str:
    """Return how pytest calls an effect, a variant or a case."""
    if isinstance(item, Effect):
        return " ".join(filter(None, (item.id, item.place.label, item.form)))
    return getattr(item, "id", None) or str(getattr(item, "name", item))


every_kind = pytest.mark.parametrize("kind", KINDS, ids=name_of)
every_variant = pytest.mark.parametrize("effect", VARIANTS, ids=name_of)


def test_the_catalogue_is_not_empty() -> None:
    assert len(KINDS) >= 8


# --- the story an effect tells ------------------------------------------------------------------------------------


@every_kind
def test_an_effect_is_a_final_class_with_its_file_s_question_answered(kind: type[Effect]) -> None:
    module = sys.modules[kind.__module__]
    assert getattr(kind, "__final__", False)
    assert inspect.getdoc(kind) != inspect.getdoc(Effect)
    assert (module.__doc__ or "").strip()
    assert not inspect.isabstract(kind)


@every_kind
def test_the_id_and_the_stages_are_those_of_the_physics(kind: type[Effect]) -> None:
    assert kind.places
    assert len(set(kind.forms)) == len(kind.forms) > 0
    if kind.id in OWN:
        assert {place.label for place in kind.places} <= set(STAGES[kind.id].split())


@every_kind
def test_words_for_the_operator_are_complete(kind: type[Effect]) -> None:
    for text in (kind.title, kind.equation, kind.axis, kind.fingerprint):
        assert text.strip() == text != ""
    told = kind.sentence.format("4.2 mV")
    assert "4.2 mV" in told
    assert told[0].isupper()
    assert told.endswith(".")


@every_kind
def test_the_equation_speaks_of_every_parameter(kind: type[Effect]) -> None:
    """Phases and shapes of a waveform are summed up; whatever has a name of its own stands in the equation."""
    spoken = [short(p.name) for p in kind.declared if p.unit != "rad"]
    if len(spoken) <= 3:
        assert [name for name in spoken if name not in kind.equation] == []


@every_kind
def test_parameters_are_owned_and_have_units(kind: type[Effect]) -> None:
    names = [p.name for p in kind.declared]
    assert len(set(names)) == len(names) > 0
    for parameter in kind.declared:
        assert parameter.name.rpartition(".")[0] == kind.id
        assert parameter.unit in UNITS
        assert parameter.scale > 0.0


@every_kind
def test_every_parameter_has_a_value_that_means_absent_and_examples_differ_from_it(kind: type[Effect]) -> None:
    declared = {short(p.name) for p in kind.declared}
    assert set(kind.absent) == declared
    assert set(kind.example) <= declared
    assert kind.example
    assert all(math.isfinite(v) and v != kind.absent[name] for name, v in kind.example.items())


@every_kind
def test_confusions_name_physics_and_the_experiment_that_separates(kind: type[Effect]) -> None:
    assert kind.confused_with
    for confusion in kind.confused_with:
        assert confusion.id in {*STAGES, *catalogue()}
        assert confusion.id != kind.id
        assert len(confusion.would_separate.split()) >= 3
        assert not confusion.would_separate.endswith(".")
        here, there = ((c or kind.places[0]).label for c in (confusion.here, confusion.there))
        for one, two in (((kind.id, here), (confusion.id, there)), ((confusion.id, there), (kind.id, here))):
            assert would_separate(*one, *two)  # whoever is asked


@every_kind
def test_forms_share_out_the_declared_parameters(kind: type[Effect]) -> None:
    used = [set(effect.parameters()) for effect in kind.variants()]
    assert all(parameters and parameters <= set(kind.declared) for parameters in used)
    assert set().union(*used) == set(kind.declared)


# --- what an effect does to a signal --------------------------------------------------------------------------------

STAIRS = staircase("stairs", FIG13_LEVELS_V[::2], 0.03)
SINE = sine("sine", 31.25, 8.0, 2, 1)
TRACES = [Trace(s.name, s.rate_hz, s.u, s.u, start_s=2.0 + i) for i, s in enumerate((STAIRS, SINE))]


def answers(chain: Chain) -> np.ndarray:
    """Return a chain's answers to both stimuli."""
    return np.concatenate([simulate(chain, trace, SUBSTEPS) for trace in TRACES])


def promised_chain(rig: Rig) -> Chain:
    """Return the plain chain of a rig file."""
    return as_promised(plain_chain(model_of(rig)), model_of(rig))


def home_of(effect: Effect) -> Rig:
    """Return the op-amp rig with the rig file an effect may be missing from: mostly its own."""
    return next(rig for rig in (OP_AMP, LINEAR, ONE_SLOPE) if effect.applicable(promised_chain(rig)))


def plain_of(effect: Effect) -> Chain:
    """Return the plain chain an effect is put into."""
    return promised_chain(home_of(effect))


def at_example(effect: Effect) -> Chain:
    """Return the op-amp rig with the effect at its example; what the example leaves out is a third of a scale."""
    values = {short(p.name): effect.example.get(short(p.name), 0.3 * p.scale) for p in effect.parameters()}
    return effect.put_in(plain_of(effect), values)


@every_variant
def test_at_its_absent_value_an_effect_is_the_identity(effect: Effect) -> None:
    plain = plain_of(effect)
    assert np.allclose(answers(effect.put_in(plain, {})), answers(plain), rtol=0, atol=1e-9)


@every_variant
def test_an_effect_is_the_identity_where_the_signal_jumps_too(effect: Effect) -> None:
    """Behind blocks without dynamics a held level is still a held level."""
    bare = plain_chain(replace(model_of(home_of(effect)), g1=Rational((1.0,), (1.0,)), g2=Rational((1.0,), (1.0,))))
    assert np.allclose(answers(effect.put_in(bare, {})), answers(bare), rtol=0, atol=1e-9)
    example = {name: value for name, value in effect.example.items() if name in map(short, names_of(effect))}
    assert np.all(np.isfinite(answers(effect.put_in(bare, example))))


def names_of(effect: Effect) -> list[str]:
    """Return the full names of a variant's parameters."""
    return [p.name for p in effect.parameters()]


@every_variant
def test_at_its_example_an_effect_changes_the_answer_beyond_the_noise(effect: Effect) -> None:
    change = answers(at_example(effect)) - answers(plain_of(effect))
    assert np.all(np.isfinite(change))
    assert np.linalg.norm(change) > 5.0 * OP_AMP.noise_v


@every_variant
def test_the_answer_has_a_finite_derivative_by_every_parameter(effect: Effect) -> None:
    chain = at_example(effect)
    for parameter in effect.parameters():
        value = chain.values[parameter.name]
        unit = abs(value) if parameter.coordinate == "log" else parameter.scale

        def slope(step: float, name: str = parameter.name, at: float = value, unit: float = unit) -> np.ndarray:
            above, below = (answers(chain.with_values({name: at + sign * step * unit})) for sign in (0.5, -0.5))
            return (above - below) / step

        coarse, fine = slope(2e-4), slope(1e-4)
        assert np.all(np.isfinite(fine))
        assert np.linalg.norm(fine) > OP_AMP.noise_v  # a parameter that moves nothing could not be found
        assert np.linalg.norm(coarse - fine) < 0.05 * np.linalg.norm(fine)


@every_variant
def test_a_model_with_the_effect_goes_to_a_chain_and_back(effect: Effect) -> None:
    chain = at_example(effect)
    (piece,) = physics_in(chain)
    assert (piece.id, piece.stage, piece.form) == (effect.id, effect.place.label, effect.form)
    again = with_physics(plain_of(effect), (piece,))
    assert physics_in(again) == (piece,)
    assert np.array_equal(answers(again), answers(chain))


BEFORE_AND_BEHIND = {"G1": (Place.SOURCE, Place.G1), "G2": (Place.F, Place.SENSE)}
STAGED = [e for e in VARIANTS if len(at_example(e).stages) > len(plain_of(e).stages)]  # a dead time lives inside G2
MOVABLE = [e for e in STAGED if e.id != "hum" or e.place is Place.G1]  # at F it is another law


@pytest.mark.parametrize("effect", MOVABLE, ids=name_of)
def test_what_is_said_to_give_the_same_data_elsewhere_changes_places_with_the_block_between(effect: Effect) -> None:
    """A law that bends, or drifts, does not."""
    plain, values = plain_of(effect), {name: at_example(effect).values[name] for name in names_of(effect)}
    places = BEFORE_AND_BEHIND["G1" if effect.place < Place.F else "G2"]
    one, other = (simulated(plain.with_stage(replace(effect, place=place), values)) for place in places)
    apart = float(np.linalg.norm(one - other) / np.linalg.norm(other - simulated(plain)))
    assert (apart < 5e-4) is (len(effect.same_at) > 1)


def simulated(chain: Chain) -> np.ndarray:
    """Return what ``answers`` does, on a grid so fine that what is not held any more may stand in front of G1."""
    return np.concatenate([simulate(chain, trace, 4 * SUBSTEPS) for trace in TRACES])


@every_variant
def test_an_effect_stands_in_a_chain_once(effect: Effect) -> None:
    assert not effect.applicable(at_example(effect))


@every_variant
def test_an_effect_says_itself_what_it_cannot_do_alone(effect: Effect) -> None:
    """It runs as a stage, or it refuses because it lives inside another; it never passes a signal unchanged."""
    chain = at_example(effect)
    assert chain.added == (effect,)
    assert chain.stages != plain_of(effect).stages


# --- how an effect is found -----------------------------------------------------------------------------------------

PLAYED = (
    staircase("stairs", FIG13_LEVELS_V, 0.07), sine("sine_10hz", 10.0, 3.4, 4, 1), sine("sine_31hz", 31.25, 8.0, 4, 1),
)  # fmt: skip
PAUSE_S = 8.0


@dataclass(frozen=True)
class Trial:
    """A case of the trial bench with fewer stimuli, and the fit of the plain model to it."""

    observations: tuple[Observation, ...]
    plain: Fit

    @property
    def count(self) -> int:
        return sum(o.count for o in self.observations)


def trial_of(case: Case) -> Trial:
    """Record ``case`` on the independent integrator and fit the plain model from the nominal rig."""
    noise_v = case.rig.noise_v
    traces = [recorded(case.rig, s, case.physics, noise_v, case.seed, i * PAUSE_S) for i, s in enumerate(PLAYED)]
    seen = tuple(observed(trace, noise_v, SUBSTEPS) for trace in traces)
    return Trial(seen, fit(promised_chain(case.nominal), seen))


def price(effect: Effect, trial: Trial) -> float:
    """Return the fall of chi-squared that pays for an effect's parameters by Schwarz's criterion."""
    runs = len(trial.observations)
    return sum(runs if p.local else 1 for p in effect.parameters()) * math.log(trial.count)


def variants_of(case: Case) -> list[Effect]:
    """Return the variants of the expected effect at its stage that can say the true values with fewest parameters.

    Physics whose law is not the library's own may be said by any variant.
    """
    (finding,) = case.expected
    here = [effect for effect in catalogue()[finding.id].variants() if effect.place.label == finding.stage]
    able = [e for e in here if set(finding.parameters) <= {short(p.name) for p in e.parameters()}]
    fewest = min(len(effect.parameters()) for effect in able)
    return [e for e in able if len(e.parameters()) == fewest or not finding.parameters]


def test_every_effect_is_on_trial() -> None:
    assert {finding.id for case in LIBRARY for finding in case.expected} == OWN


def played_with(effect: Effect) -> Trial:
    """Return what an effect of another package makes of the stimuli, by itself: nobody else has its equation."""
    rig = home_of(effect)
    seen = []
    for i, s in enumerate(PLAYED):
        silent = Trace(s.name, s.rate_hz, s.u, np.zeros(s.u.size), start_s=i * PAUSE_S)
        y = simulate(at_example(effect), silent, 8)
        seen.append(observed(noisy(replace(silent, y=y), rig.noise_v, i), rig.noise_v, SUBSTEPS))
    return Trial(tuple(seen), fit(plain_of(effect), tuple(seen)))


def planted(case: Case | Effect) -> tuple[Trial, list[Effect], dict[str, float]]:
    """Return a trial, the variants that may say what is concealed in it, and the true values."""
    if isinstance(case, Effect):
        own = {short(name) for name in names_of(case)}
        return played_with(case), [case], {name: v for name, v in case.example.items() if name in own}
    return trial_of(case), variants_of(case), dict(case.expected[0].parameters)


@pytest.mark.parametrize("case", [*LIBRARY, *(e for e in VARIANTS if e.id not in OWN)], ids=name_of)
def test_a_planted_effect_is_found_from_the_evidence(case: Case | Effect) -> None:
    trial, variants, truth = planted(case)
    evidence = Evidence(trial.plain, trial.observations)
    started = [
        (evidence.gain(effect, start), effect, start)
        for effect in variants for start in evidence_starts(evidence, effect)
    ]
    gain, effect, start = max(started, key=lambda item: item[0])
    assert gain > price(effect, trial)
    found = fit(effect.put_in(trial.plain.chain, start), trial.observations, trial.plain.chain.values, iterations=60)
    assert trial.plain.cost - found.cost > 2.0 * price(effect, trial)
    finer = tuple(refined(o, found.chain) for o in trial.observations)
    if finer != trial.observations:  # corners between two instants: the explainer takes a finer grid for them, too
        found = fit(found.chain, finer, trial.plain.chain.values, iterations=60)
    for name, true in truth.items():
        low, high = found.ci95(f"{effect.id}.{name}", inflation=2.0)
        value = found.chain.values[f"{effect.id}.{name}"]
        sign = -1.0 if effect.id == "hum" and name != "frequency" and value < 0.0 else 1.0
        assert min(sign * low, sign * high) <= true <= max(sign * low, sign * high), (name, value, true)


@cache
def clean(case: Case) -> tuple[Trial, Evidence]:
    """Return the trial of a case that conceals nothing."""
    trial = trial_of(case)
    return trial, Evidence(trial.plain, trial.observations)


def clean_cases(effect: Effect) -> tuple[Case, ...]:
    """Return the clean rigs of the kind of rig file an effect is missing from."""
    home = home_of(effect)
    return CLEAN if home is OP_AMP else (Case(f"clean, {home.name}", home, (), (), 103),)


@pytest.mark.parametrize(("effect", "case"), [(e, c) for e in VARIANTS for c in clean_cases(e)], ids=name_of)
def test_an_effect_stays_silent_on_clean_data(effect: Effect, case: Case) -> None:
    trial, evidence = clean(case)
    gains = [evidence.gain(effect, start) for start in evidence_starts(evidence, effect)]
    assert max(gains, default=0.0) < price(effect, trial)
