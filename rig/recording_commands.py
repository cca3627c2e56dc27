"""What can be typed about recordings as files: verify.

Only click is imported here, as in ``rig.commands``.
"""

from collections.abc import Sequence

import click

from rig.typed import check_destinations, command, json_option, say


@command("verify", "rig verify run.h5", "rig verify monday/*.h5 --json verified.json")
@click.argument("files", nargs=-1, required=True, metavar="RUN...")
@json_option
def verify(files: Sequence[str], json_to: str | None) -> None:
    """Compute all checksums of recordings anew.

    One changed byte anywhere in a file is found, and where it is as far as that can be told. A run that was killed or
    is still being recorded is verified as far as it went. The exit code is 1 where anything is damaged.
    """
    from rig import recording_narration
    from rig.outputs import write_text
    from rig.verifying import refuse_damaged, to_json
    from rig.verifying import verify as verified

    check_destinations(json_to)
    found = [verified(path) for path in files]
    if json_to and json_to != "-":
        write_text(json_to, to_json(found))
    if json_to == "-":
        click.echo(to_json(found), nl=False)
    else:
        say(line for one in found for line in recording_narration.verified(one))
    refuse_damaged(found)
