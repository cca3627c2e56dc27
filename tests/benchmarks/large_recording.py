"""How much memory and time does `rig identify` take for a recording of N samples, and is its answer right?

    python -m tests.benchmarks.large_recording 1e6 1e7 1e8

The recording is a long staircase and two long sines at 50 kHz from the op-amp rig, parts within 5 %; the rig file has
their nominal values. Its truth comes from scipy's exact discretisations of G1 (held input) and G2 (input straight
between nodes) with the trial bench's play between them, eight nodes to a sample, a stretch at a time.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray
from scipy.signal import cont2discrete, lfilter

from identify.trace import Step
from rig.recorded import Equipment, Origin, Recording, complete_ledger
from rig.recording import write
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
CHILD = """
import sys, time
from rig.cli import main
try:
    main()
finally:
    with open("/proc/self/status") as file:
        print(*[line for line in file if line.startswith("VmHWM")], file=sys.stderr)
    print("CPU:", time.process_time(), file=sys.stderr)
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
class Measured:
    """What one identification in a process of its own took, and what it answered."""

    seconds: float
    cpu_seconds: float
    peak_bytes: int
    answer: dict


def identified(path: Path) -> Measured:
    """Run ``rig identify`` on a recording in a process of its own."""
    answer, begun = path.with_suffix(".json"), time.perf_counter()
    command = [sys.executable, "-c", CHILD, "identify", str(path), "--json", str(answer), "--quiet"]
    surroundings = {**os.environ, "PYTHONPATH": str(FOLDER)}
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=surroundings)
    if done.returncode:
        raise RuntimeError(done.stderr)
    seconds, peak_kb, cpu = time.perf_counter() - begun, *(_told(done.stderr, key) for key in ("VmHWM:", "CPU:"))
    return Measured(seconds, cpu, int(1024 * peak_kb), json.loads(answer.read_text()))


def _told(text: str, key: str) -> float:
    return float(text.split(key)[1].split(maxsplit=1)[0])


def told(answer: dict) -> Iterator[str]:
    """Tell every border: truth, found, and how many standard errors they differ by."""
    true = {"S_L": TRUTH.s_l, "D_L": TRUTH.d_l_v, "S_U": TRUTH.s_u, "D_U": TRUTH.d_u_v}
    for name, value in true.items():
        found = answer["backlash"][name]
        sd = (found["ci95"][1] - found["ci95"][0]) / 3.92
        off = (found["value"] - value) / sd
        yield f"  {name}  true {value:.7g}  found {found['value']:.7g}  sd {sd:.1g}  off by {off:+.2f} sd"


def main(sizes: list[str]) -> None:
    print(f"{'samples':>10} {'time s':>8} {'CPU s':>8} {'peak MB':>8}")
    for samples in (int(float(size)) for size in sizes or ["1e6"]):
        with tempfile.TemporaryDirectory(dir=os.environ.get("LARGE_RECORDING_FOLDER")) as folder:
            path = Path(folder) / "large.h5"
            record(path, samples)
            found = identified(path)
        print(f"{samples:10d} {found.seconds:8.1f} {found.cpu_seconds:8.1f} {found.peak_bytes / 1e6:8.0f}")
        print(*told(found.answer), f"  {found.answer['fit']}", sep="\n", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
