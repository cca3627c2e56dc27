"""What does a serial DAQ say in a run, had it all of it in memory and a host that takes it as fast as it can?

The run is played ahead by the firmware of the emulator in its own time, on a device whose output FIFO holds the whole
of it. What that firmware said is then sent to a host that plays the same run, as fast as the port takes it: the host is
what limits, not the emulator. All else a second firmware answers as ever.
"""

import time
from collections.abc import Callable
from itertools import count

import numpy as np
from numpy.typing import NDArray

from drivers.emulators.bench import Bench
from drivers.emulators.device_model import DeviceModel, Hardware, State
from drivers.emulators.pty_port import PtyPort
from drivers.emulators.serial_firmware import SerialFirmware
from drivers.framing import Frame, encode
from drivers.serial_messages import Kind, pack_codes
from rig.rigfile import RigFile

BEAT_S = 0.01
IN_A_FRAME = 512


def said(rig: RigFile, hardware: Hardware, codes: NDArray[np.int32], divider: int, inputs: int) -> bytes:
    """Return all that the device says from its start on, while it plays ``codes`` and is listened to."""
    firmware, numbers = SerialFirmware(DeviceModel(hardware, Bench(rig, hardware.capabilities)), beat_s=BEAT_S), count()

    def tell(kind: Kind, payload: bytes, number: int | None = None, now_s: float = 0.0) -> None:
        firmware.receive(encode(Frame(kind, next(numbers) if number is None else number, payload)), now_s)

    tell(Kind.COMMAND, f"ARM {codes.size} {divider} 0 100 {inputs}".encode())
    for start in range(0, codes.size, IN_A_FRAME):
        tell(Kind.OUTPUT, pack_codes(codes[start:start + IN_A_FRAME], hardware.capabilities.output_bits), start)
    tell(Kind.COMMAND, b"GO")
    _all(firmware, 0.0)
    spoken = bytearray()
    for beat in range(1, 3 + int(codes.size * divider / (hardware.clock_hz or 1.0) / BEAT_S)):
        now_s = 1.001 * beat * BEAT_S
        tell(Kind.ALIVE, b"", now_s=now_s)
        firmware.advance(now_s)
        spoken += _all(firmware, now_s)
    return bytes(spoken)


def _all(firmware: SerialFirmware, now_s: float) -> bytes:
    """Return all there is to send now."""
    pieces = []
    while piece := firmware.transmit(now_s):
        pieces.append(piece)
    return b"".join(pieces)


class PlayedAhead:
    """The device on a pty: it says ``spoken`` in every run."""

    def __init__(self, rig: RigFile, hardware: Hardware, spoken: bytes) -> None:
        """Power up."""
        self._model = DeviceModel(hardware, Bench(rig, hardware.capabilities))
        self._firmware, self._port, self._spoken = SerialFirmware(self._model, beat_s=BEAT_S), PtyPort(), spoken
        self._begun_s, self._now_s = time.monotonic(), 0.0
        self.path = self._port.path

    def run(self, over: Callable[[], bool]) -> None:
        """Be the device until ``over``."""
        while not over():
            self._port.wait(BEAT_S)
            self._hear()
            self._say(_all(self._firmware, self._now_s))
            if self._model.state is State.RUNNING:
                self._play()
        self._port.close()

    def _play(self) -> None:
        """Say what is said in a run; no time passes in the device until the host ends it: all was played before."""
        self._say(self._spoken)
        while self._model.state is State.RUNNING:
            self._port.wait(BEAT_S)
            self._hear()

    def _hear(self) -> None:
        if self._model.state is not State.RUNNING:
            self._now_s = time.monotonic() - self._begun_s
            self._firmware.advance(self._now_s)
        self._firmware.receive(self._port.read(65_536), self._now_s)

    def _say(self, data: bytes) -> None:
        """Send all of ``data``, unless a run is ended meanwhile."""
        state, view = self._model.state, memoryview(data)
        while view and self._model.state is state:
            sent = self._port.write(view[:65_536])
            view = view[sent:]
            if not sent:
                self._port.wait(BEAT_S, until_heard=True)
                self._hear()
