"""How does a table that another program recorded become a recording like our own?

Values become V and times s, by the units in the headings or as they stand. The time base is a column, which must then
be uniform, or a rate, or what the file itself says; rows that it lacks are refused, or lost samples where that is asked
for. Nothing is resampled. A long table goes by stretches into files that are gone when the recording is.
"""

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from identify.trace import LONG, Array, Intersample, Samples, blocks
from rig.errors import FileError, UsageError
from rig.exported import restored
from rig.gapped import filled
from rig.progress import Show, silent
from rig.provenance import git_commit, now, software
from rig.readers import Table, Wanted, open_table
from rig.recorded import RATES_HZ, Entry, Equipment, Event, Initial, Ledger, Origin, Recording
from rig.spool import spooled
from rig.timebase import Gaps, TimeBase, clock

RATE_AGREES = 1e-3
"""Relative difference allowed between a time column and a rate given beside it."""
FEWEST = 2
REST_SPAN = 0.02
REST_NOISE = 6.0
MEDIAN_OF_SECOND_DIFFERENCES = 0.6745 * 6**0.5  # of white noise of unit variance
NO_GAPS = Gaps(np.empty(0, np.int64), np.empty(0, np.int64))


@dataclass(frozen=True)
class Asked:
    """Which columns of a table are what, and how they are to be understood.

    Columns are names or numbers from 1 on; rows [first_row, stop_row) are counted from 0 below the heading.
    ``gaps_lost`` has rows that the time base lacks, and readings that are no numbers, as lost samples. ``initial``
    None: in motion when rows before the first are left out or y does not begin near 0, else rest.
    """

    input: str | None = None
    output: str | None = None
    time: str | None = None
    rate_hz: float | None = None
    measured_input: str | None = None
    first_row: int = 0
    stop_row: int | None = None
    intersample: Intersample = "held"
    initial: Initial | None = None
    gaps_lost: bool = False
    full_scale_v: float | None = None
    rig_text: str = ""

    def columns(self) -> dict[str, Wanted]:
        """Return what is to be read, by what it is."""
        told = {"u": (self.input, "V"), "y": (self.output, "V"), "u_measured": (self.measured_input, "V"),
                "time": (self.time, "s")}
        missing = {"y", "u_measured"} if self.gaps_lost else set()
        return {name: Wanted(column, unit, "let through" if name in missing else "refused")
                for name, (column, unit) in told.items() if column}


def read_table(
    path: str | Path, asked: Asked, folder: Path | None = None, progress: Show = silent
) -> Recording:
    """Return a table as a recording; without columns, one of our own exports as the recording it was made from.

    Long signals stand in ``folder`` until they are no longer used. Raises FileError naming line and column, UsageError
    for options that make no sense.
    """
    _check(str(path), asked)
    table = open_table(path, asked.full_scale_v)
    if asked.input is None and asked.output is None and table.note:
        return restored(table, Path(path), folder)
    _check_columns(table, asked)
    wanted = asked.columns()
    pieces = _told(table.stretches(list(wanted.values()), asked.first_row, asked.stop_row), asked, progress)
    read = spooled(pieces, len(wanted), folder)
    progress("looking at the times", 0.8)
    signals = dict(zip(wanted, read, strict=True))
    if signals["u"].size < FEWEST:
        raise FileError("too few rows", where=table.where, value=f"{signals['u'].size} from row {asked.first_row} on",
                        allowed=f"at least {FEWEST}")
    return _recording(Path(path), asked, table, signals)


def _told(pieces: Iterator[Array], asked: Asked, progress: Show) -> Iterator[Array]:
    """Yield the pieces, telling how many rows were read; and which share, where it was said how many there are."""
    rows, wanted = 0, (asked.stop_row or 0) - asked.first_row
    for piece in pieces:
        yield piece
        rows += piece.shape[1]
        progress(f"{rows} rows read", 0.8 * min(rows / wanted, 1.0) if wanted > 0 else 0.0)


def _check(where: str, asked: Asked) -> None:
    """Raise UsageError for a rate or rows that cannot be."""
    rate, first, stop = asked.rate_hz, asked.first_row, asked.stop_row
    if rate is not None and not (np.isfinite(rate) and rate > 0):
        raise UsageError("not a sample rate", value=f"{rate:g} Hz", allowed="above 0 Hz")
    if first < 0 or (stop is not None and stop <= first):
        raise UsageError("not a range of rows", value=f"{first}:{'' if stop is None else stop}",
                         allowed="FIRST:STOP with 0 <= FIRST < STOP, counted from 0 below the header")


def _check_columns(table: Table, asked: Asked) -> None:
    """Raise UsageError when it is not said which columns are u and y, or what the time base is."""
    if asked.input is None or asked.output is None:
        names = ", ".join(heading.text for heading in table.headings if heading.text)
        raise UsageError("which columns are u and y?", where=table.where, do="give --input and --output",
                         allowed=f"1 to {len(table.headings)}{': ' if names else ''}{names[:400]}")
    if asked.time is None and asked.rate_hz is None and table.clock is None:
        raise UsageError("the time base is unknown", where=table.where, do="give the time column or the sample rate")


