"""What may happen to the bytes and the lines of a file: bits that flip, ends that are cut, pieces that are exchanged?

Every kind of damage is a function of the file and of a source of chance, so that hypothesis can be that source.
"""

from collections.abc import Callable
from random import Random

Damage = Callable[[bytes, Random], bytes]
STRANGE = (b"\xff" * 8, b"\0" * 8, b"\x7f" + b"\xff" * 7, b"\x80" + b"\0" * 7, b"\xff\xff\xff\x7f", b"\x00\x00\x00\x80")
TOKENS = (
    "nan", ".nan", ".inf", "1e400", "-1e400", "1e308", "5e-324", "-1", "0", "-0", "9" * 400, "1" + "0" * 30, "0x10",
    "1_000", "010", "12:30", "2026-11-22", "~", "null", "true", "no", "''", "'", '"', "{", "}", "[", "]", "[]", "{}",
    ":", "- ", "#", "&a", "*a", "<<: *a", "!!float", "!!python/object/apply:os.system ['true']", "!!binary aGk=",
    "%", "@", "`", "\t", "\0", "\x1b[31m", "\ufeff", "\u202e", "\u2028", "\u0085", "\ud7ff", "\U0001d7d9", "V",
    "1 V", "1 furlong", "3 degC", "1 V^99", "1/1/1 V", "50 Hz", "1e308 V", "1e-320 s", "100000", "x" * 5000,
    "../outside", "/etc/hostname", "loopback:../outside", "os:Path", "|", ">", "? ", "---", "...", "\r", "\n",
)  # fmt: skip


def flipped(held: bytes, chance: Random) -> bytes:
    """Return the file with up to eight bits turned over."""
    changed = bytearray(held)
    for _ in range(chance.randint(1, 8)):
        changed[chance.randrange(len(changed))] ^= 1 << chance.randrange(8)
    return bytes(changed)


def cut(held: bytes, chance: Random) -> bytes:
    """Return the first bytes of the file."""
    return held[:chance.randrange(len(held))]


def left_out(held: bytes, chance: Random) -> bytes:
    """Return the file without a piece of it."""
    start = chance.randrange(len(held))
    return held[:start] + held[start + chance.randint(1, 64):]


def doubled(held: bytes, chance: Random) -> bytes:
    """Return the file with a piece of it twice."""
    start = chance.randrange(len(held))
    return held[:start] + held[start:start + chance.randint(1, 4096)] + held[start:]


def blanked(held: bytes, chance: Random) -> bytes:
    """Return the file with zeros where a piece was."""
    start, size = chance.randrange(len(held)), chance.randint(1, 512)
    return held[:start] + bytes(len(held[start:start + size])) + held[start + size:]


def exchanged(held: bytes, chance: Random) -> bytes:
    """Return the file with two pieces in each other's place."""
    size = chance.randint(1, max(1, len(held) // 4))
    first, second = sorted(chance.randrange(len(held)) for _ in range(2))
    second = max(second, first + size)
    return (held[:first] + held[second:second + size] + held[first + size:second] + held[first:first + size]
            + held[second + size:])


def strange(held: bytes, chance: Random) -> bytes:
    """Return the file with numbers at the ends of their range in up to four places."""
    changed = bytearray(held)
    for _ in range(chance.randint(1, 4)):
        number = chance.choice(STRANGE)
        start = chance.randrange(len(changed))
        changed[start:start + len(number)] = number[:len(changed) - start]
    return bytes(changed)


def lengthened(held: bytes, chance: Random) -> bytes:
    """Return the file with noise behind it."""
    return held + chance.randbytes(chance.randint(1, 4096))


def other_token(held: bytes, chance: Random) -> bytes:
    """Return the text with a strange word in the place of one."""
    words = held.decode().split(" ")
    words[chance.randrange(len(words))] = chance.choice(TOKENS)
    return " ".join(words).encode("utf-8", "surrogatepass")


def other_value(held: bytes, chance: Random) -> bytes:
    """Return the text with something strange behind a colon or a comma."""
    text = held.decode()
    places = [at + 1 for at, char in enumerate(text) if char in ":,["]
    start = chance.choice(places) if places else 0
    end = next((at for at in range(start, len(text)) if text[at] in ",]}\n"), len(text))
    return f"{text[:start]} {chance.choice(TOKENS)}{text[end:]}".encode("utf-8", "surrogatepass")


def other_lines(held: bytes, chance: Random) -> bytes:
    """Return the text with a line gone, twice, elsewhere, or further in."""
    lines = held.decode().splitlines(keepends=True)
    at = chance.randrange(len(lines))
    line = lines.pop(at) if chance.random() < 0.6 else lines[at]
    if chance.random() < 0.7:
        lines.insert(chance.randrange(len(lines) + 1), " " * chance.choice((0, 0, 1, 2, 4)) + line)
    return "".join(lines).encode()


OF_BYTES: tuple[Damage, ...] = (flipped, cut, left_out, doubled, blanked, exchanged, strange, lengthened)
OF_TEXT: tuple[Damage, ...] = (other_token, other_value, other_lines, other_token, other_value, flipped, cut, left_out)
