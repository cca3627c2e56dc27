"""Who owns a port, so that two programs never speak to one device at a time?

A lock on a file named after the port, in a folder all users of the machine share. The lock belongs to the open file, so
the system lets go of it however its owner ends, and a process that was handed the open file keeps it: a guardian holds
the port over the death of the program it guards, and nobody gets in between. pyserial can lock a port by itself, but
pyvisa-py opens one TCP or USB device as often as it is asked to.
"""

import fcntl
import os
import re
import sys
import time
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from typing import final

from rig.errors import DeviceError

FOLDER_VARIABLE, FOLDER = "RIG_PORTS", "/tmp/rig-ports"
"""Where ports are locked. All programs must agree on it, so it does not follow TMPDIR."""
PATIENCE_S, AGAIN_S = 0.5, 0.02
"""How long a port is waited for: its owner may be about to let go of it."""


@final
class Claim:
    """The sole right to a port, until it is released or the last process that has it ends."""

    def __init__(self, port: str, descriptor: int) -> None:
        """Take charge of the open lock file ``descriptor``."""
        self.port = port
        self._descriptor: int | None = descriptor

    def fileno(self) -> int:
        """Return the open lock file, to be handed to another process; raise ValueError once it is released."""
        if self._descriptor is None:
            raise ValueError(f"{self.port} was let go of")
        return self._descriptor

    def sign(self, owner: str) -> None:
        """Write down who has the port, for those who are refused it."""
        text = owner.encode(errors="replace")
        os.pwrite(self.fileno(), text, 0)
        os.truncate(self.fileno(), len(text))

    def release(self) -> None:
        """Let go of the port; harmless when that was done before."""
        descriptor, self._descriptor = self._descriptor, None
        if descriptor is not None:
            os.close(descriptor)


def claim(port: str) -> Claim:
    """Return the sole right to ``port``; raise DeviceError when another program, or this one, has it already."""
    found = Claim(port, _opened(port))
    try:
        _lock(found)
        found.sign(f"process {os.getpid()} ({_program()})")
    except BaseException:
        found.release()
        raise
    return found


def _lock(found: Claim) -> None:
    """Lock the file, waiting a moment for an owner that is about to go; raise DeviceError."""
    deadline = time.monotonic() + PATIENCE_S
    while True:
        try:
            fcntl.flock(found.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if time.monotonic() > deadline:
                owner = os.pread(found.fileno(), 500, 0).decode(errors="replace") or "another program"
                raise DeviceError("the device is in use", where=found.port, value=f"by {owner}",
                                  allowed="one program at a time", do="close the program that holds the port") from None
            time.sleep(AGAIN_S)
        else:
            return


def _opened(port: str) -> int:
    """Return the open lock file of ``port``; raise DeviceError where none can be made."""
    folder = Path(os.environ.get(FOLDER_VARIABLE, FOLDER))
    path = folder / f"{re.sub(r'[^A-Za-z0-9.]+', '-', port)[-60:]}.{sha256(port.encode()).hexdigest()[:16]}"
    try:
        if not folder.is_dir():
            folder.mkdir(parents=True, exist_ok=True)
            folder.chmod(0o1777)
        return _file(path)
    except OSError as error:
        raise DeviceError("the port cannot be locked", where=port, value=f"{path}: {error.strerror}",
                          do=f"make the folder writable, or name another one in {FOLDER_VARIABLE}") from error


def _file(path: Path) -> int:
    """Return the file opened, made where it is not there; all users may lock it."""
    with suppress(FileNotFoundError):  # one that is another user's may only be opened without asking to make it
        return os.open(path, os.O_RDWR | os.O_NOFOLLOW | os.O_CLOEXEC)
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o666)
    with suppress(PermissionError):  # it was made by another user at this very moment
        os.fchmod(descriptor, 0o666)
    return descriptor


def _program() -> str:
    """Return what was typed to start this program, shortened."""
    return " ".join([Path(sys.argv[0]).name, *sys.argv[1:]])[:200]
