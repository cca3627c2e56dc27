"""How fast are many recordings identified, and is none of them lost or done twice when a batch or a worker is killed?

    python -m tests.benchmarks.batch 10000                  # recordings; 2 processes
    python -m tests.benchmarks.batch 400 --workers 4

The recordings are small: 800 samples of a sine through a rig with a gap, of other noise and borders each, by the
integrator of `tests/proof`. Every figure is of ``rig batch`` in a process of its own:

- one process and several on the same recordings, by the clock, from the first answer on the disk to the last;
- a batch that is killed (SIGKILL) when half the answers are there, and typed again;
- a Dask LocalCluster, its workers' profiler off, of which a worker is killed when a third of them is there.

All three must end with the same answers, to the last byte.
"""

import argparse
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from identify.trace import Step
from rig.recorded import Equipment, Origin, Recording, complete_ledger
from rig.recording import write
from tests.proof.integrator import Grid, between, held, linear_block, play, read_at

COUNT = 400
RATE_HZ, SAMPLES, SUBSTEPS = 500.0, 800, 8
AMPLITUDE_V, NOISE_V = 3.0, 0.01
LOOK_S = 0.5  # how often answers are counted: a look at thousands takes a core some ten milliseconds
G1, G2 = ((50.0,), (1.0, 50.0)), ((200.0,), (1.0, 200.0))
RIG = """\
spec: 1
rig: small
G1: {num: [50], den: [1, 50]}
F: {backlash: {S_L: 2, D_L: 1 V, S_U: 2, D_U: -1 V}}
G2: {num: [200], den: [1, 200]}
noise: 10 mV
"""
FOLDER = Path(__file__).parents[2]


def record(path: Path, seed: int) -> None:
    """Write a small recording, its borders within 5 % of the rig file's."""
    random, grid = np.random.default_rng(seed), Grid(RATE_HZ, SAMPLES, SUBSTEPS)
    s_l, d_l, s_u, d_u = np.array([2.0, 1.0, 2.0, -1.0]) * random.uniform(0.95, 1.05, 4)
    u = AMPLITUDE_V * np.sin(2.0 * np.pi * np.arange(SAMPLES) * 8.0 / SAMPLES)
    v = linear_block(held(u, grid), *G1, grid.step_s)
    w = play(s_l * (v - d_l), s_u * (v - d_u), 0.0, 1.0, 0.0)
    y = read_at(linear_block(between(w), *G2, grid.step_s), grid) + NOISE_V * random.standard_normal(SAMPLES)
    half = SAMPLES // 2
    steps = (Step("sine", "sine", 0, half, 0), Step("sine", "sine", half, SAMPLES, 1))
    origin = Origin(Equipment("simulated:"), started="2026-01-01T00:00:00+00:00", finished="2026-01-01T00:00:02+00:00")
    write(path, Recording(path.stem, RATE_HZ, u, y, complete_ledger(SAMPLES), origin, rig_text=RIG, steps=steps))


def recordings(folder: Path, count: int) -> None:
    """Write so many recordings."""
    folder.mkdir()
    for number in range(count):
        record(folder / f"r{number:05d}.h5", number)


def command(runs: Path, out: Path, *options: str) -> subprocess.Popen[str]:
    """Start ``rig batch --job identify`` on all recordings."""
    line = [sys.executable, "-m", "rig.cli", "batch", f"{runs}/*.h5", "--job", "identify", "--out", str(out), *options]
    return subprocess.Popen(line, env={**os.environ, "PYTHONPATH": str(FOLDER)}, stdout=subprocess.PIPE, text=True)


@dataclass(frozen=True)
class Done:
    """What a batch left: seconds between first and last answer, what was answered now and before, and every answer."""

    seconds: float
    now: int
    before: int
    failed: int
    answers: dict[str, bytes]

    @property
    def rate(self) -> float:
        """Return answers a second."""
        return (len(self.answers) - 1) / self.seconds


def ended(run: subprocess.Popen[str], out: Path) -> Done:
    """Return what a batch left when it has ended."""
    told = run.communicate()[0]
    found = re.search(r"recordings: (\d+) answered now.*?, (\d+) before, (\d+) failed", told)
    assert found, told
    stamps = sorted(path.stat().st_mtime for path in out.glob("*.json"))
    answers = {path.name: path.read_bytes() for path in out.glob("*.json")}
    return Done(stamps[-1] - stamps[0], *map(int, found.groups()), answers)


def when(count: int, out: Path, run: subprocess.Popen[str], do: Callable[[], object]) -> bool:
    """Call ``do`` when so many answers are there; return whether the batch was still going on."""
    while sum(name.suffix == ".json" for name in out.glob("r*")) < count:
        if run.poll() is not None:
            return False
        time.sleep(LOOK_S)
    do()
    return True


def killed_and_resumed(runs: Path, out: Path, count: int, workers: int) -> tuple[int, int, Done]:
    """Return how many answers there were after the kill, how many of them were done twice, and the end."""
    run = command(runs, out, "--workers", str(workers))
    assert when(count // 2, out, run, lambda: run.send_signal(signal.SIGKILL)), "the batch ended before it was killed"
    run.communicate()
    before = {path: path.stat().st_mtime_ns for path in out.glob("*.json")}
    done = ended(command(runs, out, "--workers", str(workers)), out)
    return len(before), sum(path.stat().st_mtime_ns != stamp for path, stamp in before.items()), done


def on_cluster(runs: Path, out: Path, count: int, workers: int) -> Done:
    """Return what a batch on a local Dask cluster left, one of whose workers was killed on the way."""
    import dask
    from distributed import LocalCluster

    dask.config.set({"distributed.worker.profile.enabled": False})  # as rig/README.md advises
    with LocalCluster(n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=":0") as cluster:
        victim = next(iter(cluster.workers.values())).pid
        run = command(runs, out, "--scheduler", cluster.scheduler_address)
        assert when(count // 3, out, run, lambda: os.kill(victim, signal.SIGKILL)), "the batch ended before the kill"
        return ended(run, out)


def main(words: list[str]) -> None:
    asked = argparse.ArgumentParser()
    asked.add_argument("count", type=int, nargs="?", default=COUNT)
    asked.add_argument("--workers", type=int, default=2)
    given = asked.parse_args(words)
    count, workers = given.count, given.workers
    with tempfile.TemporaryDirectory(dir=os.environ.get("BATCH_FOLDER")) as folder:
        runs, out = Path(folder) / "runs", [Path(folder) / name for name in ("one", "several", "killed", "cluster")]
        recordings(runs, count)
        print(f"{count} recordings, load average {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
        several = ended(command(runs, out[1], "--workers", str(workers)), out[1])
        one = ended(command(runs, out[0], "--workers", "1"), out[0])
        share = several.rate / (workers * one.rate)
        print(f"  1 process: {one.rate:.2f}/s; {workers}: {several.rate:.2f}/s, {share:.1%} of {workers} times that")
        there, twice, resumed = killed_and_resumed(runs, out[2], count, workers)
        print(f"  killed at {there}: {resumed.now} answered after, {twice} done twice, {resumed.failed} failed")
        cluster = on_cluster(runs, out[3], count, workers)
        print(f"  Dask, a worker killed: {cluster.rate:.2f}/s, {cluster.now} answered, {cluster.failed} failed")
        same = [done.answers == one.answers for done in (several, resumed, cluster)]
        print(f"  {len(one.answers)} answers, the same bytes: several {same[0]}, killed {same[1]}, cluster {same[2]}")


if __name__ == "__main__":
    main(sys.argv[1:])
