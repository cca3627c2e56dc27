"""How much memory and time do the commands take for N samples, and are their answers right?

    python -m tests.benchmarks.large_recording 1e6 1e7 1e8
    python -m tests.benchmarks.large_recording 1e8 --only verify explain

The recording is a long staircase and two long sines at 50 kHz from the op-amp rig, parts within 5 %; the rig file has
their nominal values. Its truth comes from scipy's exact discretisations of G1 (held input) and G2 (input straight
between nodes) with the trial bench's play between them, eight nodes to a sample, a stretch at a time. What
`rig explain` gets has rails at 10 V behind the play, which the rig file does not know. Every command runs in a process
of its own.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray
from scipy.signal import cont2discrete, lfilter

from identify.trace import Step, blocks
from rig.recorded import Entry, Equipment, Origin, Recording, complete_ledger
from rig.recording import read, write
from rig.rigfile import model_to_yaml
from rig.samples import InFile
from tests.proof.integrator import play
from tests.proof.rigs import OP_AMP, Rig, toleranced
from tests.proof.stimuli import FIG13_LEVELS_V
from tests.trials import model_of

Array = NDArray[np.float64]
RATE_HZ = 50_000.0
NODES = 8  # to a sample
STRETCH = 1 << 18  # samples simulated at once
SINES = ((10.0, 3.4), (31.25, 8.0))  # Hz, V
TRUTH = toleranced(OP_AMP, seed=3, fraction=0.05)
FOLDER = Path(__file__).parents[2]
RAILS_V = 10.0
CHILD = """
import os, sys
from rig.cli import main
try:
    main()
finally:
    with open("/proc/self/status") as file:
        own = next(int(line.split()[1]) for line in file if line.startswith("VmHWM"))
    print("PEAK_KB:", own, file=sys.stderr)
    print("CPU:", sum(os.times()[:4]), file=sys.stderr)
"""
LOOK_S = 0.1
PAGE_KB = os.sysconf("SC_PAGE_SIZE") // 1024
COMMANDS = ("export", "import", "verify", "identify", "explain", "check", "run")
PROTOCOL = """\
spec: 1
title: as long as the recording
question: Is a run of any length played and recorded in the same memory?
rig: rigs/opamp_backlash.yaml
limits: {{level: 10 V}}
acquisition: {{rate: {rate:g} Hz}}
steps:
  - staircase: {{levels: [{levels}], dwell: {dwell_s!r} s}}
  - sine: {{frequency: 10 Hz, amplitude: 3.4 V, periods: {periods}}}
