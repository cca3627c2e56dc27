"""What does a terminal ask whoever wants a protocol, in which order, and what does Enter alone mean?

Questions go to stderr, so that what a command prints stays its answer. What was given as an option is not asked.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

import click

from rig.asking import KINDS
from rig.errors import RigError
from rig.newprotocol import USUAL_RIG, Wish, settled
from rig.rigfile import read_rig
from rig.session import shipped
from rig.typed import quantity_above_0
from rig.units import show

Answer = TypeVar("Answer")


def asked(given: Wish) -> Wish:
    """Return the wish with an answer to every question that was not answered before; raise click.Abort on Ctrl-C."""
    if not given.about:
        for number, (name, kind) in enumerate(KINDS.items(), start=1):
            click.echo(f"  {number}  {kind.question} ({name})", err=True)
        given = replace(given, about=_ask("What do you want to know?", "1", _about))
    if not given.rig:
        given = replace(given, rig=_ask("Rig file", USUAL_RIG, _rig))
    usual = settled(given)
    return replace(
        given, level_v=given.level_v or _quantity("Largest level", usual.level_v, "V"),
        frequency_hz=given.frequency_hz or _quantity("Frequency to begin with", usual.frequency_hz, "Hz"),
        rate_hz=given.rate_hz or _quantity("Sample rate", usual.rate_hz, "Hz"),
        title=given.title or _ask("Title", str(usual.title), str),
    )  # fmt: skip


def _quantity(prompt: str, usual: float | None, unit: str) -> float:
    """Ask for a quantity above 0 until there is one, and return it."""
    return _ask(prompt, show(usual or 0.0, unit), lambda text: quantity_above_0(prompt, text, unit))


def _ask(prompt: str, usual: str, read: Callable[[str], Answer]) -> Answer:
    """Ask until the answer can be read, and return it."""
    def value(text: str) -> Answer:
        try:
            return read(text)
        except RigError as error:
            raise click.BadParameter(str(error)) from error

    answer: Answer = click.prompt(prompt, default=usual, value_proc=value, err=True)
    return answer


def _about(text: str) -> str:
    """Return the kind of a number or a name; raise click.BadParameter."""
    names = list(KINDS)
    if text in names:
        return text
    if text.isdecimal() and 1 <= int(text) <= len(names):
        return names[int(text) - 1]
    raise click.BadParameter(f"{text!r} is none of 1 to {len(names)}, {', '.join(names)}")


def _rig(text: str) -> str:
    """Return the name of a rig file that can be read; raise FileError."""
    read_rig(shipped(text))
    return text
