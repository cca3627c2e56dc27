"""How does the output of an instrument without a watchdog get from one level to another, step by step?"""

import time
from collections.abc import Callable

STEP_S = 0.01


def ramp(start_v: float, stop_v: float, ramp_s: float, put_out: Callable[[float], None]) -> None:
    """Call ``put_out`` with levels on the straight line from ``start_v`` to ``stop_v``; the last one is exact.

    A slow link makes the steps larger, never the ramp longer than one step beyond ``ramp_s``.
    """
    begun = time.monotonic()
    while (share := (time.monotonic() - begun) / ramp_s if ramp_s > 0 else 1.0) < 1.0:
        put_out(start_v + (stop_v - start_v) * share)
        time.sleep(STEP_S)
    put_out(stop_v)
