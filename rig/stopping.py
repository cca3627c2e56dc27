"""Who may ask a run to stop, and how does the run hear it?

By a signal, as Ctrl-C is one; or by its bell, a datagram socket that is the run's own and is looked at between two
blocks. It is named after the file that is being recorded (device and inode), so whoever looks at a recording that grows
finds the run behind it, however the path is spelled. It stands in a folder of the user alone: the operating system lets
nobody else ring it. Either way the same is done (``rig/runner.py``).
"""

import os
import signal
import socket
import stat
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

Asked = Callable[[], str | None]
"""Returns who asked the run to stop, None while nobody did."""

STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGTSTP)
FOLDER_VARIABLE = "RIG_BELLS"
MOST = 80  # bytes of a name that are heard


@dataclass
class StopRequest:
    """Who asked the run to stop, if anybody did: a signal, or who rang."""

    name: str | None = None


def nobody() -> None:
    """Return that nobody asks."""


@contextmanager
def stop_requests() -> Iterator[StopRequest]:
    """Turn stop signals into a request while inside; only the main thread can receive them."""
    request = StopRequest()

    def ask(number: int, frame: FrameType | None) -> None:
        request.name = request.name or signal.Signals(number).name

    if threading.current_thread() is not threading.main_thread():
        yield request
        return
    before = {number: signal.signal(number, ask) for number in STOP_SIGNALS}
    try:
        yield request
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def held_back() -> Iterator[Asked]:
    """Hold stop signals back while a recording is opened and closed: what is half would be lost.

    Gives what tells a run, once, who asked it to stop meanwhile. What no run was told is done behind this.
    """
    with stop_requests() as request:

        def told() -> str | None:
            who, request.name = request.name, None
            return who

        yield told
    if request.name is not None:
        signal.raise_signal(signal.Signals[request.name])


@contextmanager
def bell(recording: Path) -> Iterator[Asked]:
    """Give the run that records into a file its bell; where none can be hung up, one that never rings."""
    try:
        heard, path = _hung(recording)
    except OSError:
        yield nobody
        return
    try:
        yield lambda: _heard(heard)
    finally:
        heard.close()
        with suppress(OSError):
            path.unlink()


def ring(file: os.stat_result, who: str) -> bool:
    """Ask the run that records into ``file`` to stop; return whether there is such a run and it could be asked."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as caller:
        try:
            caller.sendto(who.encode()[:MOST], str(_folder() / _name(file)))
        except OSError:
            return False
    return True


def _hung(recording: Path) -> tuple[socket.socket, Path]:
    """Return a bell and where it is; raise OSError."""
    path = _folder() / _name(recording.stat())
    path.unlink(missing_ok=True)  # of a run that was killed
    heard = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    try:
        heard.setblocking(False)
        heard.bind(str(path))
        path.chmod(0o600)
    except OSError:
        heard.close()
        raise
    return heard, path


def _heard(bell: socket.socket) -> str | None:
    """Return who rang since the bell was last looked at; waits for nobody."""
    try:
        who = bell.recv(MOST)
    except OSError:
        return None
    return who.decode(errors="replace")


def _folder() -> Path:
    """Return the folder of bells, made where there is none; raise OSError where it is not the user's alone."""
    folder = Path(os.environ.get(FOLDER_VARIABLE) or f"/tmp/rig-bells-{os.getuid()}")
    folder.mkdir(mode=0o700, exist_ok=True)
    found = folder.lstat()
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid() or stat.S_IMODE(found.st_mode) & 0o077:
        raise PermissionError(f"{folder} is not a folder of this user alone")
    return folder


def _name(file: os.stat_result) -> str:
    return f"{file.st_dev}-{file.st_ino}"
