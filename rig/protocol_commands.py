"""What can be typed to find a protocol, or to be helped with writing one: protocols, new, schema.

Only click is imported here, as in ``rig.commands``.
"""

import sys
from dataclasses import replace

import click

from rig.typed import (
    check_destinations,
    command,
    device_option,
    json_option,
    optional_quantity,
    overwrite_option,
    say,
    tell,
)

ABOUT = ("borders", "response", "memory", "speed", "held", "noise")
"""The kinds of ``rig.asking``, which is not imported here."""


@command("protocols", "rig protocols", "rig protocols sine_ladder", "rig protocols quick_check --out mine.yaml")
@click.argument("name", required=False)
@click.option("--out", metavar="PROTOCOL.yaml", help="Put a copy of NAME there, to be changed.")
@overwrite_option
@json_option
def protocols(name: str | None, out: str | None, overwrite: bool, json_to: str | None) -> None:
    """List the protocols that come with the program, or show one.

    Each answers one question, and its comment says how. rig check, rig run and others find them under these names.
    """
    from pathlib import Path

    from rig import gallery
    from rig.errors import UsageError
    from rig.gallery_words import listed

    if out and not name:
        raise UsageError("--out is of one protocol", value=out, do="name it: rig protocols NAME --out F.yaml")
    if name and out:
        gallery.copy(name, Path(out), overwrite)
        say([f"{out}: a copy of protocols/{Path(name).stem}.yaml; next: `rig check {out}`"])
    elif name:
        click.echo(gallery.text_of(name), nl=False)
    else:
        found = gallery.gallery()
        tell(json_to, lambda: gallery.to_dict(found), lambda: listed(found))


@command("new", "rig new mine.yaml", "rig new mine.yaml --about held --rig my_rig.yaml --level 5V --yes")
@click.argument("out", metavar="PROTOCOL.yaml")
@click.option("--about", type=click.Choice(ABOUT), help="What you want to know.")
@click.option("--rig", metavar="RIG.yaml", help="Your rig; else the op-amp circuit.")
@click.option("--level", metavar="5V", help="The largest level; else what rig and device allow.")
@click.option("--frequency", metavar="7Hz", help="The frequency to begin with; else below the rig's slowest corner.")
@click.option("--rate", metavar="10kHz", help="The sample rate; else one that shows the rig's corners.")
@click.option("--title", help="What it is called.")
@device_option
@click.option("--yes", is_flag=True, help="Ask nothing: what is not given is as usual. So it is away from a terminal.")
@overwrite_option
@json_option
def new(
    out: str, about: str | None, rig: str | None, level: str | None, frequency: str | None, rate: str | None,
    title: str | None, device: str | None, yes: bool, overwrite: bool, json_to: str | None,
) -> None:  # fmt: skip
    """Write a protocol for your rig, after a few questions.

    It is sized so that the gap moves, proven on the device before it is written, and simple enough to be changed.
    """
    from rig import foresight, protocol_narration
    from rig.newprotocol import USUAL_RIG, Wish, write_new
    from rig.questions import asked

    check_destinations(out, json_to)
    given = Wish(
        about or "", rig or "", optional_quantity("--level", level, "V"), optional_quantity("--rate", rate, "Hz"),
        optional_quantity("--frequency", frequency, "Hz"), title, device,
    )  # fmt: skip
    silent = yes or not sys.stdin.isatty()
    wish = replace(given, about=about or ABOUT[0], rig=rig or USUAL_RIG) if silent else asked(given)
    done = write_new(out, wish, overwrite)
    tell(json_to, done.to_dict, lambda: protocol_narration.written(done, foresight.foreseen(done.checked)))


@command("schema", "rig schema protocol", "rig schema rig --out rig.schema.json")
@click.argument("kind", type=click.Choice(["protocol", "rig"]))
@click.option("--out", metavar="F.json", help="Write it there; else it is printed.")
def schema(kind: str, out: str | None) -> None:
    """Print the JSON Schema of protocol or rig files.

    Editors that know yaml-language-server use it to complete, explain and mark what is typed; the comment that a file
    needs for that stands in all that come with the program, and in what rig new and rig protocols write.
    """
    from rig.outputs import write_text
    from rig.schemas import schema_text

    check_destinations(out)
    if out:
        write_text(out, schema_text(kind))
        say([f"{out}: the JSON Schema of {kind} files"])
    else:
        click.echo(schema_text(kind), nl=False)
