"""How do scripted faults and a noisy line get between a serial DAQ and its host?

Frames are told apart here only while a script wants to know them: a reply under the text of its command, every other
frame under its kind.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import final

from drivers.emulators.faults import Encode, Fault, Faults, Mischief, NoisyLine, Piece
from drivers.emulators.way import Way
from drivers.framing import Frame, FrameReader, encode
from drivers.serial_messages import Kind

_KINDS = {kind.value: kind.name for kind in Kind}


@final
class FaultyWire:
    """Both directions of a serial link, with all that goes wrong on it."""

    def __init__(self, faults: Faults) -> None:
        """Start with a link on which nothing was said."""
        self._delay_s = faults.delay_s
        self.mischief = Mischief(faults.script)
        self._lines = NoisyLine(faults, 0), NoisyLine(faults, 1)
        self._readers = FrameReader(), FrameReader()
        self._ways = Way(), Way()
        self._asked: dict[int, str] = {}

    @property
    def busy(self) -> bool:
        """Return whether anything is still under way to the host."""
        return bool(self._ways[1])

    def happening(self, played: int) -> list[Fault]:
        """Return what happens to the device now."""
        return self.mischief.happening(played)

    def to_device(self, data: bytes, now_s: float) -> bytes:
        """Take what the host sent and return what reaches the device now."""
        return self._carried(0, data, now_s, self.mischief.heard)

    def to_host(self, data: bytes, now_s: float) -> bytes:
        """Take what the device sent and return what reaches the host now."""
        return self._carried(1, data, now_s, self.mischief.said)

    def _carried(
        self, way: int, data: bytes, now_s: float, struck: Callable[[str, bytes, Encode], list[Piece]],
    ) -> bytes:
        """Take what goes one way and return what arrives there now."""
        delay_s = self._delay_s if way else 0.0
        if not self.mischief.of_messages:
            if data:
                self._ways[way].put([Piece(data)], now_s, delay_s)
        else:
            for frame in self._readers[way].feed(data):
                pieces = struck(self._name(frame), frame.payload, partial(_encoded, frame))
                self._ways[way].put(pieces, now_s, delay_s)
        return self._lines[way].carry(b"".join(self._ways[way].due(now_s)))

    def _name(self, frame: Frame) -> str:
        """Return what a script calls this frame."""
        if frame.kind == Kind.COMMAND:
            self._asked[frame.number] = frame.payload.decode("ascii", "replace")
        of_a_command = frame.kind in (Kind.COMMAND, Kind.REPLY)
        return self._asked.get(frame.number, "REPLY") if of_a_command else _KINDS.get(frame.kind, "?")


def _encoded(frame: Frame, payload: bytes) -> bytes:
    """Return the frame with another payload, on the wire."""
    return encode(replace(frame, payload=payload))
