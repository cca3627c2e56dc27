"""Identifies and explains recorded traces: pure numerics, no ports, files or clocks.

What a notebook needs is here, and loaded when it is asked for::

    import identify

    model = identify.Model("my rig", identify.Rational((1,), (0.02, 1)), identify.Backlash(8, 1.2, 8, -1.2),
                           identify.Rational((1,), (0.002, 1)))
    trace = identify.Trace("monday", rate_hz, u, y)       # arrays in V
    identify.identified(model, [trace])                    # borders, G1, G2 with their intervals
    identify.explained(model, [trace])                     # what the model lacks
    identify.simulated(model, trace)                       # its answer to the same u, V

Recordings in files are the business of ``rig``, which has the same in a line: ``rig.explain("monday.h5")``.
"""

from typing import TYPE_CHECKING

from identify.offered import offered

if TYPE_CHECKING:
    from identify.effects import catalogue as catalogue
    from identify.explain.explain import explain as explained
    from identify.joint import identify as identified
    from identify.model import Backlash, CurvedBacklash, LinearF, Model, Physics, Rational
    from identify.notebook.simulated import simulated
    from identify.trace import Step, Trace

HOMES = {
    "Backlash": "identify.model:Backlash", "CurvedBacklash": "identify.model:CurvedBacklash",
    "LinearF": "identify.model:LinearF", "Model": "identify.model:Model", "Physics": "identify.model:Physics",
    "Rational": "identify.model:Rational", "Step": "identify.trace:Step", "Trace": "identify.trace:Trace",
    "catalogue": "identify.effects:catalogue", "explained": "identify.explain:explain",
    "identified": "identify.joint:identify", "simulated": "identify.notebook.simulated:simulated",
}  # fmt: skip
"""Where each public name lives; ``explain`` and ``simulate`` are rooms of this package."""

__all__ = [
    "Backlash", "CurvedBacklash", "LinearF", "Model", "Physics", "Rational", "Step", "Trace", "catalogue", "explained",
    "identified", "simulated",
]  # fmt: skip

__getattr__, __dir__ = offered(__name__, HOMES)
