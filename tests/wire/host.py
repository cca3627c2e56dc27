"""A host to be killed: plays a plan on the device given, records it, and says how that ended.

``python -m tests.wire.host ADDRESS RUN.h5 [short]``; prints 0 when its recording is there, then the samples received.
"""

import sys
from pathlib import Path

import numpy as np

from identify.trace import Step
from rig.errors import RigError
from rig.plan import Limits, Plan
from rig.recording import Equipment, Writer
from rig.registry import connect
from rig.runner import Outcome, run


def long_plan(size: int = 200_000, rate_hz: float = 10_000.0) -> Plan:
    """Return a plan at 5 V of ``size`` samples, its safe level 1 V, its ramp 0.3 s."""
    return Plan("a long hold", np.full(size, 5.0), rate_hz, (Step("hold", "hold", 0, size),),
                Limits(-10.0, 10.0, None), safe_level_v=1.0, ramp_s=0.3)


def short_plan(rate_hz: float = 10_000.0) -> Plan:
    """Return a plan of 1.6 s between 2 and 6 V, its safe level 1 V, its ramp that of a protocol which names none."""
    u = 4.2 + 2.0 * np.sin(np.arange(round(1.6 * rate_hz)) * 0.01)
    return Plan("waves", u, rate_hz, (Step("waves", "sine", 0, u.size),), Limits(-10.0, 10.0, None), safe_level_v=1.0)


def record(plan: Plan, address: str, path: Path) -> Outcome:
    """Play ``plan`` on the device at ``address`` and record it into ``path``."""
    with connect(address) as device:
        equipment = Equipment(address, str(device.identity()))
        with Writer(path, plan, equipment) as writer:
            print(0, flush=True)
            outcome = run(plan, device, writer, lambda done, total: print(done, flush=True))
            writer.finish(outcome.complete, outcome.reason, outcome.events)
    return outcome


if __name__ == "__main__":
    try:
        ended = record(short_plan() if "short" in sys.argv[3:] else long_plan(), sys.argv[1], Path(sys.argv[2]))
    except RigError as error:
        sys.exit(str(error))
    sys.exit(ended.failure.exit_code if ended.failure else 0)
