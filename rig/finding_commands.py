"""What can be typed to find recordings and to compare them: list, compare.

Only click is imported here, as in ``rig.commands``.
"""

import click

from rig.typed import (
    calibration_option,
    check_destinations,
    command,
    deliver_page,
    json_option,
    pdf_option,
    quiet_option,
    report_option,
    rig_option,
    say,
    tell,
)


@command("list", "rig list recordings", "rig list . --json -")
@click.argument("folder", default=".")
@json_option
@quiet_option
def list_recordings(folder: str, json_to: str | None, quiet: bool) -> None:
    """List the recordings in FOLDER and the folders in it.

    What was played, when, on which device, rate, length, whether it is whole, and the verdicts of answers that lie
    beside it. Every recording is read, so that a damaged one is told as such.
    """
    from rig import terminal
    from rig.listing import listed
    from rig.listing_words import words

    check_destinations(json_to)
    with terminal.bar("listing", quiet) as progress:
        found = listed(folder, progress)
    tell(json_to, found.to_dict, lambda: words(found))


@command("compare", "rig compare monday.h5 friday.h5", "rig compare a.h5 b.h5 --rig my_rig.yaml --report drift.html",
         "rig compare a.h5 b.h5 --values-only --json -")  # fmt: skip
@click.argument("before", metavar="RUN")
@click.argument("after", metavar="RUN")
@rig_option
@calibration_option
@click.option("--values-only", is_flag=True, help="Look for no new physics: seconds instead of a minute.")
@json_option
@report_option
@pdf_option
@quiet_option
def compare(
    before: str, after: str, rig: str | None, calibration: str | None, values_only: bool, json_to: str | None,
    report: str | None, pdf: str | None, quiet: bool,
) -> None:  # fmt: skip
    """Tell what changed from one RUN to the other.

    Values with their intervals and whether they changed by more than both doubts, tested each and together; physics
    that appeared or went; and whether protocol, device or calibration may be the cause.
    """
    from rig import comparing, terminal
    from rig.compared_words import compared
    from rig.outputs import write_text

    check_destinations(json_to, report, pdf)
    with terminal.bar("comparing", quiet) as progress:
        done = comparing.compare_runs(before, after, rig, calibration, progress, not values_only)
    if json_to and json_to != "-":
        write_text(json_to, done.to_json())
    if json_to == "-":
        click.echo(done.to_json(), nl=False)
    else:
        say(compared(done))
    deliver_page(lambda: comparing.comparison_page(done), report, pdf)
