"""What can be typed: the commands of ``rig`` and their options.

Only click is imported here, so that ``rig --help`` answers at once; every command loads what it needs.
"""

from collections.abc import Sequence
from typing import Any

import click

from rig import (
    batch_commands,
    conversion_commands,
    device_commands,
    finding_commands,
    live_commands,
    protocol_commands,
    recording_commands,
)
from rig.typed import (
    calibration_option,
    check_destinations,
    command,
    commands,
    deliver,
    deliver_page,
    device_option,
    json_option,
    optional_quantity,
    overwrite_option,
    pdf_option,
    played_rig_option,
    quantity_above_0,
    quiet_option,
    report_option,
    rig_option,
    runs_argument,
    tell,
)

__all__ = [
    "batch_commands", "commands", "conversion_commands", "device_commands", "finding_commands", "live_commands",
    "protocol_commands", "recording_commands",
]  # fmt: skip


@command(
    "check", "rig check protocols/fig13_staircase.yaml", "rig check my.yaml --device serial:/dev/ttyACM0 --plot my.png"
)
@click.argument("protocol")
@device_option
@played_rig_option
@click.option("--plot", metavar="F.png", help="Draw a preview.")
@json_option
@quiet_option
def check(
    protocol: str, device: str | None, rig: str | None, plot: str | None, json_to: str | None, quiet: bool,
) -> None:  # fmt: skip
    """Prove PROTOCOL before any output.

    Tells the exact samples, levels, slew, duration, limits, the rate the device makes, the buffer and disk it takes;
    and, where the protocol names its rig, how sure the answer would be, which step tells what, and what to change.
    """
    from rig import foresight, protocol_narration, session, terminal

    check_destinations(plot, json_to)
    with terminal.bar("checking", quiet) as show:
        show("proving it on the device", 0.0)
        found = session.check(protocol, device, rig)
        show("reckoning what it will tell", 0.3)
        told = foresight.foreseen(found)
        if plot:
            from rig.preview import draw_plan

            show("drawing the preview", 0.9)
            draw_plan(found.plan, plot)
    tell(json_to, lambda: foresight.to_dict(found, told),
         lambda: [*protocol_narration.checked(found), *protocol_narration.foreseen(told)])


@command("run", "rig run protocols/sine_50hz.yaml --out sine.h5", "rig run my.yaml --device serial:/dev/ttyACM0",
         "rig run my.yaml --live")
@click.argument("protocol")
@device_option
@played_rig_option
@click.option("--out", metavar="RUN.h5", help="The recording; else the protocol's name, here.")
@click.option("--live", is_flag=True, help="Show a page in the browser while it is recorded, and tell its URL.")
@click.option("--transcript", is_flag=True, help="Keep the bytes that cross the wire, first and last 512 KiB.")
@overwrite_option
@json_option
@quiet_option
def run(
    protocol: str, device: str | None, rig: str | None, out: str | None, live: bool, transcript: bool, overwrite: bool,
    json_to: str | None, quiet: bool,
) -> None:  # fmt: skip
    """Play PROTOCOL and record.

    Ctrl-C, or the abort button of the live page, ramps the output to its safe level and keeps what was recorded.
    """
    from pathlib import Path

    from rig import narration, session, summaries, terminal
    from rig.transcript import taken

    out = out or f"{Path(protocol).stem}.h5"
    check_destinations(out, json_to)
    with live_commands.shown(out, live), terminal.counted("recording", quiet) as progress, taken(transcript):
        done = session.record(protocol, device, out, progress, overwrite, rig)
    tell(json_to, lambda: summaries.run(done),
         lambda: [*narration.recorded(done), *(narration.transcribed(done) if transcript else ())])
    if done.outcome.failure is not None:
        raise done.outcome.failure


@command("design", "rig design rigs/opamp_backlash.yaml --out best.yaml",
         "rig design my_rig.yaml --out best.yaml --time 20s --limit 5V --device serial:/dev/ttyACM0")  # fmt: skip