def _recording(path: Path, asked: Asked, table: Table, signals: dict[str, Samples]) -> Recording:
    """Return the signals as a recording, samples put in where the time base lacks rows."""
    base, gaps = _time_base(table, asked, signals)
    if not RATES_HZ[0] <= base.rate_hz <= RATES_HZ[1] or not np.isfinite(base.start_s):
        raise FileError("no clock of a recording", where=table.where,
                        value=f"{base.rate_hz:g} Hz from {base.start_s:g} s on",
                        allowed=f"{RATES_HZ[0]:g} to {RATES_HZ[1]:g} Hz", do="see in which unit the times are")
    u = filled(signals["u"], gaps, "held" if asked.intersample == "held" else "linear")
    inputs = {name: filled(signals[name], gaps, "nothing") for name in ("y", "u_measured") if name in signals}
    ledger = _ledger(list(inputs.values()))
    return Recording(
        name=_stem(path), rate_hz=base.rate_hz, u=u, y=inputs["y"], u_measured=inputs.get("u_measured"), ledger=ledger,
        origin=_origin(path, asked, table, signals["u"].size), intersample=asked.intersample, start_s=base.start_s,
        initial=asked.initial or _initial(asked.first_row, inputs["y"]), title=path.name, rig_text=asked.rig_text,
        reason="imported", events=_events(ledger, gaps, asked),
    )  # fmt: skip


def _ledger(inputs: list[Samples]) -> Ledger:
    """Return the ledger: lost is what no number stands for."""
    ledger = np.empty(inputs[0].size, dtype=np.uint8)
    for start, stop in blocks(0, ledger.size):
        there = np.logical_and.reduce([np.isfinite(signal[start:stop]) for signal in inputs])
        ledger[start:stop] = np.where(there, Entry.RECORDED, Entry.LOST)
    return ledger


def _events(ledger: Ledger, gaps: Gaps, asked: Asked) -> tuple[Event, ...]:
    """Return what is to be known of samples that the table lacks."""
    lost = ledger == Entry.LOST
    count, missing = int(np.count_nonzero(lost)), int(gaps.missing.sum())
    if not count:
        return ()
    u_is = "held" if asked.intersample == "held" else "a straight line"
    told = [f"{missing} samples in {gaps.rows.size} gaps of the times, where u is taken as {u_is}"] if missing else []
    told += [f"{count - missing} readings that are no numbers"] if count > missing else []
    first, last = int(np.argmax(lost)), lost.size - int(np.argmax(lost[::-1]))
    return (Event("lost", f"the table lacks {' and '.join(told)}", first, last),)


def _initial(first_row: int, y: Samples) -> Initial:
    """Return whether the rig was at rest: nothing cut off before, and y[0] at 0 V to within noise and 2 % of its span.

    The noise is taken from second differences, which leave little of a signal, of the first million readings.
    """
    head = y[:LONG]
    if first_row or not np.isfinite(head[0]):
        return "in_motion"
    ends = [(np.nanmin(y[a:b]), np.nanmax(y[a:b])) for a, b in blocks(0, y.size) if np.isfinite(y[a:b]).any()]
    span = max(high for _, high in ends) - min(low for low, _ in ends)
    bends = np.abs(np.diff(head[np.isfinite(head)], 2))
    noise_v = float(np.median(bends)) / MEDIAN_OF_SECOND_DIFFERENCES if bends.size else 0.0
    return "rest" if abs(float(head[0])) <= max(REST_SPAN * float(span), REST_NOISE * noise_v) else "in_motion"


def _time_base(table: Table, asked: Asked, signals: dict[str, Samples]) -> tuple[TimeBase, Gaps]:
    """Return the clock of the rows that were read, and its gaps."""
    first, rate_hz = asked.first_row, asked.rate_hz
    if asked.time is not None:
        base, gaps = clock(signals["time"], lambda row: table.place(first + row), gaps=asked.gaps_lost)
        _check_rate(table, "time column", base.rate_hz, rate_hz)
        return TimeBase(base.start_s, rate_hz or base.rate_hz), gaps
    told = table.clock
    if told is not None:
        _check_rate(table, "file", told.rate_hz, rate_hz)
    rate_hz = rate_hz or (told.rate_hz if told else 1.0)
    return TimeBase((told.start_s if told else 0.0) + first / rate_hz, rate_hz), NO_GAPS


def _check_rate(table: Table, what: str, found_hz: float, rate_hz: float | None) -> None:
    """Raise FileError when the rate given and that of the file are two."""
    if rate_hz is not None and abs(found_hz / rate_hz - 1.0) > RATE_AGREES:
        raise FileError(f"{what} and rate disagree", where=table.where, value=f"{found_hz:g} Hz in the file",
                        allowed=f"{rate_hz:g} Hz", do="leave one of them out")


def _origin(path: Path, asked: Asked, table: Table, rows: int) -> Origin:
    """Return where the recording comes from: the file with its checksum, and how it was understood."""
    with path.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    wanted = asked.columns()
    columns = {"input": "u", "output": "y", "time": "time", "measured_input": "u_measured"}
    named = {key: wanted[name].column if name in wanted else "" for key, name in columns.items()}
    converted = [table.conversion(one.column, one.unit) for one in wanted.values()]
    understood = "; ".join(filter(None, [*table.remarks, *converted]))
    settings = named | {"rows": f"{asked.first_row}:{asked.first_row + rows}", "source_sha256": digest}
    equipment = Equipment(address=str(path), model="imported", settings=settings | {"understood": understood})
    return Origin(equipment, software(), git_commit(), started=now(), finished=now())


def _stem(path: Path) -> str:
    """Return the name without ``.csv`` or ``.csv.gz``."""
    return Path(path.stem).stem if path.suffix.lower() == ".gz" else path.stem
