"""How does every command look to whoever types it: its options, its examples, its quantities, its lines of words?

Only click is imported here, so that ``rig --help`` answers at once.
"""

from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from identify.explain.explanation import Explanation
    from identify.identification import Identification
    from identify.page.document import Page
    from rig.tabular import Line

Command = Callable[..., None]
SETTINGS: dict[str, Any] = {"help_option_names": ["-h", "--help"], "max_content_width": 110}

device_option = click.option(
    "--device", metavar="ADDRESS", help="Such as loopback: or serial:/dev/ttyACM0; else the protocol's own."
)
rig_option = click.option("--rig", metavar="RIG.yaml", help="The plain model; else the rig kept in the recordings.")
played_rig_option = click.option("--rig", metavar="RIG.yaml", help="The rig; else the one the protocol names.")
calibration_option = click.option(
    "--calibration", metavar="F.json", help="Of the device, by rig calibrate; else the one kept in the recordings."
)
json_option = click.option("--json", "json_to", metavar="F", help="Write the answer as JSON; - for stdout.")
report_option = click.option("--report", metavar="F.html", help="Write one page with pictures.")
pdf_option = click.option("--pdf", metavar="F.pdf", help="Write the same page for paper.")
overwrite_option = click.option("--overwrite", is_flag=True, help="Replace a file that is there already.")
runs_argument = click.argument("runs", nargs=-1, required=True, metavar="RUN...")
quiet_option = click.option("--quiet", is_flag=True, help="Show no progress.")


@click.group(context_settings=SETTINGS)
@click.version_option(package_name="backlash-rig", prog_name="rig")
def commands() -> None:
    """Play protocols on a rig, identify its blocks, and explain where recording and simulation differ."""


def command(name: str, *examples: str) -> Callable[[Command], click.Command]:
    """Return a decorator that makes a command whose help ends in examples, and that takes --debug."""
    epilog = "\b\nExamples:\n" + "\n".join(f"  {example}" for example in examples)

    def make(function: Command) -> click.Command:
        debug = click.option("--debug", is_flag=True, expose_value=False, help="Show where an error was raised.")
        return commands.command(name, epilog=epilog)(debug(function))

    return make


def say(lines: "Iterable[Line]") -> None:
    """Print a result line by line; tables are drawn on a terminal, and lines elsewhere."""
    import sys

    for line in lines:
        if isinstance(line, str):
            click.echo(line)
        elif sys.stdout.isatty():
            line.draw(sys.stdout)
        else:
            say(line.lines())


def tell(
    json_to: str | None, answer: Callable[[], Mapping[str, object]], words: "Callable[[], Iterable[Line]]",
) -> None:  # fmt: skip
    """Write an answer as JSON where that was asked for; tell the words unless stdout is for the JSON."""
    from rig.outputs import json_text, write_text

    if json_to and json_to != "-":
        write_text(json_to, json_text(answer()))
    if json_to == "-":
        click.echo(json_text(answer()), nl=False)
    else:
        say(words())


def check_destinations(*paths: str | None) -> None:
    """Refuse at once what could not be written at the end."""
    from rig.outputs import check_destination

    for path in paths:
        if path and path != "-":
            check_destination(path)


def optional_quantity(option: str, text: str | None, unit: str) -> float | None:
    """Return a quantity above 0 in its unit, None where none was typed; raise UsageError."""
    return None if text is None else quantity_above_0(option, text, unit)


def quantity_above_0(option: str, text: str, unit: str) -> float:
    """Return a quantity above 0 in its unit; raise UsageError."""
    from rig.errors import MisfitError, UsageError
    from rig.units import quantity

    try:
        value = quantity(text, unit)
    except MisfitError as error:
        raise UsageError(error.what, where=option, value=error.value, allowed=error.allowed, do=error.do) from error
    if value <= 0.0:
        raise UsageError("not above 0", where=option, value=text)
    return value


def rows_of(rows: str | None) -> tuple[int, int | None]:
    """Return FIRST:STOP as numbers; both ends may be left out."""
    from rig.errors import UsageError

    first, colon, stop = (rows or ":").partition(":")
    if not colon or not all(part.isdecimal() or not part for part in (first, stop)):
        allowed = "FIRST:STOP, such as 5200:105200"
        raise UsageError("not a range of rows", where="--rows", value=repr(rows), allowed=allowed)
    return int(first or 0), int(stop) if stop else None


def deliver(
    answer: "Identification | Explanation", json_to: str | None, words: "Iterable[Line]",
    beside: Mapping[str, object] = MappingProxyType({}),
) -> None:  # fmt: skip
    """Write what was asked for; tell the words unless stdout is for the JSON."""
    from rig.outputs import write_text
    from rig.workflow import answer_json

    if json_to and json_to != "-":
        write_text(json_to, answer_json(answer, beside))
    if json_to == "-":
        click.echo(answer_json(answer, beside), nl=False)
    else:
        say(words)


def deliver_page(page: "Callable[[], Page]", report: str | None, pdf: str | None) -> None:
    """Write an answer's page for the screen and for paper, where they were asked for."""
    from rig.outputs import write_bytes, write_text

    if not (report or pdf):
        return
    made = page()
    if report:
        write_text(report, made.html())
    if pdf:
        write_bytes(pdf, made.pdf())
