"""Does a recording open, with all that was acknowledged, whenever its program is killed?

    python -m tests.benchmarks.killed_writer 200           # kills, over all phases of writing
    python -m tests.benchmarks.killed_writer 50 swmr       # the same of HDF5's own single writer, multiple readers

A process creates a recording where an earlier one stands, appends to it in blocks of any size, and finishes it. It is
killed (SIGKILL) at a random moment of the processor's time it spends in a phase: while the file is created, while it
grows, while it is finished and moved. What it reported to have written before must be there, to the last bit; plain
h5py must open the file, and `rig verify` must call it intact. ``swmr`` writes chunked datasets with a flush after every
block instead.
"""

import ctypes
import random
import signal
import struct
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path

import h5py
import numpy as np

from rig.errors import FileError
from rig.plan import Limits, Plan
from rig.recorded import Entry, Equipment
from rig.recording import Writer, read
from rig.verifying import verify

PHASES = ("creating", "growing", "finishing")
SIZE = 200_000
BLOCKS = (1, 4_000)  # samples
EARLIER = "an earlier recording"
MEMORY = Path("/dev/shm")
"""Where there is a file system in memory it is used: a kill leaves the same there, and no disk is waited for."""
CPU_CLOCK = 2  # CLOCK_PROCESS_CPUTIME_ID
Say = Callable[[object], None]
Write = Callable[[str, Say, int], None]


@dataclass(frozen=True)
class Killed:
    """One kill: what was acknowledged before, what is there, and what is wrong with it, empty when nothing is."""

    phase: str
    acknowledged: int
    there: int
    reason: str
    wrong: str
    left: bool = False


def y_of(size: int, seed: int) -> np.ndarray:
    """Return the readings of a run."""
    return np.random.default_rng(seed).standard_normal(size)


def blocks_of(size: int, seed: int) -> Iterator[tuple[int, int]]:
    """Yield stretches of any length; between some of them samples are lost."""
    drawn, start = random.Random(seed), 0
    while start < size:
        stop = min(start + drawn.randint(*BLOCKS), size)
        yield start, stop
        start = min(stop + drawn.choice([0, 0, 0, 7]), size)


def write_recording(path: str, say: Say, seed: int) -> None:
    """Record a run in place of the earlier one, and say how far it is."""
    plan, y = Plan("killed", np.zeros(SIZE), 1e4, (), Limits(-1, 1)), y_of(SIZE, seed)
    say("creating")
    writer = Writer(path, plan, Equipment("loopback:"), overwrite=True)
    say("growing")
    for start, stop in blocks_of(SIZE, seed):
        writer.append(start, y[start:stop])
        say(stop)
    say("finishing")
    writer.finish(True, "all there")
    say("done")


def write_swmr(path: str, say: Say, seed: int) -> None:
    """Do the same with HDF5's own mode for files that are read while they grow."""
    y = y_of(SIZE, seed)
    say("creating")
    with h5py.File(path, "w", libver="latest") as file:
        dataset = file.create_dataset("y", (0,), np.float64, maxshape=(None,), chunks=(1 << 13,))
        file.swmr_mode = True
        say("growing")
        for start, stop in blocks_of(SIZE, seed):
            dataset.resize((stop,))
            dataset[start:stop] = y[start:stop]
            dataset.flush()
            say(stop)
        say("finishing")
    say("done")


def killed_in(phase: str, after_s: float, reports: Connection, write: Write, path: str, seed: int) -> None:
    """Write until SIGKILL comes, ``after_s`` of the processor's time after ``phase`` began; never without a phase."""
    def say(what: object) -> None:
        reports.send((what, time.process_time()))
        if what == phase:
            die_in(after_s)

    write(path, say, seed)


def die_in(seconds: float) -> None:
    """Have the system send SIGKILL to this process after so much of its processor's time."""
    system = ctypes.CDLL(None, use_errno=True)
    timer, event = ctypes.c_void_p(), struct.pack("qii48x", 0, signal.SIGKILL, 0)
    whole, nano = divmod(max(1, int(1e9 * seconds)), 10**9)
    if system.timer_create(CPU_CLOCK, event, ctypes.byref(timer)) or system.timer_settime(
        timer, 0, struct.pack("qqqq", 0, 0, whole, nano), None):
        raise OSError(ctypes.get_errno(), "no timer")


def kills(count: int, write: Write = write_recording, seed: int = 0) -> Iterator[Killed]:
    """Kill ``count`` writers, the phases in turn."""
    drawn = random.Random(seed)
    context = get_context("forkserver")
    context.set_forkserver_preload(["rig.verifying"])
    with tempfile.TemporaryDirectory(dir=MEMORY if MEMORY.is_dir() else None) as folder:
        path = Path(folder) / "run.h5"
        lasts_s = lengths(context, path, write)
        for number in range(count):
            phase = PHASES[number % len(PHASES)]
            earlier(path)
            after_s = drawn.uniform(0.0, lasts_s[phase])
            reports = [said for said, _ in reports_of(context, path, write, number, phase, after_s)]
            yield (looked_at if write is write_recording else looked_at_swmr)(path, number, reports)
            Path(f"{path}.part").unlink(missing_ok=True)


