"""Is noise of the reading told from what wanders in the gap or changes at contacts, by what F does?"""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from identify.effects import chain_of
from identify.explain import explain, hidden
from identify.explain.knowing import knows_border, knows_contact, knows_f, knows_gap, ruled_out
from identify.stage import Place
from tests.proof.ask import known_effects
from tests.proof.cases import Concealed
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, observed, recorded
from tests.unit.identify.test_wander import steps_of

NOISE_V = 0.004
WALK, WAVE = staircase("walk", FIG13_LEVELS_V, 0.05, 4), sine("wave", 4.0, 3.0, 4, 1)
READING = Concealed("coloured_noise", {"sd": 0.01, "slope": 1.8})
IN_GAP = Concealed("wandering_hold", {"sd": 0.05})
AT_TURNS = Concealed("scattered_gap", {"sd": 0.0005})
AT_ONE_BORDER = Concealed("popcorn_gap", {"size": 0.01, "rate": 4.0})
IN_FRONT = Concealed("process_noise", {"sd": 0.02, "bandwidth": 20.0})


def runs(physics):
    """Return two recordings of a rig, their repeats marked."""
    made = [(recorded(OP_AMP, run, physics, NOISE_V, i, 5.0 * i, 8), run) for i, run in enumerate((WALK, WAVE))]
    return [replace(trace, steps=steps_of(run.segments)) for trace, run in made]


@pytest.mark.parametrize(
    ("physics", "knows"),
    [
        ((), False), ((READING,), False), ((IN_FRONT,), False), ((IN_GAP,), True), ((IN_GAP, READING), False),
        ((IN_GAP, IN_FRONT), False),
    ],
)  # fmt: skip
def test_noise_of_the_reading_does_not_know_where_f_stands(physics, knows):
    chain, seen = chain_of(model_of(OP_AMP)), [observed(run, NOISE_V) for run in runs(physics)]
    assert knows_gap(chain, seen) is knows
    assert ruled_out(chain, seen) == ((Place.G2, Place.SENSE) if knows else ())
    assert not knows_gap(chain, seen[1:])  # of a sine alone too little is held


@pytest.mark.parametrize(
    ("physics", "knows"),
    [
        ((), False), ((READING,), False), ((IN_FRONT,), False), ((IN_GAP,), False), ((AT_TURNS,), True),
        ((AT_TURNS, READING), False),
    ],
)  # fmt: skip
def test_noise_of_the_reading_does_not_know_when_contact_is_made(physics, knows):
    """A border that is met elsewhere at every turn leaves w off by as much until it is met again."""
    chain, seen = chain_of(model_of(OP_AMP)), [observed(run, NOISE_V) for run in runs(physics)]
    assert knows_contact(chain, seen) is knows
    assert knows_f(chain, seen) is (knows or physics == (IN_GAP,))
    if knows:
        assert not knows_gap(chain, seen)
        assert ruled_out(chain, seen) == (Place.G2, Place.SENSE)
        assert not knows_contact(chain, [replace(seen[0], trace=replace(seen[0].trace, steps=()))])


@pytest.mark.parametrize(
    ("physics", "knows"),
    [((READING,), False), ((AT_TURNS,), False), ((AT_ONE_BORDER,), True), ((AT_ONE_BORDER, READING), False)],
)
def test_noise_of_the_reading_does_not_know_which_border_pushes(physics, knows):
    """A crossing that jumps to and fro moves w while its border pushes, and leaves it off until the other does."""
    chain, seen = chain_of(model_of(OP_AMP)), [observed(run, NOISE_V) for run in runs(physics)]
    assert knows_border(chain, seen) is knows
    if knows:
        assert knows_f(chain, seen)
        assert ruled_out(chain, seen) == (Place.G2, Place.SENSE)
        assert not knows_border(chain, [replace(o, trace=replace(o.trace, steps=())) for o in seen])


@pytest.mark.parametrize(("physics", "told"), [(READING, 80.0), (AT_TURNS, 0.0)])
def test_what_knows_when_contact_is_made_is_not_suspected_to_be_noise_of_the_reading(physics, told, monkeypatch):
    """However much its spectrum looks like that: it was named so with 0.95, and all was explained."""
    chain, traces = chain_of(model_of(OP_AMP)), runs((physics,))
    plain = SimpleNamespace(fit=SimpleNamespace(chain=chain))
    bench = SimpleNamespace(observations=[observed(run, NOISE_V) for run in traces])
    data = SimpleNamespace(noise=SimpleNamespace(rms_v=NOISE_V), test=())
    there = SimpleNamespace(
        traces=traces, hold_out=(), found=(), plain=plain, bench=bench, data=data, settle_s=0.02
    )
    monkeypatch.setattr(hidden, "noise_left", lambda train, proof: SimpleNamespace(told=80.0))
    monkeypatch.setattr(hidden, "against_repeats", lambda noise, seen: False)
    assert hidden.suspected(there, ()) == told


def test_what_wanders_in_the_gap_alone_is_not_named_noise_of_the_reading_but_is_at_f():
    others = sorted(known_effects() - {"coloured_noise", "offset_drift"})
    told = explain(model_of(OP_AMP), runs((IN_GAP,)), leave_out=others)
    assert (told.verdict, told.effects, told.location.stage) == ("unexplained", (), "F")
    (noise,) = explain(model_of(OP_AMP), runs((READING,)), leave_out=others).effects
    assert noise.id == "coloured_noise"


def test_recordings_of_few_readings_a_second_tell_of_noise_as_well():
    """A window of 20 ms would hold none of them, or one that tells nothing of its own noise."""
    chain, seen = chain_of(model_of(OP_AMP)), [observed(run, NOISE_V) for run in runs(())]
    slow = [replace(o, trace=replace(o.trace, rate_hz=10.0)) for o in seen]
    assert not knows_f(chain, slow)
