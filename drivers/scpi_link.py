"""How is a SCPI instrument asked so that no reply is ever taken for another's?

After anything that did not go as it should the link is *dirty*. Before the next command it is fenced: the device is
made to say a number that it cannot have said before, everything before that number is dropped, and then it must be the
same device. Only then is it spoken to again. A TCP peer or a USB device that was lost is opened anew for that.
"""

import itertools
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import final

from drivers.visa_wire import wire
from rig.errors import DeviceError

REPLY_S, CLEAN_S, FENCE_S, RETRY_S = 1.0, 4.0, 2.0, 0.1
BYTES_PER_S = 1e6
"""What a link carries at least; long messages have so much more time."""
FIRST_NUMBER, NUMBERS = 100, 156
"""Of the fence: the numbers 100 to 255 fit the event status enable register (IEEE 488.2, 11.5.1.3)."""
ERRORS_AT_ONCE, QUOTED = 20, 120
"""How many errors are asked for, and how much of what was said or asked stands in a message to the operator."""
IDENTITY_COMMAS = 3
"""Of a reply to ``*IDN?``: maker, model, serial number, firmware (IEEE 488.2, 10.14.3)."""


@final
class ScpiLink:
    """Commands, queries and binary blocks over one pyvisa resource."""

    def __init__(self, resource_name: str, end: str = "\n") -> None:
        """Open the resource; ``end`` ends every message to the device. Raises DeviceError or UsageError."""
        self.name, self._end = resource_name, end.encode("ascii")
        self._wire = wire(resource_name)
        self._numbers = itertools.count(int.from_bytes(os.urandom(2), "little"))
        self._who: str | None = None
        self._answers = ""
        self._dirty, self._lost = True, False
        self._broken_s: float | None = None

    def introduce(self) -> str:
        """Return the reply to ``*IDN?`` of a link that is clean; raise DeviceError when none comes."""
        self._clean()
        return self._answers

    def ask(self, query: str, timeout_s: float = REPLY_S) -> str:
        """Return the one line that answers ``query``; raise DeviceError when none comes in time."""
        with self._whole():
            self._send(query.encode("ascii"), timeout_s)
            return self._line(timeout_s)

    def ask_number(self, query: str, timeout_s: float = REPLY_S) -> float:
        """Return the number that answers ``query``; raise DeviceError for anything else."""
        said = self.ask(query, timeout_s)
        try:
            return float(said)
        except ValueError as error:
            raise DeviceError(f"no number answers {query!r}", where=self.name, value=repr(said[:QUOTED])) from error

    def ask_block(self, query: str, most_bytes: int, timeout_s: float = REPLY_S) -> bytes:
        """Return the binary block that answers ``query``; raise DeviceError for one that is not as it says.

        A block that says it is longer than ``most_bytes`` is refused before any room is made for it.
        """
        with self._whole():
            self._send(query.encode("ascii"), timeout_s)
            size = self._block_size(query, most_bytes, timeout_s)
            patience_s = timeout_s + size / BYTES_PER_S
            data = self._wire.exactly(size, patience_s)
            if not self._wire.end_of_message(timeout_s):
                raise self._nonsense(query, f"more than the {size} bytes its block says", "a block, then its end")
            return data

    def tell(self, *commands: str, timeout_s: float = REPLY_S) -> None:
        """Send ``commands``; raise DeviceError when the device reports an error."""
        with self._whole():
            for command in commands:
                self._send(command.encode("ascii"), timeout_s)
            self._refuse_errors(", ".join(command[:60] for command in commands), timeout_s)

    def tell_block(self, command: str, payload: bytes, timeout_s: float = REPLY_S) -> None:
        """Send ``command`` with a block of ``payload`` behind it (``#8`` and eight digits); raise DeviceError."""
        with self._whole():
            patience_s = timeout_s + len(payload) / BYTES_PER_S
            message = f"{command} #8{len(payload):08d}".encode("ascii") + payload
            self._wire.send(message if self._wire.marks_ends else message + self._end, patience_s)
            self._refuse_errors(command, patience_s)

    def shout(self, *commands: str) -> None:
        """Send ``commands`` whatever state the link is in, and wait for nothing: the last resort of safety.

        A device that answers no more, or answers nonsense, may still hear. Nothing is said to another device.
        """
        self._dirty = True
        if self._answers != self._who:
            return
        with suppress(DeviceError):
            for command in commands:
                self._send(command.encode("ascii"), REPLY_S)

    def close(self) -> None:
        """Release the resource."""
        self._wire.close()

    @contextmanager
    def _whole(self) -> Iterator[None]:
        """Begin on a clean link; whatever is not carried through leaves it dirty, an interrupt as well."""
        if not self._dirty and self._wire.waiting():
            self._dirty = True
        if self._dirty:
            self._clean()
        self._dirty = True
        yield
        self._dirty = False

    def _clean(self) -> None:
        """Make sure that the next reply is that to the next query, of the same device; raise DeviceError.

        A link is mended for ``CLEAN_S`` from the first attempt on; later ones are made once.
        """
        self._broken_s = time.monotonic() if self._broken_s is None else self._broken_s
        while (failure := self._mended()) is not None:
            if time.monotonic() > self._broken_s + CLEAN_S:
                raise failure
            time.sleep(RETRY_S)
        self._broken_s = None
        self._refuse_stranger()
        self._dirty = False

    def _mended(self) -> DeviceError | None:
        """Fence the link, opened anew where it was lost; return what kept it from being clean, None when it is."""
        try:
            if self._lost:
                self._wire.reopen()
            self._lost = False
            self._fence()
        except DeviceError as error:
            self._lost = True
            return error
        return None

    def _fence(self) -> None:
        """Have the device say the number of a new fence and then who it is; raise DeviceError."""
        self._wire.forget()
        number = FIRST_NUMBER + next(self._numbers) % NUMBERS
        self._send(f"*CLS;*ESE {number};*ESE?".encode("ascii"), FENCE_S)
        deadline = time.monotonic() + FENCE_S
        while self._line(FENCE_S).strip("+ ") != str(number):
            if time.monotonic() > deadline:
                raise DeviceError("the device gives no clean answer", where=self.name, do="switch it off and on")
        self._send(b"*IDN?", FENCE_S)
        self._answers = self._line(FENCE_S)
        if self._answers.count(",") < IDENTITY_COMMAS:
            raise DeviceError("the device tells no identity", where=self.name, value=repr(self._answers[:QUOTED]),
                              allowed="maker, model, serial number, firmware", do="check that the address is right")

    def _refuse_stranger(self) -> None:
        """Raise DeviceError when it is not the device that answered first."""
        if self._who is not None and self._answers != self._who:
            raise DeviceError("another device answers", where=self.name, value=repr(self._answers),
                              allowed=repr(self._who), do="plug the first one in again")
        self._who = self._answers

    def _send(self, message: bytes, timeout_s: float) -> None:
        self._wire.send(message + self._end, timeout_s)

    def _line(self, timeout_s: float) -> str:
        return self._wire.line(timeout_s).decode("ascii", "replace")

    def _block_size(self, query: str, most_bytes: int, timeout_s: float) -> int:
        """Return how many bytes the block that comes says it has (IEEE 488.2, 8.7.9)."""
        start = self._wire.exactly(2, timeout_s)
        if start[:1] != b"#" or start[1:] not in b"123456789":
            raise self._nonsense(query, repr(start), "a block, which begins with # and a digit")
        digits = self._wire.exactly(int(start[1:]), timeout_s)
        if not digits.isdigit():
            raise self._nonsense(query, repr(start + digits), "the size of a block")
        if int(digits) > most_bytes:
            raise self._nonsense(query, f"a block of {int(digits)} bytes", f"at most {most_bytes}")
        return int(digits)

    def _refuse_errors(self, what: str, timeout_s: float) -> None:
        """Raise DeviceError with the errors in the device's queue, when there are any (SCPI-99, 21.8)."""
        errors = []
        for _ in range(ERRORS_AT_ONCE):
            self._send(b"SYST:ERR?", timeout_s)
            error = self._line(timeout_s)
            if _is_none(error):
                break
            errors.append(error)
        if errors:
            told = "; ".join(dict.fromkeys(errors))
            raise DeviceError("the device refused", where=self.name, value=f"{what[:QUOTED]}: {told[:QUOTED]}")

    def _nonsense(self, query: str, value: str, allowed: str) -> DeviceError:
        return DeviceError(f"a wrong answer to {query!r}", where=self.name, value=value, allowed=allowed,
                           do="start again; the device's firmware may be at fault")


def _is_none(error: str) -> bool:
    """Return whether a reply to ``SYST:ERR?`` says that there is no error."""
    return error.partition(",")[0].strip().lstrip("+-") in ("0", "00")
