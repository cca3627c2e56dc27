"""How does a test get an emulated device in a process of its own, and look behind it?"""

import multiprocessing
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from drivers.emulators.faults import NO_FAULTS, Faults
from drivers.emulators.serial_pty import HARDWARE, SerialPty
from rig.rigfile import parse_rig

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


@dataclass(frozen=True)
class Emulated:
    """An emulated device running elsewhere."""

    path: str
    pipe: Connection
    process: Any

    @property
    def address(self) -> str:
        """Return its device address."""
        return f"serial:{self.path}"

    def look(self) -> Insight:
        """Return what the device does now."""
        self.pipe.send("look")
        assert self.pipe.poll(5), "the emulator does not answer its test"
        return Insight(**self.pipe.recv())


@contextmanager
def emulated(rig: str, *, speed: float = 1.0, faults: Faults = NO_FAULTS, **hardware: Any) -> Iterator[Emulated]:
    """Run an emulated serial DAQ in front of ``rig``; ``hardware`` replaces fields of its Hardware."""
    here, there = CONTEXT.Pipe()
    process = CONTEXT.Process(target=_live, args=(there, rig, speed, faults, hardware), daemon=True)
    process.start()
    there.close()
    try:
        assert here.poll(20), "the emulator does not start"
        yield Emulated(here.recv(), here, process)
    finally:
        here.close()
        process.join(5)
        if process.is_alive():
            process.kill()


def _live(pipe: Connection, rig: str, speed: float, faults: Faults, hardware: dict[str, Any]) -> None:
    soldered = replace(HARDWARE, **{"watchdog_s": HARDWARE.watchdog_s * speed, **hardware})
    with SerialPty(parse_rig(rig, "test"), speed=speed, hardware=soldered, faults=faults) as device:
        device.model.bench.reset(1000.0, 0)
        device.model.bench.play(np.zeros(4, dtype=np.int32))
        pipe.send(device.path)
        device.run(lambda: _over(pipe, device))


def _over(pipe: Connection, device: SerialPty) -> bool:
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
    })
    return False
