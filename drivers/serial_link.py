"""How does the host talk over a serial port that may lose bytes, fall silent, be pulled and come back?"""

import itertools
import os
import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import final

import serial

from drivers.framing import Frame, FrameReader, encode
from drivers.serial_messages import Kind
from rig.errors import DeviceError
from rig.transcript import ongoing

READ_S, REPLY_S, WRITE_S, QUIET_S = 0.01, 0.5, 2.0, 0.05
TRIES = 3
GATHERED, MOST_AT_ONCE = 2048, 65_536
"""Bytes that are worth a read, and bytes read before they are looked at."""
BACK_S, AGAIN_S = 4.0, 0.05
"""How long a port that is gone is waited for, from the moment it went, and how often it is looked for."""


class RefusalError(DeviceError):
    """The device understood a command and would not do it."""


@final
class SerialLink:
    """Frames over a serial port of one's own.

    After a time-out the link is dirty: it is emptied, and the device is asked who it is, before the next command. So it
    is when the port was gone and came back: a run is over then, but the output can still be made safe.
    """

    def __init__(self, port: str, baud: int) -> None:
        """Open ``port`` and lock out others; raise DeviceError when that fails."""
        self.port, self.bytes_per_s, self._baud = port, baud / 10, baud
        self._transcript = ongoing()
        self._port = self._opened()
        self._gone_s: float | None = None
        self._greeting, self._woken = TRIES, False
        self._reader = FrameReader()
        self._inbox: deque[Frame] = deque()
        self._numbers = itertools.count(int.from_bytes(os.urandom(3), "little"))
        self._dirty = False
        self._who: str | None = None

    def introduce(self, patience_s: float) -> str:
        """Return the reply to ``ID?``, asked until ``patience_s`` are over; raise DeviceError when none comes."""
        self._greeting = max(1, round(patience_s / REPLY_S))
        self._who = self._ask("ID?", self._greeting)
        return self._who

    def ask(self, command: str, reply_s: float | None = None, patience_s: float | None = None) -> str:
        """Return the reply to ``command``, without its OK; raise DeviceError when there is none or it is a refusal.

        A command is sent again when no reply came in ``reply_s``, by default ``REPLY_S``, until ``patience_s`` are
        over, by default ``TRIES`` of these; it is done once all the same.
        """
        if self._gone_s is not None:
            self._reopen(self._gone_s + BACK_S)
        if self._dirty:
            self._clean()
        reply_s = reply_s or REPLY_S
        return self._ask(command, round((patience_s or TRIES * REPLY_S) / reply_s), reply_s)

    def send(self, *frames: Frame) -> None:
        """Send ``frames``; raise DeviceError when the port takes nothing or is gone."""
        with self._crossing():
            data = b"".join(map(encode, frames))
            self._transcript.sent(data)
            self._port.write(data)

    def receive(self, gather_s: float = 0.0) -> list[Frame]:
        """Return the frames that arrived, but for replies; wait ``READ_S`` when there are none.

        While only a little is there, more is gathered for ``gather_s``: few large reads cost less than many small ones.
        """
        if not self._inbox:
            self._gather(gather_s)
            self._read()
        frames = [frame for frame in self._inbox if frame.kind != Kind.REPLY]
        self._inbox.clear()
        return frames

    def forget(self) -> None:
        """Drop the frames not yet received."""
        self._inbox.clear()

    def close(self) -> None:
        """Release the port."""
        self._port.close()

    def _opened(self) -> serial.Serial:
        """Return the port, opened for this program alone; raise DeviceError."""
        with _told(self.port):
            return serial.Serial(self.port, self._baud, timeout=READ_S, write_timeout=WRITE_S, exclusive=True)

    @contextmanager
    def _crossing(self) -> Iterator[None]:
        """Note when the port is gone."""
        try:
            with _told(self.port):
                yield
        except DeviceError:
            self._dirty = True
            self._gone_s = time.monotonic() if self._gone_s is None else self._gone_s
            raise

    def _reopen(self, until_s: float) -> None:
        """Open the port again, which may take a while to come back; raise DeviceError when it does not."""
        self._port.close()
        while True:
            try:
                self._port = self._opened()
            except DeviceError as error:
                if time.monotonic() > until_s:
                    raise DeviceError("the link to the device is gone", where=self.port, do=error.do,
                                      value=f"not back after {BACK_S:g} s: {error.value}") from error
                time.sleep(AGAIN_S)
            else:
                self._gone_s, self._woken = None, True
                return

    def _ask(self, command: str, tries: int, reply_s: float | None = None) -> str:
        """Send ``command`` up to ``tries`` times under one number, so that it is done once; return its reply."""
        reply_s = reply_s or REPLY_S
        number = next(self._numbers) % 2**32
        for _ in range(tries):
            self.send(Frame(Kind.COMMAND, number, command.encode("ascii")))
            reply = self._reply(number, reply_s)
            if reply is not None:
                return self._accepted(command, reply)
        self._dirty = True
        raise DeviceError("no answer", where=self.port, value=f"to {command!r} in {tries * reply_s:g} s",
                          do="check that this is the device's port, and its baud rate; then replug it")

    def _reply(self, number: int, reply_s: float) -> str | None:
        """Return the text of the reply ``number``, None when it does not come in time; keep all other frames."""
        deadline = time.monotonic() + reply_s
        while time.monotonic() < deadline:
            for frame in self._read():
                if frame.kind == Kind.REPLY and frame.number == number:
                    return frame.payload.decode("ascii", "replace")
        return None

    def _accepted(self, command: str, reply: str) -> str:
        """Return what follows the OK."""
        first, _, rest = reply.partition("\n")
        if first != "OK":
            raise RefusalError("the device refused", where=self.port, value=f"{command!r}: {first}")
        return rest

    def _clean(self) -> None:
        """Empty the link and make sure that the same device is still there; raise DeviceError when it is not."""
        deadline = time.monotonic() + REPLY_S
        quiet_s = time.monotonic()
        while time.monotonic() < min(deadline, quiet_s + QUIET_S):
            if self._read():
                quiet_s = time.monotonic()
        self._reader.clear()
        self._inbox.clear()
        who = self._ask("ID?", self._greeting if self._woken else TRIES)
        if self._who is not None and who != self._who:
            raise DeviceError("another device answers", where=self.port, value=repr(who), allowed=repr(self._who))
        self._dirty = self._woken = False

    def _gather(self, gather_s: float) -> None:
        """Wait for ``gather_s`` unless much is there already."""
        with self._crossing():
            if gather_s and self._port.in_waiting < GATHERED:
                time.sleep(gather_s)

    def _read(self) -> list[Frame]:
        """Return the frames that arrived now, and put them into the inbox."""
        with self._crossing():
            data = self._port.read(max(1, self._port.in_waiting))
            if data:
                data += self._rest()
        self._transcript.received(data)
        frames = self._reader.feed(data)
        self._inbox.extend(frames)
        return frames

    def _rest(self) -> bytes:
        """Return what else is there, past pyserial: it asks the system three times for every 4 kB."""
        pieces: list[bytes] = []
        with suppress(BlockingIOError):
            while sum(map(len, pieces)) < MOST_AT_ONCE and (piece := os.read(self._port.fileno(), MOST_AT_ONCE)):
                pieces.append(piece)
        return b"".join(pieces)


@contextmanager
def _told(port: str) -> Iterator[None]:
    """Turn what goes wrong with a port into a DeviceError that says what to do."""
    try:
        yield
    except serial.SerialTimeoutException as error:
        raise DeviceError("the device takes no more data", where=port, do="replug it") from error
    except (OSError, TypeError, ValueError) as error:
        raise DeviceError(_problem(error), where=port, value=str(error), do=_advice(port)) from error


def _problem(error: Exception) -> str:
    """Return what is wrong with the port."""
    return "the port cannot be opened" if "could not" in str(error) else "the link to the device is gone"


def _advice(port: str) -> str:
    """Return what to do about a port that fails."""
    if not os.path.exists(port):
        return "plug the device in, or see `rig devices` for the ports there are"
    if not os.access(port, os.R_OK | os.W_OK):
        return "you may not use this port: join the group that owns it (on most systems `dialout`)"
    return "close the program that holds the port, or replug the device"
