"""Which devices can be emulated, byte for byte, for a host that cannot tell them from the real one?

An emulator lives beside the drivers, which this package does not import: it is found by name, as a driver class is.
"""

import importlib
from collections.abc import Callable
from typing import Protocol, cast

from rig.errors import DeviceError
from rig.rigfile import RigFile

EMULATORS = {"serial": "drivers.emulators.serial_pty:serve"}


class Serve(Protocol):
    """Offers a device until SIGINT or SIGTERM; ``announce`` is called once with what follows the scheme."""

    def __call__(self, rig: RigFile, announce: Callable[[str], None], *, speed: float, seed: int) -> None:
        """Serve; raise OSError when the system cannot offer it."""


def emulate(kind: str, rig: RigFile, announce: Callable[[str], None], speed: float = 1.0, seed: int = 0) -> None:
    """Offer an emulated device in front of ``rig`` until stopped; ``announce`` is told its address."""
    module, _, name = EMULATORS[kind].partition(":")
    serve = cast(Serve, getattr(importlib.import_module(module), name))
    try:
        serve(rig, lambda where: announce(f"{kind}:{where}"), speed=speed, seed=seed)
    except OSError as error:
        raise DeviceError("the system offers no port for the emulator", value=str(error)) from error
