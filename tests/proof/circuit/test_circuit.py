"""Does the tool name what a changed part does to a circuit? A fixed share of ``python -m tests.proof.circuit``."""

from dataclasses import replace

import pytest

from drivers import ngspice
from drivers.netlist import parse_netlist
from drivers.spice import DEFAULT, shipped, stock
from tests.proof.circuit.changes import ALL, CHANGES, Change
from tests.proof.circuit.table import report
from tests.proof.circuit.told import answer
from tests.proof.circuit.verdict import judged

PLAYED = ("leaky hold capacitor", "weak supply of the gain stage")
LEAK = CHANGES[0]


@pytest.mark.parametrize("change", ALL, ids=lambda change: change.name)
def test_a_changed_circuit_is_a_circuit_of_known_parts(change: Change) -> None:
    circuit = parse_netlist(change.applied(shipped(DEFAULT)), change.name)
    assert {"u", "v", "w", "y"} <= circuit.nodes
    models = {line.split()[-1].upper() for line in circuit.lines if line[0] in "XD"}
    assert models <= stock().models
    assert change is ALL[0] or circuit.lines != parse_netlist(shipped(DEFAULT), "as it is").lines


def test_a_change_of_what_is_not_there_is_refused() -> None:
    with pytest.raises(ValueError, match="not in the netlist once"):
        replace(LEAK, edits=(("R1 u a 10k", "R1 u a 20k"),)).applied(shipped(DEFAULT))


@pytest.mark.skipif(bool(ngspice.missing()), reason=ngspice.missing())
@pytest.mark.parametrize("change", [c for c in CHANGES if c.name in PLAYED], ids=lambda change: change.name)
def test_what_a_part_does_is_named_measured_and_proven(change: Change) -> None:
    said = answer(change)
    verdict = judged(change, said)
    assert (verdict.outcome, verdict.why) == ("found", "")
    assert said["verdict"] == "explained"


def called(effect: str, probability: float = 0.9, **values: float) -> dict[str, object]:
    """Return an effect at F as an answer names it."""
    told = {name: {"value": value, "ci95": [value - 1e-3, value + 1e-3]} for name, value in values.items()}
    return {"id": effect, "stage": "F", "probability": probability, "could_also_be": [], "parameters": told}


def told(*effects: dict[str, object], after: float = 0.0101) -> dict[str, object]:
    """Return an answer that leaves ``after``, V, of a held-out residual of 60 mV; the noise is 10 mV."""
    held_out = {"before": 0.06, "after": after, "noise": 0.01}
    return {"verdict": "explained", "effects": list(effects), "model": {}, "fit": {"held_out": held_out}}


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
    verdict = judged(LEAK, said)
    assert (verdict.outcome, verdict.why) == (outcome, why)
    assert f"**{outcome}**" in report([(LEAK, said)], "here")


@pytest.mark.parametrize(("current", "outcome"), [(-0.0027, "found"), (-0.0105, "wrong")])
def test_the_droop_of_every_circuit_is_no_wrong_name_where_it_is_that_one(current: float, outcome: str) -> None:
    said = {**told(called("plateau_droop", current=current)), "model": {"G1": {"den": [3e-7, 3e-2, 1.0]}}}
    (change,) = (c for c in CHANGES if c.name == "wrong capacitor in the first filter")
    assert judged(change, said).outcome == outcome
