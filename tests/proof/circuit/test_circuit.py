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


def told(effect: str, value: float, after: float = 0.0101, probability: float = 0.9) -> dict[str, object]:
    """Return an answer about the leaky capacitor that names ``effect`` with a rate."""
    named = {"id": effect, "stage": "F", "probability": probability, "could_also_be": [],
             "parameters": {"rate": {"value": value, "ci95": [value - 1e-3, value + 1e-3]}}}
    return {"verdict": "explained", "effects": [named], "model": {},
            "fit": {"held_out": {"before": 0.06, "after": after, "noise": 0.01}}}


@pytest.mark.parametrize(("said", "outcome", "why"), [
    (told("plateau_droop", 0.0830), "found", ""),
    (told("plateau_droop", 0.0900), "found", ""),
    (told("plateau_droop", 0.1000), "missed", "rate not within 10%"),
    (told("plateau_droop", 0.0830, after=0.02), "missed", "2 x noise left"),
    (told("plateau_droop", 0.0830, after=0.04), "missed", "4 x noise left; not halved"),
    (told("ac_coupling", 0.0830), "wrong", "called ac_coupling; rate not within 10%; ac_coupling at F first"),
    (told("ac_coupling", 0.0830, probability=0.4), "missed", "rate not within 10%; ac_coupling at F first"),
    ({**told("x", 0.0), "effects": []}, "missed", "rate not within 10%; no name"),
])
def test_an_answer_is_judged_by_name_value_and_proof(said: dict[str, object], outcome: str, why: str) -> None:
    verdict = judged(LEAK, said)
    assert (verdict.outcome, verdict.why) == (outcome, why)
    assert f"**{outcome}**" in report([(LEAK, said)], "here")
