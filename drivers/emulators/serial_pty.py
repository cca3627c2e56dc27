"""How does the emulated serial DAQ get onto a real port, in real time?

A pty ignores the baud rate and blocks its writer after some 20 kB; so the link is paced here, the clock runs whether
the host listens or not, and what does not fit the FIFOs is lost and flagged, as on a board.
"""

import time
from collections.abc import Callable
from dataclasses import replace
from types import TracebackType
from typing import Self, final

import numpy as np

from drivers.emulators.bench import WIRED, Bench
from drivers.emulators.device_model import DeviceModel, Hardware
from drivers.emulators.faults import NO_FAULTS, Faults
from drivers.emulators.outage import LOSES_ALL, Outage
from drivers.emulators.pty_port import Pace, PtyPort
from drivers.emulators.serial_faults import FaultyWire
from drivers.emulators.serial_firmware import SerialFirmware
from drivers.emulators.stopping import until_stopped
from rig.device import Capabilities, Identity
from rig.rigfile import RigFile

LINK_BYTES_PER_S = 300_000.0
"""Of the emulated link each way: 3 Mbaud, ten bits a byte."""
TICK_S, IDLE_S, BEAT_S = 0.002, 0.05, 0.01
TX_BUFFER = 4096
"""Bytes; a faster link has one for two ticks."""

HARDWARE = Hardware(
    Identity("serial DAQ, emulated", "EMU-1", "1"),
    Capabilities(output_low_v=-10.0, output_high_v=10.0, input_low_v=-20.0, input_high_v=20.0, min_rate_hz=1.0,
                 max_rate_hz=50_000.0, output_bits=16, input_bits=24, buffer_samples=32768, inputs=len(WIRED),
                 max_total_rate_hz=LINK_BYTES_PER_S / 3 / 1.1),
    output_fifo=32768, input_fifo=32768, history=32768, clock_hz=48e6, watchdog_s=2.0,
    link_bytes_per_s=LINK_BYTES_PER_S,
)


@final
class SerialPty:
    """A serial DAQ in front of a simulated rig on a real pty.

    ``speed`` runs its clock and its link faster; ``now_s`` is its own time at the last step.
    """

    def __init__(self, rig: RigFile, *, speed: float = 1.0, seed: int = 0, hardware: Hardware = HARDWARE,
                 faults: Faults = NO_FAULTS) -> None:
        """Power up and open the pty; raise OSError when the system has none left."""
        self._bench, self._hardware = Bench(rig, hardware.capabilities), hardware
        self._speed, self._seed = speed, seed
        self.wire = FaultyWire(faults)
        bytes_per_s = hardware.link_bytes_per_s * speed
        self._paces, self._tx_buffer = (Pace(bytes_per_s), Pace(bytes_per_s)), max(TX_BUFFER, 2 * TICK_S * bytes_per_s)
        self._fast = bytes_per_s * TICK_S > TX_BUFFER
        self._start_s, self.now_s = time.monotonic(), 0.0
        self._outage = Outage()
        self._power_up()
        self._port = PtyPort()
        self.path = self._port.path

    def run(self, stopped: Callable[[], bool]) -> None:
        """Be the device until ``stopped``."""
        while not stopped():
            self._wait()
            if not self._outage.hung:
                self.step(time.monotonic() - self._start_s)

    def step(self, now_s: float) -> None:
        """Do all that is due: hear the host, play and read samples, speak. ``now_s`` is real time since power-up."""
        if now_s >= self._outage.back_s:
            self._port.plug()
        self._hear(now_s)
        self.now_s = now_s * self._speed
        self._firmware.advance(self.now_s)
        if now_s >= self._outage.mute_until_s:
            self._speak(now_s)
        for fault in self.wire.happening(self.model.played):
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

    def _power_up(self) -> None:
        """Be a device just switched on: nothing known, nothing output."""
        self.model = DeviceModel(self._hardware, self._bench)
        self._firmware = SerialFirmware(self.model, self._seed, beat_s=BEAT_S * self._speed)
        self._tx, self._held_up = bytearray(), False

    def _wait(self) -> None:
        """Sleep to the next tick; with nothing to do, until the host speaks."""
        if self._fast:
            self._port.wait(TICK_S, self._held_up)
        elif self._firmware.live or self._tx or self.wire.busy:
            time.sleep(TICK_S)
        else:
            self._port.wait(IDLE_S)

    def _hear(self, now_s: float) -> None:
        """Take the bytes that had time to arrive."""
        allowed = max(1, self._paces[0].allowed(now_s))
        data = bytearray()
        while len(data) < allowed and (more := self._port.read(allowed - len(data))):
            data += more
        self._paces[0].spend(len(data))
        self._firmware.receive(self.wire.to_device(bytes(data), now_s), now_s * self._speed)

    def _speak(self, now_s: float) -> None:
        """Send what had time to leave, while the host's side takes it."""
        while len(self._tx) < self._tx_buffer and (more := self._firmware.transmit(now_s * self._speed)):
            self._tx += self.wire.to_host(more, now_s)
        self._tx += self.wire.to_host(b"", now_s)
        allowed = min(len(self._tx), self._paces[1].allowed(now_s))
        sent = 0
        self._held_up = False
        while sent < allowed and (count := self._port.write(memoryview(self._tx)[sent:allowed])):
            sent += count
        self._held_up = sent < allowed
        self._paces[1].spend(sent)
        del self._tx[:sent]


def serve(rig: RigFile, announce: Callable[[str], None], *, speed: float = 1.0, seed: int = 0) -> None:
    """Offer the emulated serial DAQ in front of ``rig`` until SIGINT or SIGTERM.

    ``announce`` is called once with the path of the pty, when the device answers there: ``serial:PATH`` is its address.
    ``speed`` 10 plays a minute's protocol in six seconds. Raises OSError when the system has no pty left.
    """
    hardware = _hastened(HARDWARE, speed)
    with SerialPty(rig, speed=speed, seed=seed, hardware=hardware) as emulator, until_stopped() as stopped:
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
