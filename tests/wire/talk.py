"""How does a test speak to a serial DAQ frame by frame, with nothing in between that mends what goes wrong?"""

import functools
import itertools
import operator
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Self

import serial

from drivers.converter import Codes
from drivers.framing import Frame, FrameReader, encode
from drivers.serial_messages import Condition, Kind, Status, named, pack_codes, pack_range, unpack_codes

PATIENCE_S = 30.0  # other tests may have the processors meanwhile
AGAIN_S = 0.5


class Talk:
    """One conversation: what is said goes out as it is, what comes back is kept in its order."""

    def __init__(self, port: serial.Serial, bits: tuple[int, int] = (12, 10)) -> None:
        self._port, self._reader, self._numbers = port, FrameReader(), itertools.count(1000)
        self._output_bits, self._input_bits = bits
        self.heard: list[Frame] = []
        self._halted = set[int]()  # commands to halt that were answered

    @classmethod
    @contextmanager
    def at(cls, path: str) -> Iterator[Self]:
        """Speak to the device at ``path``; leave it halted."""
        with serial.Serial(path, 500_000, timeout=0.005, exclusive=True) as port:
            talk = cls(port)
            talk.halt()
            talk.heard.clear()
            yield talk
            talk.halt()

    def halt(self) -> None:
        """Halt the device; as a host would, say it again until it is answered: a board that starts hears nothing.

        One that was only slow answers every time: what comes later is nothing that a test has asked for.
        """
        number = next(self._numbers)
        for _ in range(round(PATIENCE_S / AGAIN_S)):
            self.say(Frame(Kind.COMMAND, number, b"HALT"))
            if self.until(lambda: any((f.kind, f.number) == (Kind.REPLY, number) for f in self.heard), AGAIN_S):
                self._halted.add(number)
                return
        raise AssertionError("no reply to 'HALT'")

    def say(self, data: bytes | Frame) -> None:
        """Send bytes or a frame."""
        self._port.write(encode(data) if isinstance(data, Frame) else data)

    def listen(self) -> None:
        """Take in what arrived, waiting a few ms when there is nothing."""
        frames = self._reader.feed(self._port.read(max(1, self._port.in_waiting)))
        self.heard += [f for f in frames if f.kind != Kind.REPLY or f.number not in self._halted]

    def until(self, true: Callable[[], bool], patience_s: float = PATIENCE_S) -> bool:
        """Listen until ``true``; return whether that came in time."""
        deadline = time.monotonic() + patience_s
        while not true() and time.monotonic() < deadline:
            self.listen()
        return true()

    def ask(self, command: str, number: int | None = None, patience_s: float = PATIENCE_S) -> str:
        """Return the reply to a command; a new number makes it a new command."""
        number = next(self._numbers) if number is None else number
        before = len(self.heard)
        self.say(Frame(Kind.COMMAND, number, command.encode()))

        def replies() -> list[Frame]:
            return [frame for frame in self.heard[before:] if frame.kind == Kind.REPLY]

        assert self.until(lambda: bool(replies()), patience_s), f"no reply to {command!r}"
        assert replies()[0].number == number
        return replies()[0].payload.decode()

    def level(self) -> tuple[int | None, str]:
        """Return the level as a code, None before anything was output, and the state."""
        said = named(self.ask("LEVEL?"))
        return None if said["level"] == "none" else int(said["level"]), said["state"]

    def settles(self) -> int | None:
        """Return the level when a ramp is over."""
        deadline = time.monotonic() + PATIENCE_S
        while self.level()[1] == "ramping":
            assert time.monotonic() < deadline, "the ramp does not end"
        return self.level()[0]

    def arm(self, total: int, rate_hz: float = 1000.0, safe: str = "100 50") -> None:
        """Arm a run, and forget what was heard before it."""
        assert self.ask(f"ARM {total} {round(2e6 / rate_hz)} {safe} 1") == "OK\n"
        self.heard.clear()

    def put(self, codes: Codes, start: int = 0, most: int = 48) -> None:
        """Send output samples numbered from ``start`` in frames of at most ``most``."""
        for at in range(0, codes.size, most):
            self.say(Frame(Kind.OUTPUT, start + at, pack_codes(codes[at:at + most], self._output_bits)))

    def again(self, start: int, stop: int) -> None:
        """Ask for input samples again."""
        self.say(Frame(Kind.AGAIN, start, pack_range(start, stop)))

    def alive(self) -> None:
        """Tell the device that somebody is there."""
        self.say(Frame(Kind.ALIVE, 0))

    @property
    def statuses(self) -> list[Status]:
        """Return every status heard."""
        return [Status.unpack(frame.payload) for frame in self.heard if frame.kind == Kind.STATUS]

    @property
    def conditions(self) -> Condition:
        """Return all that befell the run, as far as it was told."""
        return functools.reduce(operator.or_, (status.condition for status in self.statuses), Condition.FINE)

    @property
    def accepted(self) -> int:
        """Return how many output samples the device took, as far as it told."""
        return max((status.accepted for status in self.statuses), default=0)

    def samples(self, kind: Kind = Kind.INPUT) -> dict[int, int]:
        """Return the input samples heard, by number."""
        return {
            frame.number + at: int(code)
            for frame in self.heard if frame.kind == kind
            for at, code in enumerate(unpack_codes(frame.payload, self._input_bits))
        }
