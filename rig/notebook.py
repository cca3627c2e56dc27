"""What does one type in a notebook or a script, where the bench has a command line?

Each function is the command of its name. What goes wrong is raised as one of ``rig.errors``, its message the one that
the command prints. Recordings are given by path, or as they came from ``run`` or ``read``. How far a long job is shows
under the cell, or on the terminal; ``progress`` is told instead where it is given.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rig import workflow
from rig.calibration import read_calibration
from rig.cell import told_here
from rig.errors import UsageError
from rig.recorded import Recording
from rig.recording import read
from rig.rigfile import read_rig
from rig.session import Checked, record, shipped
from rig.session import check as proven
from rig.simulated import Simulated
from rig.workflow import Runs

if TYPE_CHECKING:
    from identify.bent.curves import Form
    from identify.explain.explanation import Explanation
    from identify.identification import Identification
    from rig.comparing import Compared

FilePath = str | Path
Run = FilePath | Recording


def check(protocol: FilePath, device: str | None = None, rig: str | None = None) -> Checked:
    """Prove a protocol before any output; raise FileError, RefusedError, UsageError or DeviceError."""
    return proven(protocol, device, rig)


def run(
    protocol: FilePath, out: FilePath | None = None, device: str | None = None, rig: str | None = None,
    overwrite: bool = False,
) -> Recording:  # fmt: skip
    """Play a protocol, keep what comes back at ``out`` (else the protocol's name, here), and return it.

    Interrupting the kernel ramps the output to its safe level. A run that is not complete raises what the command would
    say; what was recorded of it is at ``out``.
    """
    out = Path(out or f"{Path(protocol).stem}.h5")
    with told_here("run", None) as show:
        done = record(
            protocol, device, out, lambda kept, of: show(f"{kept} of {of} samples", kept / max(of, 1)), overwrite, rig
        )
    if done.outcome.failure is not None:
        raise done.outcome.failure
    return done.recording


def identify(
    *runs: Run, rig: FilePath | None = None, calibration: FilePath | None = None, borders: "Form | None" = None,
    knots: int | None = None, progress: workflow.Progress | None = None,
) -> "Identification":  # fmt: skip
    """Return which rig made the recordings: borders, G1 and G2 with intervals, and what cannot be told.

    ``rig`` is the plain model, else the one kept in the recordings; ``borders`` is straight or curved, with ``knots``.
    Raises FileError where the recordings cannot tell.
    """
    given = _runs(runs, (), rig, calibration)
    with told_here("identify", progress) as show:
        return workflow.identify_runs(given, show, borders, knots)


def explain(
    *runs: Run, rig: FilePath | None = None, hold_out: Sequence[Run] = (), calibration: FilePath | None = None,
    progress: workflow.Progress | None = None,
) -> "Explanation":  # fmt: skip
    """Return where recordings and model part, what physics was left out, and the proof on ``hold_out``.

    Without ``hold_out`` a part of the recordings is kept back. Raises FileError where they cannot tell.
    """
    given = _runs(runs, hold_out, rig, calibration)
    with told_here("explain", progress) as show:
        return workflow.explain_runs(given, show)


def simulate(run: FilePath, rig: FilePath | None = None) -> Simulated:
    """Return the answer of a model - a rig file or the JSON of an answer - to the input of a recording."""
    return workflow.simulate(run, rig)


def compare(
    before: FilePath, after: FilePath, rig: FilePath | None = None, physics: bool = True,
    progress: workflow.Progress | None = None,
) -> "Compared":  # fmt: skip
    """Return what changed from one recording to another, and whether it was the rig."""
    from rig.comparing import compare_runs

    with told_here("compare", progress) as show:
        return compare_runs(before, after, rig, None, show, physics)


def _runs(
    runs: Sequence[Run], hold_out: Sequence[Run], rig: FilePath | None, calibration: FilePath | None
) -> Runs:
    """Return recordings, read where they are given by path; raise UsageError where there are none."""
    if not runs:
        raise UsageError("no recording is named", do="give a path, or what rig.read or rig.run returned")
    given = None if calibration is None else read_calibration(calibration)
    named = None if rig is None else read_rig(shipped(rig))
    held = {_key(run) for run in hold_out}
    kept = [run for run in runs if _key(run) not in held]
    if not kept:
        raise UsageError("no run is left to fit", value=f"{len(held)} held out", do="hold out fewer of the runs")
    return workflow.assembled([_placed(run) for run in kept], [_placed(run) for run in hold_out], named, given)


def _key(run: Run) -> object:
    """Return what is the same for the same recording only."""
    return id(run) if isinstance(run, Recording) else Path(run).resolve()


def _placed(run: Run) -> workflow.Placed:
    return (run.name, run) if isinstance(run, Recording) else (str(run), read(run))
