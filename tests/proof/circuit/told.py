"""What does the tool say of a changed circuit, and is it what the change must cause?"""

from typing import Any

from rig.rigfile import model_to_dict
from rig.workflow import explain_runs, load
from tests.proof.circuit.changes import Change
from tests.proof.circuit.recorded import held_out, recorded, training

RIG = "rigs/opamp_backlash.yaml"
CLOSE = 0.1  # of the value by hand: asked of a value whose interval does not cover it
AT_NOISE = 1.5  # times the noise: asked of the residual held out


def answer(change: Change, seed: int = 0) -> dict[str, Any]:
    """Return the JSON of ``rig explain`` on the recordings of a changed circuit."""
    kept = [recorded(change, stimulus, seed) for stimulus in training()]
    held = [recorded(change, stimulus, seed) for stimulus in held_out()]
    told = explain_runs(load(kept, RIG, held))
    return {**told.to_dict(), "model": model_to_dict(told.model)}
