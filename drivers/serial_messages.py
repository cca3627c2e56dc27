"""What do a serial DAQ and its host say to each other?

Control is text in frames: a command has a number, and the reply carries the same one, so that a reply that comes late
is never taken for another's. A command with the number of the last one is not done again, its reply is repeated.
Levels are codes of the device's DAC and times whole milliseconds: an 8-bit controller has no use for decimal fractions.

=========================================  ==============================================================
command                                    reply: ``OK``, then a line ``name=value`` each; or ``ERROR text``
=========================================  ==============================================================
``ID?``                                    protocol, model, serial, firmware
``CAP?``                                   the fields of ``Description``
``ARM total divider safe ramp_ms inputs``  clears the FIFOs; the sample rate is clock_hz / divider
``GO``                                     starts the sample clock
``HALT``                                   stops it, the output holds its level
``SAFE level ramp_ms``                     stops it and ramps to the level
``LEVEL?``                                 level (or ``none``), state: idle, armed, running, ramping
=========================================  ==============================================================

Samples are numbered from the start of the run, and a frame of samples carries the number of its first. An input sample
is one code of each of the ``inputs`` that are recorded, in their order; FIFOs count such samples. From ARM to HALT
the device sends a status every few milliseconds. Output frames that do not follow are not taken; the status then has
the flag GAP, and the host sends again from ``accepted`` on. Input samples missing on the host are asked for by AGAIN.
"""

from dataclasses import dataclass, fields
from enum import IntEnum, IntFlag
from struct import Struct, error
from typing import Self

import numpy as np
from numpy.typing import NDArray

from drivers.converter import Codes
from drivers.framing import MAX_PAYLOAD
from rig.device import Capabilities
from rig.plausible import is_positive

PROTOCOL = "2"
SAMPLES_PER_FRAME = 512
"""At most, and fewer of several inputs; a frame is lost with its first wrong byte."""
SAMPLES_PER_REPEAT = 64
"""At most, in a frame sent because a longer one did not arrive."""
LONGEST_RAMP_MS = 60_000
MOST_SAMPLES = 2**32 - 1
"""Sample numbers are u32 on the wire."""
_STATUS = Struct("<BBIII")
_RANGE = Struct("<II")
_WHOLE = {1: "<i1", 2: "<i2", 4: "<i4"}


class Kind(IntEnum):
    """What a frame is. From the host: COMMAND, OUTPUT, AGAIN, ALIVE; the others from the device."""

    COMMAND = 1
    REPLY = 2
    OUTPUT = 3
    INPUT = 4
    RESENT = 5
    STATUS = 6
    LOST = 7
    AGAIN = 8
    ALIVE = 9


class Condition(IntFlag):
    """What befell a run: input FIFO full, output FIFO empty, host silent, an output frame that did not follow."""

    FINE = 0
    OVERRUN = 1
    UNDERRUN = 2
    WATCHDOG = 4
    GAP = 8


@dataclass(frozen=True)
class Status:
    """Where a run is: output samples ``accepted``, samples ``played``, input samples ``sent`` or skipped."""

    running: bool
    condition: Condition
    accepted: int
    played: int
    sent: int

    def pack(self) -> bytes:
        """Return the payload of a status frame."""
        return _STATUS.pack(self.running, self.condition, self.accepted, self.played, self.sent)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """Return the status in ``payload``; raise ValueError when it is none."""
        running, condition, accepted, played, sent = _unpack(_STATUS, payload)
        return cls(bool(running), Condition(condition), accepted, played, sent)


