"""How is a run played on the serial DAQ, every sample of it accounted for?

The protocol is in ``serial_messages``. An address is ``serial:PORT``, with ``?baud=N`` behind it where the port has a
baud rate that matters.
"""

import math
import os
import time
from dataclasses import dataclass, field
from typing import final

import numpy as np
from serial.tools import list_ports

from drivers.converter import Coded, adc, dac
from drivers.framing import Frame
from drivers.serial_link import RefusalError, SerialLink
from drivers.serial_messages import (
    PROTOCOL,
    Condition,
    Description,
    Kind,
    Status,
    named,
    unpack_codes,
    unpack_range,
    width,
)
from drivers.serial_stream import LINK_LOSS, OVERRUN, Incoming, Outgoing, joined
from rig.device import Block, Capabilities, Device, Flag, Identity, Samples
from rig.errors import DeviceError, StarvedError, UsageError

BAUD = 3_000_000
GREETING_S = 3.0
"""Some boards start anew when their port is opened; until then they do not answer."""
GO_REPLY_S = 0.05
"""Until GO is answered nothing is sent, and the smallest FIFO lasts 77 ms: its answer is not waited for as long."""
GATHER_S, GATHERED, LEAST_WAIT_S = 0.01, 4096, 0.001
"""Longest wait between two reads, bytes gathered meanwhile, and a wait too short to be made."""
WINDOW_S, ALIVE_S, CONFIRM_S, POLL_S = 0.05, 0.2, 1.0, 0.02
PATIENCE_S = 10.0
"""For how long a device that has taken a safe level may be silent: this computer may be too busy to hear it."""
_TOLD = {Condition.UNDERRUN: "the device ran out of output samples and went to its safe level",
         Condition.WATCHDOG: "the device heard nothing from the host and went to its safe level"}


@dataclass
class _Run:
    """One run: what is still to be sent, what came back, and whether the device gave it up."""

    outgoing: Outgoing
    incoming: Incoming
    status: Status
    resent: bool = False
    spoke_s: float = field(default_factory=time.monotonic)
    gather_s: float = 0.0


