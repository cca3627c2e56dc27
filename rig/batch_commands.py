"""What can be typed about many recordings at once?

Only click is imported here, so that ``rig --help`` answers at once.
"""

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import click

from rig.typed import (
    calibration_option,
    check_destinations,
    command,
    json_option,
    optional_quantity,
    quiet_option,
    rig_option,
    tell,
)

if TYPE_CHECKING:
    from rig.batch import Spread


@command(
    "batch", "rig batch 'runs/**/*.h5' --job identify --out answers",
    "rig batch 'runs/*.h5' --job explain --time-limit 10min --workers 2",
    "rig batch 'runs/*.h5' --job explain --rig my_rig.yaml --scheduler tcp://10.0.0.1:8786",
)  # fmt: skip
@click.argument("patterns", nargs=-1, required=True, metavar="GLOB...")
@click.option("--job", type=click.Choice(["identify", "explain"]), required=True, help="What is asked of each.")
@click.option("--out", metavar="FOLDER", help="Where the answers go; else beside the recordings.")
@click.option("--table", metavar="F.csv", help="A table, .csv or .parquet; else batch.JOB.csv beside the answers.")
@click.option("--scheduler", metavar="ADDRESS", help="Of a Dask cluster that is to do the work; else this machine.")
@click.option("--workers", type=click.IntRange(1), metavar="N", help="Processes on this machine; else one a core.")
@click.option("--time-limit", metavar="10min", help="Give up a recording that takes longer; the next batch tries it.")
@rig_option
@calibration_option
@json_option
@quiet_option
def batch(
    patterns: Sequence[str], job: Any, out: str | None, table: str | None, scheduler: str | None, workers: int | None,
    time_limit: str | None, rig: str | None, calibration: str | None, json_to: str | None, quiet: bool,
) -> None:  # fmt: skip
    """Identify or explain each of many recordings.

    Each has its answer in a JSON file, NAME.JOB.json; a table has a line for each. What fails is listed and does not
    stop the rest. Typed again, only what is new, changed, failed for want of the machine, or was asked otherwise or of
    another version is done. Quote the GLOB, so that a folder more or less moves no answer.
    """
    from pathlib import Path

    from rig import batch as many
    from rig import batch_narration, batchtable, summaries, terminal
    from rig.errors import RefusedError
    from rig.outputs import make_folder
    from rig.question import Named, Question
    from rig.session import shipped

    check_destinations(table, json_to)
    limit_s = optional_quantity("--time-limit", time_limit, "s")
    spread = _spread(scheduler, workers)
    question = Question(job, rig=Named.of(rig and shipped(rig)), calibration=Named.of(calibration))
    found = many.planned(patterns, question, out)
    make_folder(found.folder)
    to = Path(table or found.folder / f"batch.{job}.csv")
    batchtable.check_table(to)
    with terminal.bar(job, quiet) as show:
        state = many.run(
            found, spread, lambda now: show(batch_narration.under_way(job, now), now.done / now.total), limit_s)
    batchtable.write(to, found, state)
    tell(json_to, lambda: summaries.batch(found, state, to), lambda: batch_narration.batched(found, state, to))
    if state.failures:
        raise RefusedError("not every recording has an answer", value=f"{len(state.failures)} of {state.total}",
                           do=f"see the column 'message' of {to}")  # fmt: skip


def _spread(scheduler: str | None, workers: int | None) -> "Spread":
    """Return what does the work, on a cluster or here; raise UsageError where both are named."""
    from rig import cluster, crew
    from rig.errors import UsageError
    from rig.reanalysis import work

    if scheduler and workers:
        raise UsageError("--workers is of this machine", value=str(workers), do="leave out --workers or --scheduler")
    if scheduler:
        return partial(cluster.outcomes, address=scheduler, do=work)
    return partial(crew.outcomes, workers=workers or crew.cores(), do=work)
