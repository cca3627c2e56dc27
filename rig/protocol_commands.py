"""What can be typed to find a protocol, or to be helped with writing one: protocols, schema.

Only click is imported here, as in ``rig.commands``.
"""

import click

from rig.typed import command, json_option, overwrite_option, say, tell


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
    from rig.typed import check_destinations

    check_destinations(out)
    if out:
        write_text(out, schema_text(kind))
    else:
        click.echo(schema_text(kind), nl=False)