@click.argument("rig_file", metavar="RIG.yaml")
@click.option("--out", metavar="PROTOCOL.yaml", required=True, help="The protocol to write.")
@click.option("--time", "time_s", metavar="60s", default="60 s", show_default=True, help="How long it may take.")
@click.option("--limit", "limit_v", metavar="10V", help="The largest level; else the range of the device.")
@click.option("--slew", "slew_v_per_s", metavar="V/s", help="The steepest slope, such as '5 V/ms'; else any.")
@click.option("--rate", "rate_hz", metavar="10kHz", help="The sample rate; else one that shows the rig's corners.")
@device_option
@overwrite_option
@json_option
@quiet_option
def design(
    rig_file: str, out: str, time_s: str, limit_v: str | None, slew_v_per_s: str | None, rate_hz: str | None,
    device: str | None, overwrite: bool, json_to: str | None, quiet: bool,
) -> None:  # fmt: skip
    """Write the protocol that tells most.

    Chooses stimuli and repeats for the smallest confidence intervals of the rig in RIG.yaml within time, limits and
    device, also if its values are 30 % off, and prints what is expected beside the paper's Fig. 13 protocol.
    """
    from rig import protocol_narration, summaries, terminal
    from rig.design import Wish
    from rig.design import design as write

    check_destinations(json_to)
    wish = Wish(
        quantity_above_0("--time", time_s, "s"), optional_quantity("--limit", limit_v, "V"),
        optional_quantity("--slew", slew_v_per_s, "V/s"), optional_quantity("--rate", rate_hz, "Hz"), device,
    )  # fmt: skip
    with terminal.bar("designing", quiet) as progress:
        done = write(rig_file, out, wish, progress, overwrite)
    tell(json_to, lambda: summaries.design(done), lambda: protocol_narration.designed(done))


@command(
    "identify", "rig identify run.h5 --report run.html --pdf run.pdf",
    "rig identify a.h5 b.h5 --rig my_rig.yaml --json answer.json",
    "rig identify run.h5 --borders curved --report run.html",
)
@runs_argument
@rig_option
@click.option("--borders", type=click.Choice(["straight", "curved"]), help="Their form; else as the rig file has them.")
@click.option("--knots", type=click.IntRange(3, 60), help="Points of each curved border; else told by the data.")
@calibration_option
@json_option
@report_option
@pdf_option
@quiet_option
def identify(
    runs: Sequence[str], rig: str | None, borders: Any, knots: int | None, calibration: str | None,
    json_to: str | None, report: str | None, pdf: str | None, quiet: bool,
) -> None:  # fmt: skip
    """Tell which rig made the recordings.

    Borders, G1 and G2 with 95 % confidence intervals, and what the recordings cannot tell.
    """
    from rig import narration, terminal, workflow
    from rig.errors import UsageError

    if knots is not None and borders != "curved":
        raise UsageError("--knots is of curved borders", value=str(knots), do="add --borders curved")
    check_destinations(json_to, report, pdf)
    asked = workflow.asked("identify", runs, rig, (), calibration, borders, knots)
    loaded = workflow.load_asked(asked)
    with terminal.bar("identifying", quiet) as progress:
        found = workflow.identify_runs(loaded, progress, borders, knots)
    deliver(found, json_to, [*narration.incomplete(loaded), *narration.identified(found)],
            {**loaded.beside(), **asked.told()})  # fmt: skip
    deliver_page(lambda: workflow.identification_page(found, loaded), report, pdf)


@command("explain", "rig explain run.h5 --report run.html", "rig explain a.h5 b.h5 --hold-out c.h5 --json answer.json",
         "rig explain run.h5 --follow-up serial:/dev/ttyACM0")  # fmt: skip
