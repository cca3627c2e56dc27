"""Where do the signals of a long table stand until they are in a recording?

In memory while they are short; else in a file without a name, which is gone as soon as nobody reads it any more, also
when the process is killed.
"""

import os
import tempfile
import weakref
from collections.abc import Iterable
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path
from typing import Self, final

import numpy as np

from identify.trace import LONG, Array, Samples, Stored
from rig.errors import FileError


@dataclass(frozen=True)
class Spooled(Stored):
    """A signal of float64 in a file without a name, open under ``descriptor`` as long as this lives."""

    descriptor: int

    @classmethod
    def of(cls, size: int, descriptor: int) -> Self:
        """Return the signal; the file is closed with it."""
        made = cls(size, descriptor)
        weakref.finalize(made, os.close, descriptor)
        return made

    def read(self, start: int, stop: int) -> Array:
        """Return the samples [start, stop)."""
        values = np.empty(stop - start)
        data, at = values.data.cast("B"), 8 * start
        while data:
            count = os.preadv(self.descriptor, [data], at)
            if not count:
                raise FileError("the space for a signal too long for memory was cut short", do="start again")
            data, at = data[count:], at + count
        return values


@final
class Spool:
    """Takes the values of one signal, stretch by stretch; ``folder`` is where long ones may stand."""

    def __init__(self, folder: Path | None = None) -> None:
        """Begin with no values."""
        self._folder = folder
        self._file = tempfile.SpooledTemporaryFile(max_size=8 * LONG, dir=str(folder) if folder else None)  # noqa: SIM115
        self.size = 0

    def append(self, values: Array) -> None:
        """Take further values; raise FileError when there is no space for them."""
        try:
            self._file.write(np.ascontiguousarray(values, dtype=np.float64).tobytes())
        except OSError as error:
            where = str(self._folder or tempfile.gettempdir())
            raise FileError("no space for a signal too long for memory", where=where, value=error.strerror,
                            do="make room there, or write the result into another folder") from error
        self.size += values.size

    def signal(self) -> Samples:
        """Return all values; nothing is to be appended any more."""
        if self.size > LONG:
            self._file.flush()
            return Spooled.of(self.size, os.dup(self._file.fileno()))
        self._file.seek(0)
        return np.frombuffer(self._file.read(), dtype=np.float64)

    def close(self) -> None:
        """Let go of the file; a signal that was returned keeps it."""
        self._file.close()


def spooled(pieces: Iterable[Array], signals: int, folder: Path | None = None) -> list[Samples]:
    """Return as many signals as the rows of every piece, the pieces joined."""
    with ExitStack() as stack:
        spools = [stack.enter_context(closing(Spool(folder))) for _ in range(signals)]
        for piece in pieces:
            for spool, values in zip(spools, piece, strict=True):
                spool.append(values)
        return [spool.signal() for spool in spools]
