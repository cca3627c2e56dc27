"""How do several processes share the compiled loops on the disk?

numba numbers the files of its cache by what its index says and writes the index afterwards: of two processes that
compile different forms of one function at once, one may find the other's code under its own name (in numba 0.68
``numba/core/caching.py``, ``IndexDataCacheFile.save``; numba issue 10128 is of the same family). Here both take turns.
"""

import fcntl
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from numba.core import caching


class TakingTurns(caching.IndexDataCacheFile):
    """The cache of one compiled function, read and written under a lock that all processes of a batch hold to."""

    def save(self, key: Any, data: Any) -> None:
        """Enter compiled code in index and file, nobody between."""
        with self._turn(fcntl.LOCK_EX):
            super().save(key, data)  # type: ignore[no-untyped-call]

    def load(self, key: Any) -> Any:
        """Return compiled code, None where there is none."""
        with self._turn(fcntl.LOCK_SH):
            return super().load(key)  # type: ignore[no-untyped-call]

    @contextmanager
    def _turn(self, kind: int) -> Iterator[None]:
        with Path(self._cache_path, "turn.lock").open("a") as file:
            fcntl.flock(file, kind)
            yield


def take_turns() -> None:
    """Have this process take turns with others; to be called before any compiled function is imported."""
    caching.IndexDataCacheFile = TakingTurns  # type: ignore[misc]
