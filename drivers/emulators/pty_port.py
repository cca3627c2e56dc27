"""How does an emulated device sit on a real port that can be pulled, and plugged in again?

Its path is a link of its own to the pty of the hour, as ``/dev/serial/by-id`` is to a real port: it outlives a replug.
"""

import os
import pty
import select
import shutil
import tempfile
import tty
from contextlib import suppress
from pathlib import Path
from typing import final


@final
class Pace:
    """How many bytes a link of so many bytes a second has carried until now."""

    def __init__(self, bytes_per_s: float) -> None:
        """Start with nothing to carry."""
        self._rate, self._last_s, self._credit = bytes_per_s, 0.0, 0.0

    def allowed(self, now_s: float) -> int:
        """Return how many bytes may pass now; what is not used for 50 ms is lost."""
        self._credit = min(self._credit + (now_s - self._last_s) * self._rate, 0.05 * self._rate)
        self._last_s = now_s
        return int(self._credit)

    def spend(self, count: int) -> None:
        """Note that ``count`` bytes passed."""
        self._credit -= count


@final
class PtyPort:
    """The device's end of a pty; while it is pulled, nothing is read and what is written is lost."""

    def __init__(self) -> None:
        """Open the pty; raise OSError when the system has none left."""
        self._folder = Path(tempfile.mkdtemp(prefix="rig-"))
        self.path = str(self._folder / "port")
        self._ends: tuple[int, int] | None = None
        try:
            self.plug()
        except OSError:
            shutil.rmtree(self._folder, ignore_errors=True)
            raise

    def plug(self) -> None:
        """Offer a fresh pty under the same path; harmless when there is one. Raise OSError when there is none left."""
        if self._ends is not None:
            return
        master, slave = pty.openpty()
        tty.setraw(slave)
        os.set_blocking(master, False)
        self._ends = master, slave
        os.symlink(os.ttyname(slave), self.path)

    def pull(self) -> None:
        """Tear the link, path and all; harmless when it is torn."""
        if self._ends is None:
            return
        os.unlink(self.path)
        for end in self._ends:
            os.close(end)
        self._ends = None

    def wait(self, timeout_s: float, until_heard: bool = False) -> None:
        """Return when the host speaks, or after ``timeout_s``; with ``until_heard`` also when it takes more."""
        end = [] if self._ends is None else [self._ends[0]]
        select.select(end, end if until_heard else [], [], timeout_s)

    def read(self, most: int) -> bytes:
        """Return up to ``most`` bytes that the host sent, without waiting."""
        if self._ends is None:
            return b""
        with suppress(BlockingIOError):
            return os.read(self._ends[0], most)
        return b""

    def write(self, data: bytes | memoryview) -> int:
        """Pass on what the host's side has room for; return how many bytes that was."""
        if self._ends is None:
            return len(data)
        with suppress(BlockingIOError):
            return os.write(self._ends[0], data)
        return 0

    def close(self) -> None:
        """Tear the link for good; harmless when that was done."""
        self.pull()
        shutil.rmtree(self._folder, ignore_errors=True)
