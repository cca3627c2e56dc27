"""How does a test get an emulated device in a process of its own, and look behind it?"""

import importlib
import multiprocessing
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from drivers.emulators.faults import NO_FAULTS, Faults
from rig.rigfile import parse_rig

MADE_BY = {
    "serial": ("drivers.emulators.serial_pty:SerialPty", "drivers.emulators.serial_pty:HARDWARE"),
    "redpitaya": ("drivers.emulators.scpi_serve:redpitaya", "drivers.emulators.redpitaya_firmware:HARDWARE"),
    "u2300a": ("drivers.emulators.scpi_serve:u2300a", "drivers.emulators.u2300a_firmware:HARDWARE"),
}
"""What makes an emulated device of each kind, and the hardware it has."""
DRIVERS = {"serial": "serial", "redpitaya": "drivers.redpitaya:RedPitaya", "u2300a": "drivers.u2300a:U2300a"}
CONTEXT = multiprocessing.get_context("forkserver")
CONTEXT.set_forkserver_preload(["tests.wire.emulated", "tests.wire.warm"])


@dataclass(frozen=True)
class Insight:
    """What the device really does, not asked over its link."""

    level_v: float | None
    state: str
    played: int
    overrun_samples: int
    underrun: bool
    watchdog_tripped: bool
    struck: tuple[int, ...]
    said: tuple[str, ...]


@dataclass(frozen=True)
class Emulated:
    """An emulated device running elsewhere."""

    kind: str
    path: str
    pipe: Connection
    process: Any

    @property
    def address(self) -> str:
        """Return its device address."""
        return f"{DRIVERS[self.kind]}:{self.path}"

    def look(self) -> Insight:
        """Return what the device does now."""
        self.pipe.send("look")
        assert self.pipe.poll(5), "the emulator does not answer its test"
        return Insight(**self.pipe.recv())


@contextmanager
def emulated(
    rig: str, *, kind: str = "serial", speed: float = 1.0, faults: Faults = NO_FAULTS, **hardware: Any,
) -> Iterator[Emulated]:
    """Run an emulated device in front of ``rig``; ``hardware`` replaces fields of its Hardware."""
    here, there = CONTEXT.Pipe()
    process = CONTEXT.Process(target=_live, args=(there, kind, rig, speed, faults, hardware), daemon=True)
    process.start()
    there.close()
    try:
        assert here.poll(20), "the emulator does not start"
        yield Emulated(kind, here.recv(), here, process)
    finally:
        here.close()
        process.join(5)
        if process.is_alive():
            process.kill()


def _live(pipe: Connection, kind: str, rig: str, speed: float, faults: Faults, hardware: dict[str, Any]) -> None:
    make, usual = map(_found, MADE_BY[kind])
    soldered = replace(usual, **{"watchdog_s": usual.watchdog_s * speed, **hardware})
    with make(parse_rig(rig, "test"), speed=speed, hardware=soldered, faults=faults) as device:
        device.model.bench.reset(1000.0, 0)
        device.model.bench.play(np.zeros(4, dtype=np.int32))
        pipe.send(device.path)
        device.run(lambda: _over(pipe, device))


def _found(name: str) -> Any:
    """Return what ``module:name`` names."""
    module, _, inside = name.partition(":")
    return getattr(importlib.import_module(module), inside)


def _over(pipe: Connection, device: Any) -> bool:
    """Answer the test; return whether it hung up."""
    if not pipe.poll():
        return False
    try:
        pipe.recv()
    except EOFError:
        return True
    model = device.model
    pipe.send({
        "level_v": model.level_v(device.now_s), "state": model.state.value, "played": model.played,
        "overrun_samples": model.overrun_samples, "underrun": model.underrun,
        "watchdog_tripped": model.watchdog_tripped, "struck": tuple(device.wire.mischief.struck),
        "said": tuple(device.wire.mischief.names),
    })
    return False
