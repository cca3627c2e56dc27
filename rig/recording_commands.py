"""What can be typed about recordings, and what was made of them, as files: verify.

Only click is imported here, as in ``rig.commands``.
"""

from collections.abc import Sequence

import click

from rig.typed import check_destinations, command, json_option, quiet_option, say


@command("verify", "rig verify run.h5", "rig verify monday/*.h5 --json verified.json",
         "rig verify answers/run.identify.json --recordings monday")  # fmt: skip
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
@click.option("--recordings", multiple=True, metavar="FOLDER", help="Where those of answers are; else beside these.")
@json_option
@quiet_option
def verify(files: Sequence[str], recordings: Sequence[str], json_to: str | None, quiet: bool) -> None:
    """Compute all checksums of recordings anew, and answers.

    One changed byte anywhere in a file is found, and where it is as far as that can be told. A run that was killed or
    is still being recorded is verified as far as it went. The JSON of identify, explain or batch is made
    again from its recordings: by the same program on the same kind of processor every number must come out to the last
    bit, else to 1e-9. The exit code is 1 where anything is damaged or comes out otherwise.
    """
    from rig import recording_narration, terminal
    from rig.outputs import write_text
    from rig.progress import each
    from rig.reproduced import is_answer, reproduced
    from rig.verifying import refuse_damaged, to_json
    from rig.verifying import verify as verified

    check_destinations(json_to)
    with terminal.bar("verifying", quiet) as show:
        found = [
            reproduced(path, recordings, of_file) if is_answer(path) else verified(path)
            for path, of_file in each(files, show)
        ]
    if json_to and json_to != "-":
        write_text(json_to, to_json(found))
    if json_to == "-":
        click.echo(to_json(found), nl=False)
    else:
        say(line for one in found for line in recording_narration.checked(one))
    refuse_damaged(found)
