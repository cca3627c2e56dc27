"""What can be typed about files of other programs: import, export.

Only click is imported here, as in ``rig.commands``.
"""

from typing import Any

import click

from rig.typed import (
    check_destinations,
    command,
    json_option,
    optional_quantity,
    overwrite_option,
    quiet_option,
    rows_of,
    tell,
)


@command("import", "rig import scope.csv --time Time --input CH1 --output CH2 --rig rig.yaml --out run.h5",
         "rig import table.csv.gz --input 1 --output 2 --rate 51200 --rows 5200:105200 --out train.h5",
         "rig import daq.tdms --input Untitled/ao0 --output Untitled/ai0 --gaps lost --out run.h5",
         "rig import exported.csv --out run.h5")  # fmt: skip
@click.argument("table")
@click.option("--time", metavar="C", help="The column of times: a name, or a number from 1.")
@click.option("--input", "input_column", metavar="C", help="The column of u.")
@click.option("--output", "output_column", metavar="C", help="The column of y.")
@click.option("--measured-input", metavar="C", help="A channel that read u back.")
@click.option("--rate", "rate_hz", type=float, metavar="HZ", help="The sample rate, where nothing in the file says it.")
@click.option("--rows", metavar="FIRST:STOP", help="Only these rows, counted from 0 below the header.")
@click.option("--gaps", type=click.Choice(["refused", "lost"]), default="refused", show_default=True,
              help="Rows that the times lack and readings that are no numbers: an error, or lost samples.")  # fmt: skip
@click.option("--full-scale", "full_scale", metavar="1V", help="What full scale of a WAV file is.")
@click.option("--intersample", type=click.Choice(["held", "linear", "bandlimited"]), default="held", show_default=True,
              help="What u is between samples.")  # fmt: skip
@click.option("--initial", type=click.Choice(["rest", "in_motion"]), help="The rig at first; else told from y.")
@click.option("--rig", metavar="RIG.yaml", help="Keep this plain model in the recording.")
@click.option("--out", metavar="RUN.h5", required=True)
@overwrite_option
@json_option
@quiet_option
def import_table(
    table: str, time: str | None, input_column: str | None, output_column: str | None, measured_input: str | None,
    rate_hz: float | None, rows: str | None, gaps: str, full_scale: str | None, intersample: Any, initial: Any,
    rig: str | None, out: str, overwrite: bool, json_to: str | None, quiet: bool,
) -> None:  # fmt: skip
    """Turn a table into a recording.

    TABLE was recorded by another program: CSV or TSV, plain or gzipped, NPZ, MAT, TDMS, HDF5 or WAV; or it is a file
    that rig export wrote, which needs no columns. Values are in V and times in s where headings give no other unit.
    """
    from pathlib import Path

    from rig import narration, summaries, terminal
    from rig.importers import Asked, read_table
    from rig.recording import write
    from rig.rigfile import read_rig
    from rig.session import shipped

    check_destinations(out, json_to)
    first, stop = rows_of(rows)
    asked = Asked(
        input=input_column, output=output_column, time=time, rate_hz=rate_hz, measured_input=measured_input,
        first_row=first, stop_row=stop, intersample=intersample, initial=initial, gaps_lost=gaps == "lost",
        full_scale_v=optional_quantity("--full-scale", full_scale, "V"),
        rig_text=read_rig(shipped(rig)).text if rig else "",
    )  # fmt: skip
    with terminal.bar(f"importing {table}", quiet) as show:
        recording = read_table(table, asked, Path(out).resolve().parent, show)
        show(f"writing {out}", 0.9)
        write(out, recording, overwrite)
    tell(json_to, lambda: summaries.recording("rig.import/1", out, recording),
         lambda: narration.imported(recording, out))


@command("export", "rig export run.h5 --to csv", "rig export run.h5 --to mat --out for_matlab.mat")
@click.argument("run_file", metavar="RUN.h5")
@click.option("--to", "kind", type=click.Choice(["csv", "mat", "npz"]), required=True, help="The kind of file.")
@click.option("--out", metavar="F", help="Where it goes; else beside the recording.")
@overwrite_option
@json_option
@quiet_option
def export(
    run_file: str, kind: Any, out: str | None, overwrite: bool, json_to: str | None, quiet: bool,
) -> None:  # fmt: skip
    """Write a recording for other programs.

    All of it is written: signals, ledger, steps, texts, device and versions. rig import makes the same recording of it
    again, bit for bit, and refuses a file that was changed since.
    """
    from pathlib import Path

    from rig import narration, summaries, terminal
    from rig.exporters import export as write

    path = Path(out or Path(run_file).with_suffix(f".{kind}"))
    check_destinations(str(path), json_to)
    with terminal.bar(f"exporting {run_file}", quiet) as show:
        recording = write(run_file, kind, path, overwrite, show)
    tell(json_to, lambda: summaries.recording("rig.export/1", path, recording),
         lambda: narration.exported(recording, path))
