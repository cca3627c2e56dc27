"""What does the firmware of a serial DAQ answer, and when does it send?

Bytes in, bytes out, time as an argument: the transport is elsewhere. The device behind it is the device model.
"""

from collections.abc import Callable

import numpy as np

from drivers.converter import Codes
from drivers.emulators.device_model import DeviceModel, Hardware, State
from drivers.framing import Frame, FrameReader, encode
from drivers.serial_messages import (
    LONGEST_RAMP_MS,
    PROTOCOL,
    SAMPLES_PER_FRAME,
    SAMPLES_PER_REPEAT,
    Condition,
    Description,
    Kind,
    Status,
    lines,
    pack_codes,
    pack_range,
    samples_per_frame,
    unpack_codes,
    unpack_range,
)

Words = list[str]
_WORDS = {"ARM": 5, "SAFE": 2}
"""How many words follow a command; the others stand alone."""


class SerialFirmware:
    """The serial protocol in front of a device model. ``beat_s`` is the time between two status frames."""

    def __init__(self, model: DeviceModel, seed: int = 0, beat_s: float = 0.01) -> None:
        """Power up; ``seed`` and the count of runs choose the noise."""
        self._model, self._seed, self._beat_s = model, seed, beat_s
        self._reader, self._out = FrameReader(), bytearray()
        self._runs, self._next_beat_s, self._heard_s = 0, 0.0, 0.0
        self._live = self._draining = self._gap = False
        self._last: tuple[int, bytes] | None = None
        self._frame, self._repeated = SAMPLES_PER_FRAME, SAMPLES_PER_REPEAT

    @property
    def live(self) -> bool:
        """Return whether there is or will be something to send without being asked."""
        return self._live or self._draining or bool(self._out)

    def receive(self, data: bytes, now_s: float) -> None:
        """Act on the bytes that arrived."""
        for frame in self._reader.feed(data):
            self._model.heard(now_s)
            self._heard_s = now_s
            try:
                self._take(frame, now_s)
            except ValueError:
                continue  # a whole frame with impossible content: as good as lost, and repeated like one

    def advance(self, now_s: float) -> None:
        """Let time pass until ``now_s``."""
        self._model.advance(now_s)

    def transmit(self, now_s: float) -> bytes:
        """Return the next few bytes there are to send, none when there are none."""
        if not self._out and self._live and now_s >= self._next_beat_s:
            self._report(now_s)
        elif not self._out and self._draining:
            self._drain()
        sent = bytes(self._out)
        self._out.clear()
        return sent

    def _take(self, frame: Frame, now_s: float) -> None:
        """Act on one frame."""
        if frame.kind == Kind.COMMAND:
            self._obey(frame, now_s)
        elif frame.kind == Kind.OUTPUT:
            codes = unpack_codes(frame.payload, self._model.hardware.capabilities.output_bits)
            self._gap = not self._model.push(frame.number, codes) or self._gap
        elif frame.kind == Kind.AGAIN:
            self._repeat(*unpack_range(frame.payload))

    def _obey(self, frame: Frame, now_s: float) -> None:
        """Do a command once, however often it arrives, and reply each time."""
        if self._last is None or self._last[0] != frame.number:
            self._last = (frame.number, self._reply(frame.payload.decode("ascii", "replace").split(), now_s))
        self._send(Kind.REPLY, *self._last)

    def _reply(self, words: Words, now_s: float) -> bytes:
        """Do the command in ``words`` and return what to answer."""
        commands: dict[str, Callable[[Words, float], str]] = {
            "ID?": self._who, "CAP?": self._can, "ARM": self._arm, "GO": self._go, "HALT": self._halt,
            "SAFE": self._safe, "LEVEL?": self._level,
        }
        self._model.advance(now_s)
        try:
            _refuse_other_than(_WORDS.get(words[0], 0), words[1:])
            answer = commands[words[0]](words[1:], now_s)
        except (KeyError, IndexError):
            return f"ERROR unknown command {' '.join(words)!r}".encode()
        except ValueError as error:
            return f"ERROR {' '.join(words)!r}: {error}".encode()
        return f"OK\n{answer}".encode()

    def _who(self, words: Words, now_s: float) -> str:
        identity = self._model.hardware.identity
        return lines({"protocol": PROTOCOL, "model": identity.model, "serial": identity.serial,
                      "firmware": identity.firmware})

    def _can(self, words: Words, now_s: float) -> str:
        return description(self._model.hardware).text()

    def _arm(self, words: Words, now_s: float) -> str:
        total, divider, safe, inputs = int(words[0]), int(words[1]), self._ramp(words[2:]), int(words[4])
        if total < 1 or divider < 1 or self._model.hardware.clock_hz is None:
            raise ValueError("samples and divider are at least 1")
        self._model.arm(total, self._model.hardware.clock_hz / divider, safe, self._seed + self._runs, inputs)
        bits = self._model.hardware.capabilities.input_bits
        self._frame, self._repeated = (samples_per_frame(inputs, bits, most)
                                       for most in (SAMPLES_PER_FRAME, SAMPLES_PER_REPEAT))
        self._runs, self._next_beat_s = self._runs + 1, now_s
        self._live, self._draining, self._gap = True, False, False
        return ""

    def _go(self, words: Words, now_s: float) -> str:
        if self._model.state is not State.ARMED:
            raise ValueError("not armed")
        self._model.go(now_s)
        return ""

    def _halt(self, words: Words, now_s: float) -> str:
        self._model.halt(now_s)
        self._live = self._draining = False
        return ""

    def _safe(self, words: Words, now_s: float) -> str:
        self._model.safe(*self._ramp(words), now_s)
        self._live = self._draining = False
        return ""

    def _level(self, words: Words, now_s: float) -> str:
        level_v = self._model.level_v(now_s)
        code = "none" if level_v is None else str(self._model.bench.dac.codes(np.array([level_v]))[0])
        return lines({"level": code, "state": self._model.state.value})

    def _ramp(self, words: Words) -> tuple[float, float]:
        """Return the level in V and the time in s that ``level ramp_ms`` mean; raise ValueError or IndexError."""
        dac, code, ramp_ms = self._model.bench.dac, int(words[0]), int(words[1])
        if abs(code) > dac.top:
            raise ValueError(f"levels are {-dac.top} to {dac.top}")
        if not 0 <= ramp_ms <= LONGEST_RAMP_MS:
            raise ValueError(f"a ramp takes 0 to {LONGEST_RAMP_MS} ms")
        return float(dac.volts(np.array([code]))[0]), ramp_ms / 1000

    def _report(self, now_s: float) -> None:
        """Send the status, to be followed by the samples read until now."""
        self._send(Kind.STATUS, 0, self._status().pack())
        self._next_beat_s = now_s + self._beat_s
        silent_s = now_s - self._heard_s
        deserted = silent_s > self._model.hardware.watchdog_s and self._model.sent == self._model.played
        self._gap, self._live, self._draining = False, not deserted, True

    def _drain(self) -> None:
        """Send the next samples read; which were lost before them is told when the host asks for them."""
        taken = self._model.take(self._frame)
        if taken is not None:
            self._send(Kind.INPUT, taken[0], self._packed(taken[1]))
        self._draining = taken is not None

    def _status(self) -> Status:
        """Return where the run is and what befell it."""
        model = self._model
        happened = {Condition.OVERRUN: model.overrun_samples > 0, Condition.UNDERRUN: model.underrun,
                    Condition.WATCHDOG: model.watchdog_tripped, Condition.GAP: self._gap}
        condition = Condition(sum(flag for flag, true in happened.items() if true))
        return Status(model.state is State.RUNNING, condition, model.accepted, model.played, model.sent)

    def _repeat(self, start: int, stop: int) -> None:
        """Send the samples [start, stop) again as far as they are kept, and say which are not."""
        at, stop = start, min(stop, self._model.sent)
        for first, codes in self._model.again(start, stop):
            self._lost(at, first)
            for offset in range(0, len(codes), self._repeated):
                self._send(Kind.RESENT, first + offset, self._packed(codes[offset:offset + self._repeated]))
            at = first + len(codes)
        self._lost(at, stop)

    def _lost(self, start: int, stop: int) -> None:
        """Say that the samples [start, stop) are lost; nothing when there are none."""
        if start < stop:
            self._send(Kind.LOST, start, pack_range(start, stop))

    def _packed(self, codes: Codes) -> bytes:
        """Return input samples as bytes."""
        return pack_codes(codes, self._model.hardware.capabilities.input_bits)

    def _send(self, kind: Kind, number: int, payload: bytes) -> None:
        """Append a frame to what is to be sent."""
        self._out += encode(Frame(kind, number, payload))


def _refuse_other_than(count: int, words: Words) -> None:
    """Raise ValueError unless there are so many words."""
    if len(words) != count:
        raise ValueError(f"{len(words)} words follow in place of {count}")


def description(hardware: Hardware) -> Description:
    """Return what a device of this hardware says it can do; raise ValueError when its clock has no divider."""
    can = hardware.capabilities
    if hardware.clock_hz is None:
        raise ValueError("a serial DAQ divides a clock of known frequency")
    return Description(
        can.output_low_v, can.output_high_v, can.input_low_v, can.input_high_v, can.output_bits, can.input_bits,
        can.min_rate_hz, can.max_rate_hz, hardware.clock_hz, hardware.output_fifo, hardware.input_fifo,
        hardware.history, hardware.watchdog_s, can.inputs, can.max_total_rate_hz or can.inputs * can.max_rate_hz,
    )
