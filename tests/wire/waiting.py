"""How does a test wait for what another process does?"""

import time
from collections.abc import Callable


def eventually(true: Callable[[], bool], within_s: float = 10.0, every_s: float = 0.01) -> bool:
    """Return whether ``true`` comes in time; asking more often than ``every_s`` may slow down what is waited for."""
    deadline = time.monotonic() + within_s
    while not true() and time.monotonic() < deadline:
        time.sleep(every_s)
    return true()
