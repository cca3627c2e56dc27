"""How does a table that another program recorded become a recording like our own?

Values are in V and time in s; nothing is scaled. Time may be a column, which must then be uniform, or a rate.
"""

import hashlib
from pathlib import Path

import numpy as np

from identify.trace import Array, Intersample
from rig.errors import FileError, UsageError
from rig.provenance import git_commit, now, software
from rig.recorded import Equipment, Initial, Origin, Recording, complete_ledger
from rig.tables import Table, open_table
from rig.timebase import TimeBase, uniform

RATE_AGREES = 1e-3
"""Relative difference allowed between a time column and a rate given beside it."""
FEWEST = 2
REST_SPAN = 0.02
REST_NOISE = 6.0
MEDIAN_OF_SECOND_DIFFERENCES = 0.6745 * 6**0.5  # of white noise of unit variance


def read_table(
    path: str | Path, *, input: str, output: str, time: str | None = None, rate_hz: float | None = None,  # noqa: A002
    measured_input: str | None = None, first_row: int = 0, stop_row: int | None = None,
    intersample: Intersample = "held", initial: Initial | None = None, rig_text: str = "",
) -> Recording:
    """Return the rows [first_row, stop_row) of a table, counted from 0 below the header, as a recording.

    ``input`` is the column of u, ``output`` of y, each a name or a number from 1 on; of ``time`` and ``rate_hz`` one
    is needed. ``initial`` None: in motion when rows before the first are left out or y does not begin near 0, else
    rest. Raises FileError naming line and column, UsageError for options that make no sense.
    """
    _check_options(str(path), time, rate_hz, first_row, stop_row)
    table = open_table(path)
    u, y = (table.column(which, first_row, stop_row) for which in (input, output))
    if u.size < FEWEST:
        raise FileError("too few rows", where=str(path), value=f"{u.size} from row {first_row} on",
                        allowed=f"at least {FEWEST}")
    base = _time_base(table, time, rate_hz, first_row, stop_row)
    columns = {"input": input, "output": output, "time": time or "", "measured_input": measured_input or ""}
    return Recording(
        name=_stem(Path(path)), rate_hz=base.rate_hz, u=u, y=y, ledger=complete_ledger(u.size),
        origin=_origin(Path(path), columns | {"rows": f"{first_row}:{first_row + u.size}"}),
        u_measured=None if measured_input is None else table.column(measured_input, first_row, stop_row),
        intersample=intersample, start_s=base.start_s, initial=initial or _initial(first_row, y),
        title=Path(path).name, rig_text=rig_text, reason="imported",
    )


def _check_options(where: str, time: str | None, rate_hz: float | None, first_row: int, stop_row: int | None) -> None:
    if time is None and rate_hz is None:
        raise UsageError("the time base is unknown", where=where, do="give the time column or the sample rate")
    if rate_hz is not None and not (np.isfinite(rate_hz) and rate_hz > 0):
        raise UsageError("not a sample rate", value=f"{rate_hz:g} Hz", allowed="above 0 Hz")
    if first_row < 0 or (stop_row is not None and stop_row <= first_row):
        raise UsageError("not a range of rows", value=f"{first_row}:{'' if stop_row is None else stop_row}",
                         allowed="FIRST:STOP with 0 <= FIRST < STOP, counted from 0 below the header")


def _initial(first_row: int, y: Array) -> Initial:
    """Return whether the rig was at rest: nothing cut off before, and y[0] at 0 V to within noise and 2 % of its span.

    The noise is taken from second differences, which leave little of a signal.
    """
    noise_v = float(np.median(np.abs(np.diff(y, 2)))) / MEDIAN_OF_SECOND_DIFFERENCES if y.size > FEWEST else 0.0
    near = max(REST_SPAN * float(np.ptp(y)), REST_NOISE * noise_v)
    return "rest" if first_row == 0 and abs(float(y[0])) <= near else "in_motion"


def _time_base(table: Table, time: str | None, rate_hz: float | None, first: int, stop: int | None) -> TimeBase:
    """Return the clock of the rows [first, stop)."""
    if time is None:
        assert rate_hz is not None
        return TimeBase(first / rate_hz, rate_hz)
    base = uniform(table.column(time, first, stop), lambda row: table.place(first + row))
    if rate_hz is None:
        return base
    if abs(base.rate_hz / rate_hz - 1.0) > RATE_AGREES:
        raise FileError("time column and rate disagree", where=table.where, value=f"{base.rate_hz:g} Hz in the file",
                        allowed=f"{rate_hz:g} Hz", do="leave one of them out")
    return TimeBase(base.start_s, rate_hz)


def _origin(path: Path, settings: dict[str, str]) -> Origin:
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    equipment = Equipment(address=str(path), model="imported", settings=settings | {"source_sha256": digest})
    return Origin(equipment, software(), git_commit(), started=now(), finished=now())


def _stem(path: Path) -> str:
    """Return the name without ``.csv`` or ``.csv.gz``."""
    return Path(path.stem).stem if path.suffix.lower() == ".gz" else path.stem
