"""Which devices can be emulated, byte for byte, for a host that cannot tell them from the real one?

A driver names its emulator (``Device.emulator``), which lives beside the drivers and is imported when it is wanted:
this package does not import it.
"""

import importlib
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Protocol, cast

from rig import registry
from rig.errors import DeviceError, RigError, UsageError
from rig.rigfile import RigFile, read_rig

PATIENCE_S = 5.0
"""An emulator asked to stop is killed when it has not by then."""


class Serve(Protocol):
    """Offers a device until SIGINT or SIGTERM; ``announce`` is called once with what follows the scheme."""

    def __call__(self, rig: RigFile, announce: Callable[[str], None], *, speed: float, seed: int) -> None:
        """Serve; raise OSError when the system cannot offer it."""


def emulate(kind: str, rig: RigFile, announce: Callable[[str], None], speed: float = 1.0, seed: int = 0) -> None:
    """Offer an emulated device in front of ``rig`` until stopped; ``announce`` is told its address.

    Raises UsageError for a kind that has no emulator, DeviceError when the system cannot offer it.
    """
    _serve(_emulator(kind), rig, lambda where: announce(f"{kind}:{where}"), speed, seed)


@contextmanager
def offered(emulator: str, rig: str | Path, speed: float = 1.0) -> Iterator[str]:
    """Give the ``where`` of an emulated device that runs as a program of its own, as long as it is used.

    ``emulator`` is ``module:function``. Raises UsageError when it is empty, DeviceError when it does not come up.
    """
    if not emulator:
        raise UsageError("this kind of device has no emulator", do="name one in its driver, `emulator`")
    command = [sys.executable, "-m", __name__, emulator, str(rig), repr(speed)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stdin=subprocess.DEVNULL, text=True) as program:
        assert program.stdout is not None
        try:
            where = program.stdout.readline().strip()
            if not where:
                raise DeviceError("the emulator did not come up", where=emulator, value=f"exit code {program.wait()}")
            yield where
        finally:
            _stop(program)


def _stop(program: "subprocess.Popen[str]") -> None:
    """End a program, by force where asking does not do."""
    program.send_signal(signal.SIGTERM)
    try:
        program.wait(PATIENCE_S)
    except subprocess.TimeoutExpired:
        program.kill()


def _emulator(kind: str) -> str:
    """Return the ``module:function`` that emulates devices of a kind; raise UsageError where there is none."""
    known = registry.emulators()
    if kind not in known:
        raise UsageError("nothing emulates this kind of device", value=kind, allowed=", ".join(sorted(known)))
    return known[kind]


def _serve(emulator: str, rig: RigFile, announce: Callable[[str], None], speed: float, seed: int) -> None:
    module, _, name = emulator.partition(":")
    serve = cast(Serve, getattr(importlib.import_module(module), name))
    try:
        serve(rig, announce, speed=speed, seed=seed)
    except OSError as error:
        raise DeviceError("the system offers no port for the emulator", value=str(error)) from error


def main(emulator: str, rig: str, speed: str) -> int:
    """Serve as a program: print what follows the scheme, end on SIGTERM; return the exit code."""
    try:
        _serve(emulator, read_rig(rig), _tell, float(speed), 0)
    except RigError as error:
        sys.stderr.write(f"{error}\n")
        return error.exit_code
    return 0


def _tell(where: str) -> None:
    """Say where the device is, at once."""
    sys.stdout.write(f"{where}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
