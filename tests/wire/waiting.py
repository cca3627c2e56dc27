"""How does a test wait for what another process does?"""

import time
from collections.abc import Callable
from contextlib import suppress
from typing import TypeVar

from rig.errors import StarvedError

Told = TypeVar("Told")


def eventually(true: Callable[[], bool], within_s: float = 10.0, every_s: float = 0.01) -> bool:
    """Return whether ``true`` comes in time; asking more often than ``every_s`` may slow down what is waited for."""
    deadline = time.monotonic() + within_s
    while not true() and time.monotonic() < deadline:
        time.sleep(every_s)
    return true()


def in_time(run: Callable[[], Told], tries: int = 3) -> Told:
    """Return what a run gives once this machine kept up, which a simulated board asks of it; else StarvedError.

    A busy machine does not always; a run that was starved is played again, as whoever is told so would.
    """
    for _ in range(tries - 1):
        with suppress(StarvedError):
            return run()
    return run()