@runs_argument
@rig_option
@click.option("--hold-out", multiple=True, metavar="RUN", help="Keep this run for the proof; may be given again.")
@click.option("--follow-up", metavar="ADDRESS", help="Play on this device what would decide open questions.")
@click.option("--separate", metavar="FOLDER", help="Where protocols that would decide go; else beside the answer.")
@calibration_option
@json_option
@report_option
@pdf_option
@quiet_option
def explain(
    runs: Sequence[str], rig: str | None, hold_out: Sequence[str], follow_up: str | None, separate: str | None,
    calibration: str | None, json_to: str | None, report: str | None, pdf: str | None, quiet: bool,
) -> None:  # fmt: skip
    """Tell what physics the model lacks.

    Finds where recording and simulation differ, names what is missing, and proves the better model on held-out data.
    Where several physics fit, a protocol that would tell them apart is written beside the answer.
    """
    from rig import followup, narration, terminal, workflow

    check_destinations(json_to, report, pdf)
    paged = report or pdf
    asked = followup.Asked(tuple(runs), rig, tuple(hold_out), followup.folder(separate, json_to, paged, follow_up),
                           follow_up, calibration)
    # what a device was asked meanwhile cannot be asked of the recordings again
    made_from = {} if follow_up else workflow.asked("explain", runs, rig, hold_out, calibration).told()
    with terminal.bar("explaining", quiet) as progress:
        done = followup.explain(asked, workflow.part(progress, 0.0, 0.8 if paged else 1.0))
        found = workflow.identify_improved(done.runs, done.told, workflow.part(progress, 0.8, 1.0)) if paged else None
    deliver(done.told, json_to, [*narration.incomplete(done.runs), *narration.explained(done.told),
                                 *followup.words(done)], {**done.runs.beside(), **done.to_dict(), **made_from})
    deliver_page(lambda: workflow.explanation_page(done.told, found, done.runs), report, pdf)


@command("simulate", "rig simulate run.h5 --rig answer.json --out answer.csv", "rig simulate run.h5 --rig my_rig.yaml")
@click.argument("run_file", metavar="RUN.h5")
@click.option("--rig", metavar="FILE", help="A rig file or the JSON of an answer; else the rig kept in the recording.")
@click.option("--out", metavar="F.csv", help="Write time, u, recorded and simulated y, and its band.")
@json_option
@quiet_option
def simulate(run_file: str, rig: str | None, out: str | None, json_to: str | None, quiet: bool) -> None:
    """Play a model on a recorded input.

    The model starts from rest; its answer is held against the recorded one. The JSON of rig identify says how sure its
    values are: the answer then comes with its 95 % band, which is the model's and leaves out the noise of a reading.
    """
    from rig import summaries, terminal, workflow
    from rig.outputs import write_text

    check_destinations(out, json_to)
    with terminal.bar("simulating", quiet) as show:
        show(run_file, 0.0)
        played = workflow.simulate(run_file, rig)
        if out:
            show(f"writing {out}", 0.5)
            write_text(out, played.to_csv())
    tell(json_to, lambda: summaries.simulate(played), played.words)


@command("demo", "rig demo", "rig demo --out /tmp/first-light")
@click.option("--out", metavar="FOLDER", default="rig-demo", show_default=True, help="Where everything is put.")
@json_option
@quiet_option
def demo(out: str, json_to: str | None, quiet: bool) -> None:
    """Do the main job with no hardware.

    Plays two protocols on the loopback device, records, identifies, explains and writes the report. Files of an earlier
    demo in FOLDER are replaced.
    """
    from rig import narration, summaries, terminal
    from rig.demo import play

    check_destinations(json_to)
    with terminal.bar("demo", quiet) as progress:
        shown = play(out, progress)
    tell(json_to, lambda: summaries.demo(shown), lambda: [
        *narration.explained(shown.told), *(f"  written  {path}" for path in shown.files),
        f"Open {shown.report} in a browser.",
    ])
