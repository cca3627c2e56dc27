"""Does the tool name what a changed part does to a circuit? A fixed share of ``python -m tests.proof.circuit``."""

from dataclasses import replace

import pytest

from drivers import ngspice
from drivers.netlist import parse_netlist
from drivers.spice import DEFAULT, shipped, stock
from tests.proof.circuit.changes import CHANGES, PAIRS, SINGLE, Change, Circuit
from tests.proof.circuit.table import report, report_of_pairs
from tests.proof.circuit.told import answer
from tests.proof.circuit.verdict import judged

PLAYED = ("leaky hold capacitor",)
LEAK, RAILS = CHANGES[0], CHANGES[3]


@pytest.mark.parametrize("circuit", [*SINGLE, *PAIRS], ids=lambda circuit: circuit.name)
def test_a_changed_circuit_is_a_circuit_of_known_parts(circuit: Circuit) -> None:
    netlist = parse_netlist(circuit.applied(shipped(DEFAULT)), circuit.name)
    assert {"u", "v", "w", "y"} <= netlist.nodes
    assert len({line.split()[0].lower() for line in netlist.lines if line[0] not in ".*"}) == sum(
        line[0] not in ".*" for line in netlist.lines
    )
    models = {line.split()[-1].upper() for line in netlist.lines if line[0] in "XD"}
    assert models <= stock().models
    assert circuit is SINGLE[0] or netlist.lines != parse_netlist(shipped(DEFAULT), "as it is").lines


def test_a_pair_brings_two_physics_and_leaves_the_parts_that_either_is_calculated_from() -> None:
    assert len({circuit.name for circuit in PAIRS}) == len(PAIRS)
    for one, other in (circuit.changes for circuit in PAIRS):
        assert one.named
        assert other.named
        assert one.effect != other.effect
        edited = {line for line, _ in (*one.edits, *other.edits)}
        assert len(edited) == len(one.edits) + len(other.edits)
        assert edited.isdisjoint({*one.given, *other.given})


def test_a_change_of_what_is_not_there_is_refused() -> None:
    with pytest.raises(ValueError, match="not in the netlist once"):
        replace(LEAK, edits=(("R1 u a 10k", "R1 u a 20k"),)).applied(shipped(DEFAULT))


@pytest.mark.skipif(bool(ngspice.missing()), reason=ngspice.missing())
@pytest.mark.parametrize("change", [c for c in CHANGES if c.name in PLAYED], ids=lambda change: change.name)
def test_what_a_part_does_is_named_measured_and_proven(change: Change) -> None:
    circuit = Circuit((change,))
    said = answer(circuit)
    verdict = judged(circuit, said)
    assert (verdict.outcome, verdict.why) == ("found", "")
    assert said["verdict"] == "explained"


def called(effect: str, probability: float = 0.9, **values: float) -> dict[str, object]:
    """Return an effect at F as an answer names it."""
    told = {name: {"value": value, "ci95": [value - 1e-3, value + 1e-3]} for name, value in values.items()}
    return {"id": effect, "stage": "F", "probability": probability, "could_also_be": [], "parameters": told}


def told(*effects: dict[str, object], after: float = 0.0101) -> dict[str, object]:
    """Return an answer that leaves ``after``, V, of a held-out residual of 60 mV; the noise is 10 mV."""
    held_out = {"before": 0.06, "after": after, "noise": 0.01}
    where = {"stage": "F", "alternatives": ["G2"]}
    return {"verdict": "explained", "effects": list(effects), "model": {}, "fit": {"held_out": held_out},
            "location": where}


DROOP = called("plateau_droop", rate=0.083)
CASES = [
    (told(DROOP), "found", ""),
    (told(called("plateau_droop", rate=0.09)), "found", ""),
    (told(called("plateau_droop", rate=0.1)), "missed", "rate not within 10%"),
    (told(DROOP, after=0.02), "missed", "2 x noise left"),
    (told(DROOP, after=0.04), "missed", "4 x noise left; not halved"),
    (told(called("hum", frequency=50.0)), "wrong", "called hum; rate not within 10%; hum at F first"),
    (told(called("hum", 0.4, frequency=50.0)), "missed", "rate not within 10%; hum at F first"),
    (told(DROOP, called("hum", frequency=50.0)), "wrong", "called hum"),
    (told(DROOP, called("unnamed")), "found", ""),
    (told(), "missed", "rate not within 10%; no name"),
]


@pytest.mark.parametrize(("said", "outcome", "why"), CASES)
def test_an_answer_is_judged_by_name_value_and_proof(said: dict[str, object], outcome: str, why: str) -> None:
    verdict = judged(Circuit((LEAK,)), said)
    assert (verdict.outcome, verdict.why) == (outcome, why)
    assert f"**{outcome}**" in report([(Circuit((LEAK,)), said)], "here")


@pytest.mark.parametrize(("current", "outcome"), [(-0.0027, "found"), (-0.0105, "wrong")])
def test_the_droop_of_every_circuit_is_no_wrong_name_where_it_is_that_one(current: float, outcome: str) -> None:
    said = {**told(called("plateau_droop", current=current)), "model": {"G1": {"den": [3e-7, 3e-2, 1.0]}}}
    (change,) = (c for c in CHANGES if c.name == "wrong capacitor in the first filter")
    assert judged(Circuit((change,)), said).outcome == outcome


CLIPPED = called("saturation", upper=7.9, lower=-7.1)
OF_TWO = [
    (told(DROOP, CLIPPED), "found", ""),
    (told(CLIPPED, DROOP), "found", ""),
    (told(DROOP), "missed", "upper not within 10%; lower not within 10%; plateau_droop at F first"),
    (told(DROOP, called("hum", 0.4), CLIPPED), "missed", "plateau_droop at F, hum at F first"),
    (told(DROOP, CLIPPED, called("hum")), "wrong", "called hum"),
    (told(DROOP, CLIPPED, after=0.02), "missed", "2 x noise left"),
]


@pytest.mark.parametrize(("said", "outcome", "why"), OF_TWO)
def test_of_two_changes_both_must_be_told_before_all_else(said: dict[str, object], outcome: str, why: str) -> None:
    both = Circuit((LEAK, RAILS))
    verdict = judged(both, said)
    assert (verdict.outcome, verdict.why) == (outcome, why)
    text = report_of_pairs([(both, said)], "here")
    assert (f"**{outcome}**" in text) == (outcome != "found")
    assert f"of 1 circuits with two changes, of {len(PAIRS)} that there are, {int(outcome == 'found')} were" in text


@pytest.mark.parametrize(
    ("where", "why"),
    [
        ({"stage": "F", "alternatives": []}, ""),
        ({"stage": "G1", "alternatives": ["F"]}, ""),
        ({"stage": "source", "alternatives": ["G1"]}, "located at source"),
        (None, ""),
    ],
)
def test_what_no_catalogue_has_must_be_located_where_it_is_or_nowhere(where: object, why: str) -> None:
    (change,) = (c for c in CHANGES if c.name == "no catch diodes")
    assert judged(Circuit((change,)), {**told(called("unnamed")), "location": where}).why == why