@dataclass(frozen=True)
class Description:
    """What the device says it can do; voltages in V, rates in Hz, FIFOs in samples.

    The rates of the inputs recorded add up to ``max_total_rate_hz`` at most: what converter and link can carry.
    """

    output_low_v: float
    output_high_v: float
    input_low_v: float
    input_high_v: float
    output_bits: int
    input_bits: int
    min_rate_hz: float
    max_rate_hz: float
    clock_hz: float
    output_fifo: int
    input_fifo: int
    history: int
    watchdog_s: float
    inputs: int
    max_total_rate_hz: float

    def __post_init__(self) -> None:
        """Refuse what no device has; raise ValueError. What the device contract has too is checked there."""
        for name in ("clock_hz", "watchdog_s"):
            if not is_positive(getattr(self, name)):
                raise ValueError(f"{name}={getattr(self, name)}; allowed: above 0")
        for name, least in (("output_fifo", 1), ("input_fifo", 1), ("history", 0)):
            if not least <= getattr(self, name) <= MOST_SAMPLES:
                raise ValueError(f"{name}={getattr(self, name)} samples; allowed: {least} to {MOST_SAMPLES}")

    def text(self) -> str:
        """Return the reply to ``CAP?``, without its OK."""
        return lines({field.name: repr(getattr(self, field.name)) for field in fields(self)})

    @classmethod
    def read(cls, text: str) -> Self:
        """Return the description in a reply; raise ValueError when a field is missing, no number or impossible."""
        said = named(text)
        if missing := [field.name for field in fields(cls) if field.name not in said]:
            raise ValueError(f"the device does not tell its {', '.join(missing)}")
        number = {"int": int, "float": float}
        return cls(**{field.name: number[str(field.type.__name__)](said[field.name]) for field in fields(cls)})  # type: ignore[union-attr]

    def capabilities(self) -> Capabilities:
        """Return the same as the device contract puts it."""
        return Capabilities(
            self.output_low_v, self.output_high_v, self.input_low_v, self.input_high_v, self.min_rate_hz,
            self.max_rate_hz, self.output_bits, self.input_bits, buffer_samples=self.output_fifo,
            max_samples=MOST_SAMPLES, inputs=self.inputs, max_total_rate_hz=self.max_total_rate_hz,
        )


def lines(values: dict[str, str]) -> str:
    """Return ``values`` as lines ``name=value``."""
    return "\n".join(f"{name}={value}" for name, value in values.items())


def named(text: str) -> dict[str, str]:
    """Return the lines ``name=value`` of ``text`` by name; other lines are left out."""
    return {name: value for name, equals, value in (line.partition("=") for line in text.splitlines()) if equals}


def pack_codes(codes: NDArray[np.integer], bits: int) -> bytes:
    """Return ``codes`` in two's complement, little endian, each in as many bytes as ``bits`` need."""
    if (kind := _WHOLE.get(width(bits))) is not None:
        return codes.astype(kind).tobytes()
    return codes.astype("<i4").view(np.uint8).reshape(-1, 4)[:, :width(bits)].tobytes()


def unpack_codes(payload: bytes, bits: int) -> Codes:
    """Return the codes in ``payload``; raise ValueError when it is not a whole number of them."""
    size = width(bits)
    if len(payload) % size:
        raise ValueError(f"{len(payload)} bytes are no whole number of {size}-byte samples")
    if (kind := _WHOLE.get(size)) is not None:
        return np.frombuffer(payload, dtype=kind).astype(np.int32)
    wide = np.zeros((len(payload) // size, 4), dtype=np.uint8)
    wide[:, 4 - size:] = np.frombuffer(payload, dtype=np.uint8).reshape(-1, size)
    return np.asarray(wide.view("<i4")[:, 0] >> 8 * (4 - size), dtype=np.int32)


def samples_per_frame(inputs: int, bits: int, most: int = SAMPLES_PER_FRAME) -> int:
    """Return how many samples of so many inputs a frame holds, ``most`` or what fits."""
    return max(1, min(most, MAX_PAYLOAD // (inputs * width(bits))))


def width(bits: int) -> int:
    """Return the bytes a code of ``bits`` (at most 32) takes."""
    return (bits + 7) // 8


def pack_range(start: int, stop: int) -> bytes:
    """Return the payload that names the samples [start, stop)."""
    return _RANGE.pack(start, stop)


def unpack_range(payload: bytes) -> tuple[int, int]:
    """Return the [start, stop) in ``payload``; raise ValueError when it is none."""
    start, stop = _unpack(_RANGE, payload)
    if start > stop:
        raise ValueError(f"samples {start} to {stop} are no range")
    return start, stop


def _unpack(form: Struct, payload: bytes) -> tuple[int, ...]:
    """Return the numbers in ``payload``; raise ValueError when it has another size."""
    try:
        return form.unpack(payload)
    except error as wrong:
        raise ValueError(f"{len(payload)} bytes where {form.size} were expected") from wrong
