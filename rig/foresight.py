"""What will a protocol tell before it is played, how sure would that be, and what should be changed in it first?"""

from dataclasses import dataclass
from math import sqrt
from typing import TYPE_CHECKING

import numpy as np

from identify.trace import Trace
from rig.device import Capabilities
from rig.errors import RefusedError
from rig.plan import Plan
from rig.rigfile import parse_rig
from rig.session import Checked

if TYPE_CHECKING:
    from identify.identification import Unidentifiable
    from identify.model import Model
    from identify.planning.advice import Advice
    from identify.planning.information import Information

SCHEMA = "rig.check/1"


@dataclass(frozen=True)
class Foresight:
    """What is expected of a run; ``information`` is None where nothing can be, and ``why_not`` says why.

    ``untold`` are the points of G1 and G2 that its sines leave to the orders of the rig file.
    """

    advice: "tuple[Advice, ...]"
    information: "Information | None"
    noise_v: float = 0.0
    noise_from: str = ""
    untold: "tuple[Unidentifiable, ...]" = ()
    why_not: str = ""


def foreseen(found: Checked) -> Foresight:
    """Return what a checked protocol would tell of the rig it names, as the rig file has it; nothing concealed is used.

    Raises RefusedError where the rig's blocks cannot be simulated.
    """
    if not found.plan.rig_text:
        return Foresight((), None, why_not="the protocol names no rig")
    model = parse_rig(found.plan.rig_text, found.plan.rig_path or "the rig").model
    if model.unknown:
        return Foresight((), None, why_not="the rig file gives orders and no values")
    noise_v, origin = expected_noise(model, found.capabilities)
    return foreseen_plan(found.plan, model, noise_v, origin)


def expected_noise(model: "Model", can: Capabilities) -> tuple[float, str]:
    """Return the noise of a reading in V and where it is known from: the rig file, or the least the ADC makes."""
    floor_v = can.input_lsb_v / sqrt(12.0)
    if model.noise_v is not None and model.noise_v > floor_v:
        return model.noise_v, "the rig file"
    return floor_v, "the steps of the ADC; the rig file tells of none larger"


def foreseen_plan(plan: Plan, model: "Model", noise_v: float, origin: str = "") -> Foresight:
    """Return what ``plan`` would tell of ``model`` with readings of a known noise."""
    from identify.bent.bend import straight_values
    from identify.coordinate import coordinates_of
    from identify.effects import chain_of
    from identify.harmonic.sines import tones_of, untold_by_sines
    from identify.observe import Observation
    from identify.planning.advice import advice, bench_of
    from identify.planning.information import information
    from identify.starts.start import stabilised

    silent = np.broadcast_to(0.0, plan.u.size)
    trace = Trace(plan.title, plan.rate_hz, plan.u, silent, steps=plan.steps)
    try:
        model, _ = stabilised(model)
        chain = chain_of(model)
        coordinates = coordinates_of(chain, chain.values, [trace.name], model.fixed)
        seen = Observation(trace, np.broadcast_to(np.True_, trace.size), noise_v)
        told = information(chain, coordinates, [seen])
    except ValueError as error:
        raise RefusedError(str(error), where=plan.rig_path) from error
    limit_v = min(-plan.limits.low_v, plan.limits.high_v)
    bench = bench_of(model, straight_values(chain), limit_v if limit_v > 0.0 else None)
    advised = advice(bench, [trace], told)
    untold = untold_by_sines(model, tones_of(trace, noise_v), bench.limit_v)
    return Foresight(advised, told, noise_v, origin, untold)


def to_dict(found: Checked, told: Foresight) -> dict[str, object]:
    """Return the answer of ``rig check --json``."""
    plan = found.plan
    expected = {e.quantity.name: e.to_dict() for e in told.information.expected()} if told.information else {}
    return {
        "schema": SCHEMA, "title": plan.title, "device": found.address, "samples": int(plan.u.size),
        "rate_hz": plan.rate_hz, "duration_s": plan.duration_s, "peak_V": plan.peak_v,
        "slew_V_per_s": plan.slew_v_per_s, "limits_V": [plan.limits.low_v, plan.limits.high_v],
        "memory_bytes": plan.memory_bytes, "disk_bytes": plan.disk_bytes, "notes": list(plan.notes),
        "noise_V": told.noise_v or None, "expected": expected,
        "steps": [step.to_dict() for step in told.information.steps()] if told.information else [],
        "advice": [item.to_dict() for item in told.advice],
        "not_identifiable": [item.to_dict() for item in told.untold],
    }  # fmt: skip
