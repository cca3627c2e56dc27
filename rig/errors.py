"""What can go wrong, who is told, and with which exit code: the error tree of the whole application."""

from collections.abc import Sequence

LONGEST = 80
"""Characters of a word from a file that a message repeats."""


class RigError(Exception):
    """One thing that went wrong, told in one message: what, where, the value, what is allowed, what to do."""

    exit_code = 1

    def __init__(
        self, what: str, *, where: str | None = None, value: str | None = None, allowed: str | None = None,
        do: str | None = None,
    ) -> None:
        """Keep the parts; every one is text for the operator, and quantities in it carry their units."""
        self.what = what
        self.where = where
        self.value = value
        self.allowed = allowed
        self.do = do
        super().__init__(sentence(what, where=where, value=value, allowed=allowed, do=do))


class RefusedError(RigError):
    """The answer is negative: a check refused, a verification failed. Exit code 1."""

    exit_code = 1


class UsageError(RigError):
    """The command or its options make no sense. Exit code 2."""

    exit_code = 2


class FileError(RigError):
    """An input file is missing, damaged, or says something it must not. Exit code 2."""

    exit_code = 2


class DeviceError(RigError):
    """The device failed or answered nonsense; the output was left safe. Exit code 3."""

    exit_code = 3


class StarvedError(DeviceError):
    """The device had nothing left to put out, or heard nothing, and stopped by itself at its safe level."""


class IncompleteError(RigError):
    """The run ended early; what was recorded is kept. Exit code 4."""

    exit_code = 4


def sentence(
    what: str, *, where: str | None = None, value: str | None = None, allowed: str | None = None, do: str | None = None,
) -> str:
    """Return ``where: what: value; allowed: ...; do``, leaving out the parts that are None.

    What a device said may stand in it: control characters are written out.
    """
    head = ": ".join(part for part in (where, what, value) if part)
    tail = [f"allowed: {allowed}"] if allowed else []
    return visible("; ".join([head, *tail, *([do] if do else [])]))


def visible(text: str) -> str:
    """Return ``text`` with control characters but line feeds written out, as no terminal or file takes them well."""
    return "".join(char if char.isprintable() or char == "\n" else repr(char)[1:-1] for char in text)


def cut_short(text: str) -> str:
    """Return ``text`` as far as a message needs it."""
    return text if len(text) <= LONGEST else f"{text[:LONGEST - 3]}..."


def nearest(word: str, valid: Sequence[str]) -> str | None:
    """Return the entry of ``valid`` that looks most like ``word``, or None when none does."""
    import difflib

    if len(word) > LONGEST:
        return None
    lowered = {entry.lower(): entry for entry in valid}
    found = difflib.get_close_matches(word.lower(), list(lowered), n=1, cutoff=0.5)
    return lowered[found[0]] if found else None


def unknown(kind: str, word: str, valid: Sequence[str]) -> dict[str, str]:
    """Return the ``what``, ``allowed`` and ``do`` of an unknown name, the nearest valid one proposed."""
    close = nearest(word, valid)
    parts = {"what": f"unknown {kind} {cut_short(repr(word))}", "allowed": ", ".join(sorted(valid))}
    return {**parts, "do": f"did you mean {close!r}?"} if close else parts


class MisfitError(ValueError):
    """A value does not fit; whoever knows the file and the line turns this into a FileError with ``placed``."""

    def __init__(
        self, what: str, *, value: str | None = None, allowed: str | None = None, do: str | None = None,
    ) -> None:
        """Keep the parts of the message that do not depend on the place."""
        self.what = what
        self.value = value
        self.allowed = allowed
        self.do = do
        super().__init__(sentence(what, value=value, allowed=allowed, do=do))

    def placed(self, where: str) -> FileError:
        """Return the same message with its place, as the error a command reports."""
        return FileError(self.what, where=where, value=self.value, allowed=self.allowed, do=self.do)