def earlier(path: Path) -> None:
    """Put a finished recording where the run is to be."""
    with Writer(path, Plan(EARLIER, np.zeros(9), 1e4, (), Limits(-1, 1)), Equipment("x"), overwrite=True) as writer:
        writer.append(0, np.ones(9))
        writer.finish(True, EARLIER)


def lengths(context: object, path: Path, write: Write) -> dict[str, float]:
    """Return how much of the processor's time each phase takes, s, of a run that nobody kills, the second of two."""
    for number in range(2):
        earlier(path)
        times = [told for told in reports_of(context, path, write, number, "", 0.0) if isinstance(told[0], str)]
    return {said: after - at for (said, at), (_, after) in pairwise(times)}


def reports_of(
    context: object, path: Path, write: Write, seed: int, phase: str, after_s: float,
) -> list[tuple[object, float]]:
    """Return all that a writer said until its end, and when, s of its processor's time."""
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=killed_in, args=(phase, after_s, sender, write, str(path), seed))
    process.start()
    sender.close()
    said = []
    with suppress(EOFError):
        while True:
            said.append(receiver.recv())
    process.join()
    return said


def looked_at(path: Path, seed: int, reports: list[object]) -> Killed:
    """Return what is left of a run, and what is wrong with it."""
    acknowledged = max((said for said in reports if isinstance(said, int)), default=0)
    phase = next((name for name in ("done", *reversed(PHASES)) if name in reports), "starting")
    left = Path(f"{path}.part").exists()
    try:
        with h5py.File(path, "r") as file:
            file["y"][:]
        found, verified = read(path), verify(path)
    except (FileError, OSError, KeyError) as error:
        return Killed(phase, acknowledged, 0, "", f"does not open: {error}", left)
    if not verified.intact:
        return Killed(phase, acknowledged, 0, found.reason, f"not intact: {verified.findings}", left)
    if found.title == EARLIER:
        return Killed(phase, acknowledged, 0, found.reason, "lost" if "growing" in reports else "", left)
    return Killed(phase, acknowledged, *compared(found, seed, acknowledged), left)


def compared(found: object, seed: int, acknowledged: int) -> tuple[int, str, str]:
    """Return how far a recording goes, its reason, and how it differs from what was sent."""
    expected = np.full(SIZE, Entry.NOT_RECEIVED, dtype=np.uint8)
    there = int(np.flatnonzero(found.ledger)[-1]) + 1 if found.ledger.any() else 0
    expected[:there] = Entry.LOST
    for start, stop in blocks_of(SIZE, seed):
        expected[start : max(start, min(stop, there))] = Entry.RECORDED
    y = np.where(expected == Entry.RECORDED, y_of(SIZE, seed), np.nan)
    same = np.array_equal(found.ledger, expected) and np.array_equal(found.y[:], y, equal_nan=True)
    wrong = "" if same and there >= acknowledged else f"{there} of {acknowledged} acknowledged, as sent: {same}"
    told = found.complete == (found.reason == "all there")
    return there, found.reason, wrong if told else f"complete: {found.complete}, because: {found.reason}"


def looked_at_swmr(path: Path, seed: int, reports: list[object]) -> Killed:
    """Return what is left of a file in HDF5's own mode."""
    acknowledged = max((said for said in reports if isinstance(said, int)), default=0)
    phase = next((name for name in ("done", *reversed(PHASES)) if name in reports), "starting")
    try:
        with h5py.File(path, "r") as file:
            y = file["y"][:]
    except (OSError, KeyError) as error:
        return Killed(phase, acknowledged, 0, "", str(error).partition("(")[2][:70])
    if "growing" in reports and y.size < acknowledged:
        return Killed(phase, acknowledged, y.size, "", "samples lost")
    return Killed(phase, acknowledged, y.size, "", "")


def table(found: list[Killed]) -> str:
    """Return the figures of all kills."""
    lines = [f"{len(found)} kills, {sum(not one.wrong for one in found)} files open with all that was acknowledged", "",
             "| killed while | kills | good | samples acknowledged | there | left a part beside |",
             "|---|---|---|---|---|---|"]
    for phase in ("starting", *PHASES, "done"):
        ours = [one for one in found if one.phase == phase]
        if ours:
            lines.append(f"| {phase} | {len(ours)} | {sum(not one.wrong for one in ours)} | "
                         f"{sum(one.acknowledged for one in ours)} | {sum(one.there for one in ours)} | "
                         f"{sum(one.left for one in ours)} |")
    reasons = sorted({one.reason for one in found if one.reason})
    return "\n".join([*lines, "", f"reasons: {'; '.join(reasons)}",
                      *sorted({f"WRONG while {one.phase}: {one.wrong}" for one in found if one.wrong})])


if __name__ == "__main__":
    everything = []
    for one in kills(int(sys.argv[1]), write_swmr if "swmr" in sys.argv[2:] else write_recording):
        everything.append(one)
        print(f"{len(everything):3} {one.phase}: {one.acknowledged} acknowledged, {one.there} there", flush=True)
    print(table(everything))
    sys.exit(any(one.wrong for one in everything))
