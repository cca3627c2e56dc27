"""How does an instrument read SCPI: headers long or short, several commands in a message, errors in a queue?

Grammar of SCPI-99 volume 1 as far as the emulated instruments need it: optional leading colon, upper case is the short
form, a message unit is ended by a semicolon, a definite block ends the message. Bytes in, bytes out, time an argument.
"""

import re
from collections import deque
from collections.abc import Callable, Mapping
from typing import Protocol, final

Reply = str | bytes | None
Handler = Callable[[str, float], Reply]
BlockHandler = Callable[[bytes, float], Reply]
NO_ERROR = '0,"No error"'
ERRORS = {-102: "Syntax error", -109: "Missing parameter", -113: "Undefined header", -161: "Invalid block data",
          -221: "Settings conflict", -222: "Data out of range", -224: "Illegal parameter value", -230: "Data corrupt"}
QUEUE = 20


class RefusedError(Exception):
    """A command that cannot be done; ``number`` is its SCPI error number."""

    def __init__(self, number: int) -> None:
        """Keep the number."""
        self.number = number
        super().__init__(ERRORS[number])


class Commands(Protocol):
    """An instrument behind its grammar."""

    identity: str

    def commands(self) -> Mapping[str, Handler]:
        """Return what to do for every header, written like ``ACQuire:SRATe?``."""

    def blocks(self) -> Mapping[str, BlockHandler]:
        """Return what to do with the block behind every header that takes one."""

    def reset(self, now_s: float) -> None:
        """Put all settings to what ``*RST`` makes them."""


@final
class ScpiParser:
    """Gives messages to an instrument, and its replies, errors and identity to the host."""

    def __init__(self, instrument: Commands) -> None:
        """Know all headers of the instrument and those of IEEE 488.2."""
        self._instrument = instrument
        self._errors: deque[int] = deque(maxlen=QUEUE)
        self._event_enable = 0
        self._blocks = {_pattern(header): do for header, do in instrument.blocks().items()}
        own = {**self._mandatory(), **instrument.commands()}
        self._commands = {_pattern(header): do for header, do in own.items()}

    def execute(self, message: bytes, now_s: float) -> bytes:
        """Do all commands of a message, without its end; return the replies as one, empty where nothing was asked."""
        replies, rest = [], message
        while rest.strip():
            unit, rest = _split(rest)
            try:
                reply = self._do(unit, now_s)
            except RefusedError as error:
                self._errors.append(error.number)
                continue
            if reply is not None:
                replies.append(reply.encode("ascii") if isinstance(reply, str) else reply)
        return b";".join(replies)

    def error(self, number: int) -> None:
        """Put an error into the queue, as a transport does that was used wrongly."""
        self._errors.append(number)

    def _do(self, unit: bytes, now_s: float) -> Reply:
        """Do one command; raise RefusedError."""
        header, _, parameters = unit.lstrip().partition(b" ")
        name = header.decode("ascii", "replace").strip().lstrip(":")
        for known, take in self._blocks.items():
            if known.fullmatch(name):
                return take(_payload(parameters.lstrip()), now_s)
        for pattern, do in self._commands.items():
            if pattern.fullmatch(name):
                return _done(do, parameters.decode("ascii", "replace").strip(), now_s)
        raise RefusedError(-113)

    def _mandatory(self) -> dict[str, Handler]:
        """Return the commands every instrument has (IEEE 488.2, 10; SCPI-99, 21.8)."""
        return {
            "*IDN?": lambda text, now_s: self._instrument.identity,
            "*CLS": lambda text, now_s: self._errors.clear(),
            "*RST": lambda text, now_s: self._instrument.reset(now_s),
            "*ESE": self._enable, "*ESE?": lambda text, now_s: str(self._event_enable),
            "*OPC?": lambda text, now_s: "1",
            "SYSTem:ERRor[:NEXT]?": self._next_error,
            "SYSTem:ERRor:COUNt?": lambda text, now_s: str(len(self._errors)),
        }

    def _enable(self, text: str, now_s: float) -> None:
        """Set the event status enable register."""
        self._event_enable = whole(text, 0, 255)

    def _next_error(self, text: str, now_s: float) -> str:
        """Return the oldest error and forget it."""
        if not self._errors:
            return NO_ERROR
        number = self._errors.popleft()
        return f'{number},"{ERRORS[number]}"'


def whole(text: str, least: int, most: int) -> int:
    """Return the integer a parameter is; raise RefusedError for none, or one out of range."""
    number = real(text, least, most)
    if number != int(number):
        raise RefusedError(-224)
    return int(number)


def real(text: str, least: float, most: float) -> float:
    """Return the number a parameter is; raise RefusedError for none, or one out of range."""
    try:
        number = float(text)
    except ValueError:
        raise RefusedError(-109 if not text else -224) from None
    if not least <= number <= most:
        raise RefusedError(-222)
    return number


def word(text: str, *allowed: str) -> str:
    """Return which of ``allowed``, written like ``BURSt``, a parameter is; raise RefusedError for none."""
    for candidate in allowed:
        if _pattern(candidate).fullmatch(text):
            return candidate.upper()
    raise RefusedError(-224)


def _done(do: Handler, parameters: str, now_s: float) -> Reply:
    """Do a command; a parameter of the wrong form is told as such."""
    try:
        return do(parameters, now_s)
    except (ValueError, IndexError):
        raise RefusedError(-224) from None


def _split(message: bytes) -> tuple[bytes, bytes]:
    """Return the first command of a message and the rest; a command with a block is the last one."""
    unit, _, rest = message.partition(b";")
    return (message, b"") if b"#" in unit else (unit, rest)


def _payload(block: bytes) -> bytes:
    """Return what is in a definite block; raise RefusedError for one that is not whole (IEEE 488.2, 7.7.6)."""
    if len(block) < 2 or block[:1] != b"#" or not block[1:2].isdigit() or block[1:2] == b"0":
        raise RefusedError(-161)
    digits = int(block[1:2])
    size, rest = block[2:2 + digits], block[2 + digits:]
    if not size.isdigit() or len(rest) < int(size) or rest[int(size):].strip():
        raise RefusedError(-161)
    return rest[:int(size)]


def _pattern(header: str) -> re.Pattern[str]:
    """Return what matches a header in its long and its short form: ``ACQuire:SRATe?`` is also ``ACQ:SRAT?``."""
    nodes = re.sub(r"([A-Z*]+)([a-z]+)", lambda found: f"{found[1]}(?:{found[2]})?", header.replace("?", r"\?"))
    return re.compile(re.sub(r"\[(.*?)\]", r"(?:\1)?", nodes).replace("*", r"\*"), re.IGNORECASE)
