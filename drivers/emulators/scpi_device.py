"""How does an emulated SCPI instrument live: power, messages in, replies out, faults, time?

The port speaks, the firmware answers, the device model behind it plays; what goes wrong between them is scripted.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from types import TracebackType
from typing import Protocol, Self, final

import numpy as np

from drivers.emulators.bench import Bench
from drivers.emulators.device_model import DeviceModel, Hardware
from drivers.emulators.faults import NO_FAULTS, Faults, Mischief, Piece
from drivers.emulators.outage import LOSES_ALL, Outage
from drivers.emulators.scpi_instrument import Commands, ScpiParser
from drivers.emulators.way import Way
from rig.rigfile import RigFile

TICK_S, IDLE_S = 0.001, 0.02
LONGEST_S = 0.2
"""Real time the instrument lives through at once, at most."""
NAME = 60


class Port(Protocol):
    """A transport: whole messages come in, bytes or messages go out."""

    @property
    def where(self) -> str:
        """What follows the scheme in the device's address."""

    def hear(self) -> list[bytes]:
        """Return the messages that arrived."""

    def say(self, data: bytes) -> None:
        """Send bytes to the host: one message where the transport has messages."""

    def wait(self, seconds: float) -> None:
        """Sleep until the host speaks, or the time is over."""

    def pull(self) -> None:
        """Tear the link."""

    def plug(self) -> None:
        """Mend it; harmless when it is whole."""

    def close(self) -> None:
        """Be gone for good."""


class Firmware(Commands, Protocol):
    """An instrument's commands, and the device model they are in front of."""

    @property
    def busy(self) -> bool:
        """Whether something goes on without being asked."""

    def advance(self, now_s: float) -> None:
        """Let time pass until ``now_s``."""


@dataclass
class _Wire:
    """Both ways between host and instrument, and what goes wrong on them."""

    mischief: Mischief
    to_device: Way = field(default_factory=Way)
    to_host: Way = field(default_factory=Way)


@final
class ScpiDevice:
    """An instrument in front of a simulated rig. ``speed`` runs its clock faster; ``now_s`` is its own time."""

    def __init__(
        self, rig: RigFile, firmware: Callable[[DeviceModel, int], Firmware], hardware: Hardware, port: Port,
        end: bytes, *, speed: float = 1.0, seed: int = 0, faults: Faults = NO_FAULTS,
    ) -> None:
        """Power up behind ``port``; every reply ends with ``end``."""
        self._bench, self._hardware = Bench(rig, hardware.capabilities), hardware
        self._made, self._seed = firmware, seed
        self._port, self._end, self._speed, self._delay_s = port, end, speed, faults.delay_s
        self.wire = _Wire(Mischief(faults.script))
        self._start_s, self.now_s, self._behind_s = time.monotonic(), 0.0, 0.0
        self._outage = Outage()
        self._power_up()

    @property
    def path(self) -> str:
        """Return what follows the scheme in the device's address."""
        return self._port.where

    def run(self, stopped: Callable[[], bool]) -> None:
        """Be the device until ``stopped``."""
        while not stopped():
            self._port.wait(TICK_S if self._firmware.busy or self.wire.to_host or self.wire.to_device else IDLE_S)
            if not self._outage.hung:
                self.step(time.monotonic() - self._start_s)

    def step(self, now_s: float) -> None:
        """Do all that is due: hear the host, play and read samples, reply. ``now_s`` is real time since power-up."""
        if now_s >= self._outage.back_s:
            self._port.plug()
        self._pass(now_s)
        self._hear(now_s)
        self._firmware.advance(self.now_s)
        if now_s >= self._outage.mute_until_s:
            for data in self.wire.to_host.due(now_s):
                self._port.say(data)
        for fault in self.wire.mischief.happening(self.model.played):
            self._outage.begin(fault, now_s, self._port)
            if fault.what in LOSES_ALL:
                self._power_up()

    def close(self) -> None:
        """Tear the link."""
        self._port.close()

    def __enter__(self) -> Self:
        """Return the emulator itself."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None,
                 ) -> None:
        """Tear the link."""
        self.close()

    def warm_up(self) -> None:
        """Play a few samples, so that compiled loops are ready before the clock runs."""
        self._bench.reset(1000.0, 0)
        self._bench.play(np.zeros(4, dtype=np.int32))

    def _power_up(self) -> None:
        """Be an instrument just switched on."""
        self.model = DeviceModel(self._hardware, self._bench)
        self._firmware = self._made(self.model, self._seed)
        self._parser = ScpiParser(self._firmware)
        self.wire.to_device, self.wire.to_host = Way(), Way()

    def _pass(self, now_s: float) -> None:
        """Let the instrument's own time pass; on a computer too slow for it, it falls behind rather than deaf."""
        due_s = now_s * self._speed - self._behind_s
        self.now_s = min(due_s, self.now_s + LONGEST_S * self._speed)
        self._behind_s += due_s - self.now_s

    def _hear(self, now_s: float) -> None:
        """Take the messages that arrive, and put the replies on their way."""
        for message in self._port.hear():
            self.wire.to_device.put(self.wire.mischief.heard(_name(message), message, bytes), now_s)
        for message in self.wire.to_device.due(now_s):
            reply = self._parser.execute(message, self.now_s)
            if reply:
                self.wire.to_host.put(self._said(message, reply), now_s, self._delay_s)

    def _said(self, message: bytes, reply: bytes) -> list[Piece]:
        """Return what arrives of a reply on the host."""
        return self.wire.mischief.said(_name(message), reply, partial(_ended, self._end))


def _name(message: bytes) -> str:
    """Return what a script calls a message and its reply."""
    return message[:NAME].decode("ascii", "replace").strip()


def _ended(end: bytes, reply: bytes) -> bytes:
    return reply + end
