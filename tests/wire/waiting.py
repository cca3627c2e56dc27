"""How does a test wait for what another process does?"""

import time
from collections.abc import Callable


def eventually(true: Callable[[], bool], within_s: float = 10.0) -> bool:
    """Return whether ``true`` comes in time."""
    deadline = time.monotonic() + within_s
    while not true() and time.monotonic() < deadline:
        time.sleep(0.01)
    return true()
