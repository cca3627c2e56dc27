"""What can be made to go wrong on an emulated link, written down as data?

A script is a tuple of ``Fault``. It belongs to no transport: a transport tells ``Mischief`` every message it is about
to deliver, under the name the message has in its protocol, and delivers the pieces that come back, each in its time;
and it asks what is ``happening`` to the device. Times are those of the host.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import Enum
from typing import final

import numpy as np


class What(Enum):
    """What happens to a message, or to the whole device at the moment of that message."""

    LOST = "it never arrives"
    LATE = "it arrives `seconds` late, and so does all behind it"
    TWICE = "it arrives twice"
    SPLIT = "it arrives in pieces of `size` bytes, `seconds` apart"
    SHORT = "its last `size` bytes never arrive"
    FLIPPED = "one bit of its byte number `size` is wrong"
    PRECEDED = "the bytes `new` arrive before it"
    REPLACED = "`new` stands where `old` should, or in place of all of it"
    MUTE = "the device says nothing for `seconds`, and goes on"
    HUNG = "the device neither hears nor speaks nor plays any more, its output stays on"
    TORN = "the link is torn, for `seconds`; the device goes on"
    UNPLUGGED = "the device loses link and power, for `seconds`"
    RESTARTED = "the device starts anew, its link stays"


OF_THE_DEVICE = frozenset({What.MUTE, What.HUNG, What.TORN, What.UNPLUGGED, What.RESTARTED})
"""These need no message: with a sample and no message named they happen at that sample."""


@dataclass(frozen=True)
class Fault:
    """One thing that goes wrong, to the messages whose name begins with ``to``: ``times`` of them after ``skip``.

    A reply is named like the command it answers, a frame like its kind. ``heard``: on the way to the device, else from
    it. ``at_sample``: not before the run has played more than so many samples.
    """

    what: What
    to: str = ""
    heard: bool = False
    skip: int = 0
    times: float = 1
    at_sample: int | None = None
    seconds: float = math.inf
    size: int = 1
    old: bytes = b""
    new: bytes = b""

    def __post_init__(self) -> None:
        """Refuse what cannot happen; raise ValueError."""
        if self.what in (What.LATE, What.SPLIT) and not math.isfinite(self.seconds):
            raise ValueError(f"{self.what.name} takes a finite time in `seconds`")

    @property
    def timed(self) -> bool:
        """Return whether it happens at a sample, whatever is said then."""
        return self.what in OF_THE_DEVICE and self.at_sample is not None and not self.to


@dataclass(frozen=True)
class Faults:
    """What goes wrong, nothing by default: a script, and a noisy line.

    ``drop`` and ``corrupt`` are probabilities per byte, on both directions, of all but the first ``spare`` bytes.
    ``delay_s`` holds back all the device says.
    """

    script: tuple[Fault, ...] = ()
    drop: float = 0.0
    corrupt: float = 0.0
    spare: int = 0
    delay_s: float = 0.0
    seed: int = 0


NO_FAULTS = Faults()


@dataclass(frozen=True)
class Piece:
    """Bytes that arrive ``after_s`` later than the piece before them may."""

    data: bytes
    after_s: float = 0.0


Encode = Callable[[bytes], bytes]
"""Turns the payload of a message into what its transport carries."""


@final
class Mischief:
    """Carries a script out.

    ``struck`` counts how often each of its faults happened, ``names`` how often each message was said.
    """

    def __init__(self, script: Iterable[Fault]) -> None:
        """Start with nothing gone wrong yet."""
        self.script = tuple(script)
        self.struck = [0] * len(self.script)
        self._seen = [0] * len(self.script)
        self._happening: list[Fault] = []
        self._played = 0
        self.names: dict[str, int] = {}

    @property
    def of_messages(self) -> bool:
        """Return whether any fault needs to be told the messages."""
        return not all(fault.timed for fault in self.script)

    def said(self, name: str, payload: bytes, encode: Encode) -> list[Piece]:
        """Return what arrives on the host of a message with this ``payload``, ``encode``d for its transport."""
        self.names[name] = self.names.get(name, 0) + 1
        return self._delivered(name, payload, encode, heard=False)

    def heard(self, name: str, payload: bytes, encode: Encode) -> list[Piece]:
        """Return what arrives on the device of a message of the host."""
        return self._delivered(name, payload, encode, heard=True)

    def happening(self, played: int) -> list[Fault]:
        """Return what happens to the device now, each once; ``played`` counts the samples of the run."""
        self._played = played
        for index, fault in enumerate(self.script):
            if fault.timed and self._begun(fault) and not self.struck[index]:
                self.struck[index] += 1
                self._happening.append(fault)
        now, self._happening = self._happening, []
        return now

    def _delivered(self, name: str, payload: bytes, encode: Encode, heard: bool) -> list[Piece]:
        """Return the pieces of a message after every fault that meets it, in the order of the script."""
        met = [fault for index, fault in enumerate(self.script) if self._meets(index, fault, name, heard)]
        for fault in met:
            if fault.what is What.REPLACED:
                payload = payload.replace(fault.old, fault.new) if fault.old else fault.new
        pieces = [Piece(encode(payload))]
        for fault in met:
            if fault.what in OF_THE_DEVICE:
                self._happening.append(fault)
            pieces = _MADE_OF[fault.what](fault, pieces) if fault.what in _MADE_OF else pieces
        return pieces

    def _meets(self, index: int, fault: Fault, name: str, heard: bool) -> bool:
        """Return whether the fault strikes this message, and count it."""
        named = fault.heard == heard and name.startswith(fault.to)
        if fault.timed or not named or not self._begun(fault):
            return False
        self._seen[index] += 1
        if not fault.skip < self._seen[index] <= fault.skip + fault.times:
            return False
        self.struck[index] += 1
        return True

    def _begun(self, fault: Fault) -> bool:
        """Return whether the run has come to where the fault may strike."""
        return fault.at_sample is None or self._played > fault.at_sample


def _lost(fault: Fault, pieces: list[Piece]) -> list[Piece]:
    return []


def _late(fault: Fault, pieces: list[Piece]) -> list[Piece]:
    return [Piece(b"", fault.seconds), *pieces]


def _twice(fault: Fault, pieces: list[Piece]) -> list[Piece]:
    return [*pieces, *pieces]


def _split(fault: Fault, pieces: list[Piece]) -> list[Piece]:
    data = _joined(pieces)
    return [Piece(data[at:at + fault.size], fault.seconds if at else 0.0) for at in range(0, len(data), fault.size)]


def _short(fault: Fault, pieces: list[Piece]) -> list[Piece]:
    data = _joined(pieces)
    return [Piece(data[:max(0, len(data) - fault.size)])]


def _flipped(fault: Fault, pieces: list[Piece]) -> list[Piece]:
    data = bytearray(_joined(pieces))
    data[fault.size % len(data)] ^= 0x10
    return [Piece(bytes(data))]


def _preceded(fault: Fault, pieces: list[Piece]) -> list[Piece]:
    return [Piece(fault.new), *pieces]


def _torn(fault: Fault, pieces: list[Piece]) -> list[Piece]:
    data = _joined(pieces)
    return [Piece(data[:len(data) // 2])]


_MADE_OF: dict[What, Callable[[Fault, list[Piece]], list[Piece]]] = {
    What.LOST: _lost, What.LATE: _late, What.TWICE: _twice, What.SPLIT: _split, What.SHORT: _short,
    What.FLIPPED: _flipped, What.PRECEDED: _preceded, What.TORN: _torn, What.UNPLUGGED: _torn,
}


def _joined(pieces: list[Piece]) -> bytes:
    """Return the bytes of all pieces."""
    return b"".join(piece.data for piece in pieces)


class NoisyLine:
    """One direction of a link: what goes in comes out with the faults of the link."""

    def __init__(self, faults: Faults, direction: int) -> None:
        """Start with a fresh line; equal seeds and directions give equal faults."""
        self._faults = faults
        self._random = np.random.default_rng((faults.seed, direction))
        self._spared = faults.spare

    def carry(self, data: bytes) -> bytes:
        """Return what arrives of ``data``."""
        spared, data = data[:self._spared], data[self._spared:]
        self._spared -= len(spared)
        if not data or not (self._faults.drop or self._faults.corrupt):
            return spared + data
        values = np.frombuffer(data, dtype=np.uint8).copy()
        hit = self._random.random(values.size) < self._faults.corrupt
        values[hit] ^= self._random.integers(1, 256, int(hit.sum()), dtype=np.uint8)
        return spared + values[self._random.random(values.size) >= self._faults.drop].tobytes()
