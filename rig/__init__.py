"""Runs protocols on a rig: protocol, plan, device contract, runner, recording, commands.

What a notebook needs is here, and loaded when it is asked for::

    import rig

    monday = rig.run("hold.yaml", "monday.h5")     # device="serial:/dev/ttyACM0"; else the loopback
    monday.plot()
    told = rig.explain(monday)                     # shows itself; told.plot(), told.effects, told.model
    rig.identify("monday.h5").borders
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rig.notebook import check, compare, explain, identify, run, simulate
    from rig.recorded import Recording
    from rig.recording import read

HOMES = {
    "Recording": "rig.recorded", "check": "rig.notebook", "compare": "rig.notebook", "explain": "rig.notebook",
    "identify": "rig.notebook", "read": "rig.recording", "run": "rig.notebook", "simulate": "rig.notebook",
}  # fmt: skip
"""Where each public name lives."""

__all__ = ["Recording", "check", "compare", "explain", "identify", "read", "run", "simulate"]


def __getattr__(name: str) -> object:
    """Return a public name, its module imported now; AttributeError for another."""
    if name not in HOMES:
        raise AttributeError(f"rig has no {name!r}; it has {', '.join(__all__)}")
    return getattr(import_module(HOMES[name]), name)


def __dir__() -> list[str]:
    """Return the public names: what a notebook offers behind the dot."""
    return __all__