@final
class SerialDaq(Device):
    """A DAQ with open firmware on a serial port."""

    emulator = "drivers.emulators.serial_pty:serve"

    def __init__(self, port: str, baud: int = BAUD) -> None:
        """Open ``port`` for this program alone and ask who is there; raise DeviceError."""
        super().__init__()
        self._link = SerialLink(port, baud)
        self._run: _Run | None = None
        self._put_out: int | None = None
        try:
            self._who = named(self._link.introduce(GREETING_S))
            self._can = self._described()
        except DeviceError:
            self._link.close()
            raise

    @classmethod
    def connect(cls, where: str) -> "SerialDaq":
        """Return the serial DAQ at ``where``, ``PORT`` or ``PORT?baud=N``; raise UsageError or DeviceError."""
        port, _, option = where.partition("?")
        if not port:
            raise UsageError("no port", where="serial:", allowed="a port, as in serial:/dev/ttyACM0",
                             do="see `rig devices`")
        return cls(port, _baud(option))

    @classmethod
    def port(cls, where: str) -> str:
        """Return the port itself, where ``where`` names a link to it (as those in /dev/serial/by-id)."""
        return os.path.realpath(where.partition("?")[0])

    @classmethod
    def attached(cls) -> tuple[str, ...]:
        """Return the USB serial ports; a pty is never among them."""
        return tuple(sorted(port.device for port in list_ports.comports() if port.vid is not None))

    def _described(self) -> Description:
        """Return what the device can do; raise DeviceError when it is none of ours."""
        if self._who.get("protocol") != PROTOCOL:
            raise DeviceError("the device speaks another protocol", where=self._link.port,
                              value=self._who.get("protocol", "none"), allowed=PROTOCOL, do="update its firmware")
        try:
            return Description.read(self._link.ask("CAP?"))
        except ValueError as error:
            raise DeviceError("the device describes itself badly", where=self._link.port, value=str(error)) from error

    def _identity(self) -> Identity:
        return Identity(*(self._who.get(name, "?") for name in ("model", "serial", "firmware")))

    def _capabilities(self) -> Capabilities:
        return self._can.capabilities()

    def _achievable_rate(self, rate_hz: float) -> float:
        return self._can.clock_hz / self._divider(rate_hz)

    def _divider(self, rate_hz: float) -> int:
        """Return the divider of the sample clock nearest to ``rate_hz``."""
        return max(1, round(self._can.clock_hz / rate_hz))

    def _begin(self, u: Samples, rate_hz: float, safe_level_v: float, ramp_s: float) -> None:
        try:
            self._start(u, rate_hz, safe_level_v, ramp_s)
        except StarvedError:  # this computer slept between ARM and GO: nothing was put out, and it can be begun anew
            self._safe(safe_level_v, ramp_s)
            self._start(u, rate_hz, safe_level_v, ramp_s)

    def _start(self, u: Samples, rate_hz: float, safe_level_v: float, ramp_s: float) -> None:
        """Arm, fill the output FIFO and go; raise StarvedError when the watchdog disarmed the device meanwhile."""
        codes = Coded(u, dac(self.capabilities()))
        window = int(WINDOW_S * max(rate_hz, self._link.bytes_per_s / width(self._can.output_bits)))
        self._link.ask(f"ARM {codes.size} {self._divider(rate_hz)} {self._ramp(safe_level_v, ramp_s)} {self._inputs}")
        self._link.forget()
        self._run = run = _Run(Outgoing(codes, self._can.output_bits, self._can.output_fifo, window),
                               Incoming(codes.size, self._inputs), Status(False, Condition.FINE, 0, 0, 0))
        self._fill(run)
        self._go(run)
        run.gather_s = self._gather_s(rate_hz)

    def _go(self, run: _Run) -> None:
        """Start the clock; raise StarvedError when the device is armed no more, which only its watchdog does."""
        try:
            self._link.ask("GO", GO_REPLY_S)
        except RefusalError as error:
            raise self._starved(Condition.WATCHDOG, run) from error

    def _gather_s(self, rate_hz: float) -> float:
        """Return how long to wait between two reads at this rate; at high rates data come faster than one can wait."""
        bytes_per_s = rate_hz * self._inputs * width(self._can.input_bits)
        gather_s = min(GATHER_S, GATHERED / bytes_per_s)
        return gather_s if gather_s > LEAST_WAIT_S else 0.0

    def _fill(self, run: _Run) -> None:
        """Fill the output FIFO; raise DeviceError when the device does not take the samples."""
        size = 2 * width(self._can.output_bits) * self._can.output_fifo
        deadline = time.monotonic() + GREETING_S + 2 * size / self._link.bytes_per_s
        while not run.outgoing.filled:
            self._exchange(run)
            self._refuse_given_up(run)
            if time.monotonic() > deadline:
                raise DeviceError("the device does not take its output samples", where=str(self.identity()),
                                  value=f"{run.status.accepted} taken", do="replug it")

    def _read(self, timeout_s: float) -> Block | None:
        run = self._running()
        begun_s = time.monotonic()
        while True:
            self._exchange(run)
            waited_s = time.monotonic() - begun_s
            if waited_s < GATHER_S:
                continue
            if (block := self._block(run)) is not None:
                return block
            self._refuse_given_up(run)
            if waited_s > timeout_s:
                return None

    def _running(self) -> _Run:
        """Return the run in progress."""
        if self._run is None:
            raise DeviceError("nothing was started", where=str(self.identity()))
        return self._run

    def _exchange(self, run: _Run) -> None:
        """Send what is due and take in what arrived."""
        now = time.monotonic()
        frames = [*run.outgoing.due(), *run.incoming.wanted(now)]
        if not frames and now - run.spoke_s > ALIVE_S:
            frames = [Frame(Kind.ALIVE, 0)]
        if frames:
            self._link.send(*frames)
            run.spoke_s = now
        for frame in joined(self._link.receive(run.gather_s), self._inputs * width(self._can.input_bits)):
            try:
                self._take(run, frame)
            except ValueError:
                continue  # whole, but of another run, or nonsense: what it should have said is asked for again

    def _take(self, run: _Run, frame: Frame) -> None:
        """Note what ``frame`` says; raise ValueError when that cannot be."""
        if frame.kind in (Kind.INPUT, Kind.RESENT):
            fresh = run.incoming.add(frame.number, unpack_codes(frame.payload, self._can.input_bits))
            run.resent = run.resent or bool(fresh and frame.kind == Kind.RESENT)
        elif frame.kind == Kind.LOST:
            overrun = run.status.condition & Condition.OVERRUN
            run.incoming.lost(*unpack_range(frame.payload), OVERRUN if overrun else LINK_LOSS)
        elif frame.kind == Kind.STATUS:
            status = Status.unpack(frame.payload)
            run.outgoing.heard(status, time.monotonic())
            run.incoming.sent(status.sent)
            run.status = status
            self._put_out = status.played

    def _block(self, run: _Run) -> Block | None:
        """Return the samples next in order, in V, None when none is there."""
        taken = run.incoming.take()
        if taken is None:
            return None
        start, codes, flags = taken
        converter = adc(self.capabilities())
        flags |= Flag.CLIPPED if converter.clipped(codes) else Flag.NONE
        flags |= Flag.RESENT if run.resent else Flag.NONE
        run.resent = False
        y, *further = converter.volts(codes.T)
        return Block(start, y, flags, np.array(further)) if further else Block(start, y, flags)

    def _refuse_given_up(self, run: _Run) -> None:
        """Raise DeviceError when the device ended the run by itself and all it sent is received."""
        given_up = next((flag for flag in _TOLD if run.status.condition & flag), None)
        if given_up is not None and run.status.sent >= run.status.played and run.incoming.settled:
            raise self._starved(given_up, run)

    def _starved(self, given_up: Condition, run: _Run) -> StarvedError:
        """Return that the device ended the run by itself, and why."""
        return StarvedError(_TOLD[given_up], where=str(self.identity()), value=f"at sample {run.status.played}",
                            do="lower the sample rate, or leave the computer less to do")

    def _halt(self) -> None:
        self._run = None
        self._link.ask("HALT")

    def _safe(self, level_v: float, ramp_s: float) -> None:
        self._run = None
        self._link.ask(f"SAFE {self._ramp(level_v, ramp_s)}")
        deadline = time.monotonic() + ramp_s + CONFIRM_S
        while time.monotonic() < deadline:
            state, level = self._output(PATIENCE_S)
            if state == "idle" and level is not None and abs(level - level_v) <= self.capabilities().output_lsb_v:
                return
            time.sleep(POLL_S)
        raise DeviceError("the device did not reach the level", where=str(self.identity()),
                          value=f"{level} V, {state}", allowed=f"{level_v:g} V", do="switch the rig off by hand")

    def _ramp(self, level_v: float, ramp_s: float) -> str:
        """Return how the device is told of a level and the time to get there."""
        return f"{dac(self.capabilities()).codes(np.array([level_v]))[0]} {math.ceil(ramp_s * 1000)}"

    def _volts(self, code: int) -> float:
        """Return the output level of ``code`` in V."""
        return float(dac(self.capabilities()).volts(np.array([code]))[0])

    def _played(self) -> int | None:
        return self._put_out

    def _output(self, patience_s: float | None = None) -> tuple[str, float | None]:
        """Return the device's state and the level read back in V, None when nothing was output."""
        said = named(self._link.ask("LEVEL?", patience_s=patience_s))
        try:
            level = said["level"]
            return said["state"], None if level == "none" else self._volts(int(level))
        except (KeyError, ValueError) as error:
            raise DeviceError("the device tells no level", where=self._link.port, value=repr(said)) from error

    def _level_v(self) -> float | None:
        return self._output()[1]

    def _close(self) -> None:
        self._link.close()


def _baud(option: str) -> int:
    """Return the N of ``baud=N``, the default for an empty option; raise UsageError otherwise."""
    name, _, value = option.partition("=")
    if not option:
        return BAUD
    if name != "baud" or not value.isdecimal() or int(value) == 0:
        raise UsageError("unknown option in a serial address", value=option, allowed="baud=N with N > 0")
    return int(value)