"""


@dataclass(frozen=True)
class Played:
    """A stretch of samples [start, stop) under one stimulus: a level of the staircase, or a sine from its zero."""

    step: Step
    level_v: float = 0.0
    frequency_hz: float = 0.0

    def u(self, start: int, stop: int) -> Array:
        """Return the samples [start, stop) of the run, which lie within."""
        if not self.frequency_hz:
            return np.full(stop - start, self.level_v)
        period = round(RATE_HZ / self.frequency_hz)
        within = np.arange(start - self.step.start, stop - self.step.start) % period
        return self.level_v * np.sin(2.0 * np.pi * within / period)


def schedule(samples: int) -> list[Played]:
    """Return what is played: 40 % staircase, the rest sines in whole periods, ``samples`` at most."""
    dwell, position, played = int(0.4 * samples / len(FIG13_LEVELS_V)), 0, []
    for level in FIG13_LEVELS_V:
        played.append(Played(Step("staircase", "staircase", position, position + dwell), level))
        position += dwell
    for frequency, amplitude in SINES:
        period = round(RATE_HZ / frequency)
        stop = position + max(int(0.3 * samples) // period, 3) * period
        played.append(Played(Step(f"sine {frequency} Hz", "sine", position, stop), amplitude, frequency))
        position = stop
    return played


def stretches(samples: int) -> Iterator[Array]:
    """Yield u of the whole run, stretch by stretch."""
    for played in schedule(samples):
        for start in range(played.step.start, played.step.stop, STRETCH):
            yield played.u(start, min(start + STRETCH, played.step.stop))


def readings(
    rig: Rig, stimulus: Iterator[Array], seed: int = 0, rails_v: float = np.inf,
) -> Iterator[tuple[Array, Array]]:  # fmt: skip
    """Yield u and y, V, stretch by stretch, with white noise; the rig is at rest before.

    What F makes stops at ``rails_v`` of either sign.
    """
    step_s, random = 1.0 / (RATE_HZ * NODES), np.random.default_rng(seed)
    num1, a1, _ = cont2discrete((rig.g1_num, rig.g1_den), step_s, "zoh")
    num2, a2, _ = cont2discrete((rig.g2_num, rig.g2_den), step_s, "foh")
    z1, w, z2 = np.zeros(len(a1) - 1), 0.0, np.zeros(len(a2) - 1)
    for u in stimulus:
        v, z1 = lfilter(np.ravel(num1), a1, np.repeat(u, NODES), zi=z1)
        ws = play(rig.s_l * (v - rig.d_l_v), rig.s_u * (v - rig.d_u_v), w, 1.0, 0.0)
        x, z2 = lfilter(np.ravel(num2), a2, np.clip(ws, -rails_v, rails_v), zi=z2)
        w = float(ws[-1])
        yield u, x[::NODES] + rig.noise_v * random.standard_normal(u.size)


def record(path: Path, samples: int, rails_v: float = np.inf) -> None:
    """Write the recording of a rig whose F stops at ``rails_v``, which its rig file does not know."""
    steps = steps_of(samples)
    size = steps[-1].stop
    scratch = path.with_suffix(".scratch")
    with h5py.File(scratch, "w") as file:
        u, y = (file.create_dataset(name, size, np.float64) for name in ("u", "y"))
        position = 0
        for piece, read in readings(TRUTH, stretches(samples), rails_v=rails_v):
            u[position : position + piece.size], y[position : position + piece.size] = piece, read
            position += piece.size
    with h5py.File(scratch) as file:
        signals = {name: InFile.of(file[name]) for name in ("u", "y")}
    origin = Origin(Equipment("simulated:"), started="2026-01-01T00:00:00+00:00", finished="2026-01-02T00:00:00+00:00")
    rig_text = model_to_yaml(model_of(OP_AMP))
    ledger = complete_ledger(size)
    write(path, Recording("large", RATE_HZ, ledger=ledger, origin=origin, rig_text=rig_text, steps=steps, **signals))
    scratch.unlink()


def steps_of(samples: int) -> tuple[Step, ...]:
    """Return the steps of the run: the staircase is one."""
    played = [p.step for p in schedule(samples)]
    sines = played[len(FIG13_LEVELS_V) :]
    return (Step("staircase", "staircase", 0, sines[0].start), *sines)


@dataclass(frozen=True)
class Taken:
    """What a command in a process of its own took; the peak is that of the process and that of its children together.

    What the kernel tells of children that ended is no use: a child counts as large as its parent until it runs.
    """

    seconds: float
    cpu_seconds: float
    peak_bytes: int


def taken(*arguments: str | Path) -> Taken:
    """Run ``rig`` with these arguments in a process of its own."""
    command, begun = [sys.executable, "-c", CHILD, *map(str, arguments)], time.perf_counter()
    surroundings = {**os.environ, "PYTHONPATH": str(FOLDER)}
    children_kb = 0
    with tempfile.TemporaryFile("w+") as said:
        child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=said, env=surroundings)
        while child.poll() is None:
            children_kb = max(children_kb, _resident_kb(child.pid))
            time.sleep(LOOK_S)
        said.seek(0)
        words = said.read()
    if child.returncode:
        raise RuntimeError(words)
    seconds, own_kb, cpu = time.perf_counter() - begun, *(_told(words, key) for key in ("PEAK_KB:", "CPU:"))
    return Taken(seconds, cpu, int(1024 * (own_kb + children_kb)))


def _resident_kb(parent: int) -> int:
    """Return the resident memory of all children of a process, and theirs."""
    total = 0
    with suppress(OSError):
        for child in Path(f"/proc/{parent}/task/{parent}/children").read_text().split():
            total += _resident_kb(int(child)) + int(Path(f"/proc/{child}/statm").read_text().split()[1]) * PAGE_KB
    return total


def _told(text: str, key: str) -> float:
    return float(text.split(key)[1].split(maxsplit=1)[0])


@dataclass(frozen=True)
class Bench:
    """A folder with what the commands need and make, for so many samples."""

    folder: Path
    samples: int

    def done(self, name: str) -> tuple[Taken, list[str]]:
        """Run a command; return what it took and what its answer is worth."""
        plain, railed, protocol = self._at("large.h5"), self._at("railed.h5"), self._at("protocol.yaml")
        arguments: dict[str, list[str | Path]] = {
            "export": [plain, "--to", "npz", "--out", self._at("large.npz")],
            "import": [self._at("large.npz"), "--out", self._at("back.h5")],
            "verify": [plain],
            "identify": [plain, "--json", self._at("identify.json"), "--quiet"],
            "explain": [railed, "--json", self._at("explain.json"), "--quiet"],
            "check": [protocol],
            "run": [protocol, "--out", self._at("played.h5"), "--quiet"],
        }
        self._prepare(name)
        return taken(name, *arguments[name]), list(self._judged(name))

    def _at(self, name: str) -> Path:
        return self.folder / name

    def _prepare(self, name: str) -> None:
        """Make what a command is to look at, where it is not there yet; let go of what is no longer needed."""
        plain, railed, protocol = self._at("large.h5"), self._at("railed.h5"), self._at("protocol.yaml")
        if name in ("explain", "check", "run"):
            plain.unlink(missing_ok=True)
        elif not plain.exists():
            record(plain, self.samples)
        if name == "explain":
            record(railed, self.samples, RAILS_V)
        if name == "import" and not self._at("large.npz").exists():
            taken("export", plain, "--to", "npz", "--out", self._at("large.npz"))
        protocol.write_text(protocol_of(self.samples), encoding="utf-8")

    def _judged(self, name: str) -> Iterator[str]:
        """Yield what the answer of a command is worth."""
        if name == "import":
            yield f"  {alike(self._at('large.h5'), self._at('back.h5'))}"
            self._at("back.h5").unlink()
            self._at("large.npz").unlink()
        elif name == "identify":
            answer = json.loads(self._at("identify.json").read_text())
            yield from (*told(answer), f"  {answer['fit']}")
        elif name == "explain":
            answer = json.loads(self._at("explain.json").read_text())
            names = [effect["id"] for effect in answer["effects"]]
            yield from (f"  {answer['verdict']}: {', '.join(names)}; true: saturation at {RAILS_V:g} V",
                        *(f"  {effect['parameters']}" for effect in answer["effects"]),
                        *(f"  {warning}" for warning in answer["warnings"][:1]))
        elif name == "run":
            played = read(self._at("played.h5"))
            yield f"  {played.count(Entry.RECORDED)} of {played.u.size} samples recorded"


def alike(one: Path, other: Path) -> str:
    """Return in words whether two recordings have the same samples."""
    first, second = read(one), read(other)
    same = first.u.size == second.u.size and np.array_equal(first.ledger, second.ledger) and all(
        np.array_equal(getattr(first, name)[a:b], getattr(second, name)[a:b])
        for name in ("u", "y") for a, b in blocks(0, first.u.size)
    )  # fmt: skip
    return "the same samples, bit for bit" if same else "NOT THE SAME SAMPLES"


def protocol_of(samples: int) -> str:
    """Return a protocol of about so many samples."""
    dwell_s = max(int(0.4 * samples / len(FIG13_LEVELS_V)), 1) / RATE_HZ
    levels = ", ".join(f"{level:g} V" for level in FIG13_LEVELS_V)
    periods = max(int(0.6 * samples * 10.0 / RATE_HZ), 1)
    return PROTOCOL.format(rate=RATE_HZ, levels=levels, dwell_s=dwell_s, periods=periods)


def told(answer: dict) -> Iterator[str]:
    """Tell every border: truth, found, and how many standard errors they differ by."""
    true = {"S_L": TRUTH.s_l, "D_L": TRUTH.d_l_v, "S_U": TRUTH.s_u, "D_U": TRUTH.d_u_v}
    for name, value in true.items():
        found = answer["backlash"][name]
        sd = (found["ci95"][1] - found["ci95"][0]) / 3.92
        off = (found["value"] - value) / sd
        yield f"  {name}  true {value:.7g}  found {found['value']:.7g}  sd {sd:.1g}  off by {off:+.2f} sd"


def main(words: list[str]) -> None:
    """Print a line a command, and below it what its answer is worth."""
    parser = argparse.ArgumentParser(prog="large_recording", description=__doc__)
    parser.add_argument("samples", nargs="*", type=float, default=[1e6])
    parser.add_argument("--only", nargs="+", choices=COMMANDS, default=COMMANDS)
    asked = parser.parse_args(words)
    print(f"{'samples':>10} {'command':>9} {'time s':>8} {'CPU s':>8} {'peak MB':>8}")
    for samples in map(int, asked.samples):
        with tempfile.TemporaryDirectory(dir=os.environ.get("LARGE_RECORDING_FOLDER")) as folder:
            bench = Bench(Path(folder), samples)
            for name in (name for name in COMMANDS if name in asked.only):
                took, lines = bench.done(name)
                times = f"{took.seconds:8.1f} {took.cpu_seconds:8.1f}"
                print(f"{samples:10d} {name:>9} {times} {took.peak_bytes / 1e6:8.0f}", *lines, sep="\n", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
