"""How does the emulated serial DAQ get onto a real port, in real time?

A pty ignores the baud rate and blocks its writer after some 20 kB; so the link is paced here, the clock runs whether
the host listens or not, and what does not fit the FIFOs is lost and flagged, as on a board.
"""

import os
import pty
import select
import signal
import time
import tty
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from types import FrameType, TracebackType
from typing import Self, final

import numpy as np

from drivers.emulators.bench import Bench
from drivers.emulators.device_model import DeviceModel, Hardware
from drivers.emulators.faults import NO_FAULTS, Faults, NoisyLine
from drivers.emulators.serial_firmware import SerialFirmware
from rig.device import Capabilities, Identity
from rig.rigfile import RigFile

BAUD = 3_000_000
"""Of the emulated link: 300 kB/s each way, ten bits a byte."""
TICK_S, IDLE_S, BEAT_S = 0.002, 0.05, 0.01
TX_BUFFER = 4096

HARDWARE = Hardware(
    Identity("serial DAQ, emulated", "EMU-1", "1"),
    Capabilities(output_low_v=-10.0, output_high_v=10.0, input_low_v=-20.0, input_high_v=20.0, min_rate_hz=1.0,
                 max_rate_hz=50_000.0, output_bits=16, input_bits=24, buffer_samples=32768),
    output_fifo=32768, input_fifo=32768, history=32768, clock_hz=48e6, watchdog_s=2.0,
)


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
class SerialPty:
    """A serial DAQ in front of a simulated rig on a real pty.

    ``speed`` runs its clock and its link faster; ``now_s`` is its own time at the last step.
    """

    def __init__(self, rig: RigFile, *, speed: float = 1.0, seed: int = 0, hardware: Hardware = HARDWARE,
                 faults: Faults = NO_FAULTS) -> None:
        """Power up and open the pty; raise OSError when the system has none left."""
        self.model = DeviceModel(hardware, Bench(rig, hardware.capabilities))
        self._firmware = SerialFirmware(self.model, seed, beat_s=BEAT_S * speed)
        self._faults, self._speed, self._muted_until_s = faults, speed, None if faults.mute_at is None else 0.0
        self._lines = NoisyLine(faults, 0), NoisyLine(faults, 1)
        self._paces = Pace(BAUD / 10 * speed), Pace(BAUD / 10 * speed)
        self._sending: deque[tuple[float, bytes]] = deque()
        self._tx = bytearray()
        self._start_s, self.now_s = time.monotonic(), 0.0
        self._master, self._slave = pty.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.path = os.ttyname(self._slave)

    def run(self, stopped: Callable[[], bool]) -> None:
        """Be the device until ``stopped``, or until the link is torn by a fault."""
        while not (stopped() or self._reached(self._faults.die_at)):
            self._wait()
            if not self._reached(self._faults.hang_at):
                self.step(time.monotonic() - self._start_s)

    def step(self, now_s: float) -> None:
        """Do all that is due: hear the host, play and read samples, speak. ``now_s`` is real time since power-up."""
        self._hear(now_s)
        self.now_s = now_s * self._speed
        self._firmware.advance(self.now_s)
        if not self._muted(now_s):
            self._speak(now_s)

    def close(self) -> None:
        """Tear the link."""
        os.close(self._master)
        os.close(self._slave)

    def __enter__(self) -> Self:
        """Return the emulator itself."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None,
                 ) -> None:
        """Tear the link."""
        self.close()

    def _wait(self) -> None:
        """Sleep to the next tick; with nothing to do, until the host speaks."""
        if self._firmware.live or self._tx or self._sending:
            time.sleep(TICK_S)
        else:
            select.select([self._master], [], [], IDLE_S)

    def _hear(self, now_s: float) -> None:
        """Take the bytes that had time to arrive."""
        allowed = self._paces[0].allowed(now_s)
        with suppress(BlockingIOError):
            data = os.read(self._master, max(1, allowed))
            self._paces[0].spend(len(data))
            self._firmware.receive(self._lines[0].carry(data), now_s * self._speed)

    def _speak(self, now_s: float) -> None:
        """Send what had time to leave, while the host's side takes it."""
        while len(self._tx) < TX_BUFFER and (more := self._firmware.transmit(now_s * self._speed)):
            self._sending.append((now_s + self._faults.delay_s, more))
            self._due(now_s)
        self._due(now_s)
        with suppress(BlockingIOError):
            sent = os.write(self._master, self._tx[:self._paces[1].allowed(now_s)])
            self._paces[1].spend(sent)
            del self._tx[:sent]

    def _due(self, now_s: float) -> None:
        """Move what was held back long enough to the send buffer."""
        while self._sending and self._sending[0][0] <= now_s:
            self._tx += self._lines[1].carry(self._sending.popleft()[1])

    def _muted(self, now_s: float) -> bool:
        """Return whether a fault keeps the device from sending now; it does so once."""
        if self._muted_until_s is None or not self._reached(self._faults.mute_at):
            return False
        if self._muted_until_s == 0.0:
            self._muted_until_s = now_s + self._faults.mute_s
        return now_s < self._muted_until_s

    def _reached(self, sample: int | None) -> bool:
        """Return whether the run in progress played more than ``sample`` samples; None is never reached."""
        return sample is not None and self.model.played > sample


def serve(rig: RigFile, announce: Callable[[str], None], *, speed: float = 1.0, seed: int = 0) -> None:
    """Offer the emulated serial DAQ in front of ``rig`` until SIGINT or SIGTERM.

    ``announce`` is called once with the path of the pty, when the device answers there: ``serial:PATH`` is its address.
    ``speed`` 10 plays a minute's protocol in six seconds. Raises OSError when the system has no pty left.
    """
    with SerialPty(rig, speed=speed, seed=seed, hardware=_hastened(HARDWARE, speed)) as emulator, _stop() as stopped:
        _warm_up(emulator.model.bench)
        announce(emulator.path)
        emulator.run(stopped)


def _hastened(hardware: Hardware, speed: float) -> Hardware:
    """Return the hardware with its watchdog in real time: the host is no faster because the device is."""
    return replace(hardware, watchdog_s=hardware.watchdog_s * speed)


def _warm_up(bench: Bench) -> None:
    """Play a few samples, so that compiled loops are ready before the clock runs."""
    bench.reset(1000.0, 0)
    bench.play(np.zeros(4, dtype=np.int32))


@contextmanager
def _stop() -> Iterator[Callable[[], bool]]:
    """Give a function that tells whether SIGINT or SIGTERM came."""
    came: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        came.append(number)

    before = {number: signal.signal(number, note) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield lambda: bool(came)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
