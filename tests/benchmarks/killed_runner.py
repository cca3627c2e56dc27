"""How soon is the output safe, and how much is recorded, when the program that plays is killed at any moment?

``python -m tests.benchmarks.killed_runner 50 serial`` kills (SIGKILL) so many runs over an emulated device on its real
link, each at a random moment from when its clock was started until 1.6 s of samples and the ramp are over. Others are
``redpitaya`` and ``u2300a``. None has a watchdog, so that nobody but the guardian makes its output safe. That is looked
at from behind, not asked over the link.
"""

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rig.amplifier import Amplifier, behind
from rig.errors import FileError
from rig.recording import Entry, read
from tests.rigs import GAIN
from tests.wire.emulated import Emulated, emulated
from tests.wire.host import short_plan

ROOT = Path(__file__).parents[2]
AMPLIFIED = {"redpitaya": Amplifier(10.0, 10.0)}
"""What stands behind the output of devices whose own range is too small for these runs."""
WITHIN_S, KEPT_S = 0.5, 0.2
"""What is asked: the output at its safe level, and the most of a recording that may be missing."""
GIVEN_UP_S = 5.0


@dataclass(frozen=True)
class Killed:
    """One run that was killed ``at_s`` after its clock was started, ``level_v`` being at the output.

    ``safe_s``: how long the output then took to its safe level, infinite where it did not get there; ``missing_s``: how
    much of what was played before is not in the recording, infinite where that cannot be read.
    """

    at_s: float
    level_v: float | None
    played: int
    safe_s: float
    missing_s: float

    @property
    def good(self) -> bool:
        """Return whether this is as asked."""
        return self.safe_s <= WITHIN_S and self.missing_s <= KEPT_S


def killed_runs(count: int, kind: str = "serial", seed: int = 0) -> Iterator[Killed]:
    """Kill ``count`` runs on one device, one after the other."""
    moments = np.random.default_rng(seed)
    plan = short_plan()
    last_s = plan.duration_s + plan.ramp_s
    with emulated(GAIN, kind=kind, watchdog_s=1e9) as bench, tempfile.TemporaryDirectory() as folder:
        for number in range(count):
            yield kill(bench, Path(folder) / f"{number}.h5", float(moments.uniform(0.0, last_s)))


def kill(bench: Emulated, path: Path, at_s: float) -> Killed:
    """Kill one run ``at_s`` after its clock was started."""
    plan = short_plan()
    amplifier = AMPLIFIED.get(bench.kind, Amplifier(1.0, 10.0))
    address = behind(bench.address, AMPLIFIED.get(bench.kind))
    command = [sys.executable, "-m", "tests.wire.host", address, str(path), "short"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=ROOT) as host:
        assert host.stdout is not None
        host.stdout.readline()  # there is a recording
        host.stdout.readline()  # the clock runs
        time.sleep(at_s)
        seen = bench.look()
        os.kill(host.pid, signal.SIGKILL)
        safe_s = until_safe(bench, plan.safe_level_v / amplifier.gain, time.monotonic())
    missing_s = (seen.played - recorded_until(path)) / plan.rate_hz
    return Killed(at_s, seen.level_v, seen.played, safe_s, max(0.0, missing_s))


def until_safe(bench: Emulated, level_v: float, since_s: float) -> float:
    """Return how long after ``since_s`` the output stood at ``level_v``, or had never been used."""
    while time.monotonic() < since_s + GIVEN_UP_S:
        seen = bench.look()
        if seen.state == "idle" and (seen.level_v is None or abs(seen.level_v - level_v) < 1e-3):
            return time.monotonic() - since_s
        time.sleep(0.002)
    return float("inf")


def recorded_until(path: Path) -> float:
    """Return up to which sample there is a recording; minus infinity when it cannot be read."""
    try:
        there = read(path).ledger == Entry.RECORDED
    except FileError:
        return float("-inf")
    return there.size - int(np.argmax(there[::-1])) if there.any() else 0


def table(runs: list[Killed]) -> str:
    """Return the figures of all runs."""
    lines = [f"{len(runs)} runs killed, {sum(run.good for run in runs)} as asked", "",
             "| | median | most | asked |", "|---|---|---|---|"]
    for name, values, asked in (("output at its safe level after", [run.safe_s for run in runs], WITHIN_S),
                                ("of the recording missing", [run.missing_s for run in runs], KEPT_S)):
        lines.append(f"| {name} | {np.median(values):.3f} s | {max(values):.3f} s | {asked} s |")
    return "\n".join(lines)


if __name__ == "__main__":
    everything = []
    count, kind = int(sys.argv[1]), sys.argv[2]
    for one in killed_runs(count, kind):
        everything.append(one)
        print(f"{len(everything):3} killed at {one.at_s:.3f} s, sample {one.played}, {one.level_v} V: "
              f"safe after {one.safe_s:.3f} s, {one.missing_s:.3f} s missing", flush=True)
    print(table(everything))
    sys.exit(not all(one.good for one in everything))
