"""Where is the output of an instrument without a watchdog, and how does it get to another level, step by step?"""

import time
from collections.abc import Callable
from dataclasses import dataclass, field

from rig.device import Array

STEP_S = 0.01


@dataclass
class Playing:
    """A run that an instrument plays out of its memory: u in V, shape (N,), and how much of the answer was read."""

    u: Array
    rate_hz: float
    started_s: float
    received: int = field(default=0, kw_only=True)

    def held_v(self) -> float:
        """Return the level at the output now, V, as far as the host can tell."""
        passed = int((time.monotonic() - self.started_s) * self.rate_hz)
        return float(self.u[max(0, min(max(passed, self.received), self.u.size) - 1)])


def ramp(start_v: float, stop_v: float, ramp_s: float, put_out: Callable[[float], None]) -> None:
    """Call ``put_out`` with levels on the straight line from ``start_v`` to ``stop_v``; the last one is exact.

    A slow link makes the steps larger, never the ramp longer than one step beyond ``ramp_s``.
    """
    begun = time.monotonic()
    while (share := (time.monotonic() - begun) / ramp_s if ramp_s > 0 else 1.0) < 1.0:
        put_out(start_v + (stop_v - start_v) * share)
        time.sleep(STEP_S)
    put_out(stop_v)
