"""Runs protocols on a rig: protocol, plan, device contract, runner, recording, commands.

What a notebook needs is here, and loaded when it is asked for::

    import rig

    monday = rig.run("hold.yaml", "monday.h5")     # device="serial:/dev/ttyACM0"; else the loopback
    monday.plot()
    told = rig.explain(monday)                     # shows itself; told.plot(), told.effects, told.model
    rig.identify("monday.h5").borders
"""

from typing import TYPE_CHECKING

from identify.offered import offered

if TYPE_CHECKING:
    from rig.notebook import check, compare, explain, identify, run, simulate
    from rig.recorded import Recording
    from rig.recording import read

HOMES = {
    "Recording": "rig.recorded:Recording", "check": "rig.notebook:check", "compare": "rig.notebook:compare",
    "explain": "rig.notebook:explain", "identify": "rig.notebook:identify", "read": "rig.recording:read",
    "run": "rig.notebook:run", "simulate": "rig.notebook:simulate",
}  # fmt: skip
"""Where each public name lives."""

__all__ = ["Recording", "check", "compare", "explain", "identify", "read", "run", "simulate"]

__getattr__, __dir__ = offered(__name__, HOMES)
