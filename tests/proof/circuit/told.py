"""What does the tool say of a changed circuit, and is it what the change must cause?"""

from typing import Any

from rig.rigfile import model_to_dict
from rig.workflow import explain_runs, load
from tests.proof.circuit.changes import Circuit
from tests.proof.circuit.recorded import held_out, recorded, training

RIG = "rigs/opamp_backlash.yaml"


def answer(circuit: Circuit, seed: int = 0) -> dict[str, Any]:
    """Return the JSON of ``rig explain`` on the recordings of a changed circuit."""
    kept = [recorded(circuit, stimulus, seed) for stimulus in training()]
    held = [recorded(circuit, stimulus, seed) for stimulus in held_out()]
    told = explain_runs(load(kept, RIG, held))
    return {**told.to_dict(), "model": model_to_dict(told.model)}
