"""How is one case of the matrix played, and what of its end must not be?"""

import os
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig import session
from rig.device import Array
from rig.errors import DeviceError, IncompleteError, RigError, StarvedError
from rig.ownership import FOLDER_VARIABLE
from rig.recording import Entry, read
from tests.rigs import GAIN
from tests.wire.emulated import CONTEXT, Emulated, emulated
from tests.wire.matrix.case import Case, End, Ended, Output, Verdict

WAVES = """
spec: 1
title: waves
question: What becomes of them on a link that fails?
limits: {{level: {amplitude_v} V}}
acquisition: {{rate: {rate_hz} Hz}}
safe_level: {safe_level_v} V
ramp: 0.1 s
steps:
  - sine: {{frequency: 7 Hz, amplitude: {amplitude_v} V, periods: 7}}
"""
DEADLINE_S = 40.0
"""From the start of the program to its end. The run takes 1 s at most; the rest is what waiting may add up to."""
COME_TO_REST_S = 5.0
"""The watchdog of a device that was left alone acts after 2 s, and ramps."""


def by_emulator(kind: str, case: Case) -> AbstractContextManager[Emulated]:
    """Return the emulated device of a kind in front of GAIN, with the faults of the case."""
    return emulated(GAIN, kind=kind, speed=case.speed, faults=case.faults, **case.hardware)


Made = Callable[[str, Case], AbstractContextManager[Any]]
"""Offers a device with an ``address``; ``look()`` tells its ``level_v`` and how often each fault ``struck``."""


@dataclass(frozen=True)
class Bench:
    """A kind of device to be tried: its faults, what to play on it, and what must come back, to half an ``lsb_v``.

    ``at_once`` are the cases that may be played side by side: as many as mostly wait.
    """

    kind: str
    cases: tuple[Case, ...]
    amplitude_v: float
    safe_level_v: float
    lsb_v: float
    rate_hz: float = 10_000.0
    made: Made = by_emulator
    at_once: int = 4

    def protocol(self) -> str:
        """Return what is played: a second of a sine."""
        return WAVES.format(amplitude_v=self.amplitude_v, safe_level_v=self.safe_level_v, rate_hz=self.rate_hz)

    def off(self, u: Array, y: Array) -> NDArray[np.bool_]:
        """Return which samples are not what GAIN answers to ``u``: y[k] is read before u[k] acts, the first at 0 V."""
        expected = 3.0 * np.concatenate([[0.0], u[:-1]])
        return np.asarray(~(np.abs(y - expected) <= 0.5001 * self.lsb_v))


def play(bench: Bench, case: Case) -> Verdict:
    """Play ``case`` from connecting to closing, in a process of its own, and judge how it ended."""
    with TemporaryDirectory() as folder, bench.made(bench.kind, case) as device:
        path = Path(folder) / "run.h5"
        ended, seconds = _hosted(device.address, bench.protocol(), path, case)
        output = _output(device, bench.safe_level_v, ended)
        seen = device.look()
        kept, total, wrong_samples = _kept(path, bench)
    wrong = _wrong(case, ended, output, seen.struck, (wrong_samples, kept, total))
    return Verdict(ended, output, kept, total, seconds, sum(seen.struck), seen.said, wrong)


def _hosted(address: str, protocol: str, path: Path, case: Case) -> tuple[Ended, float]:
    """Run the program; return how it ended and how long it took."""
    here, there = CONTEXT.Pipe()
    process = CONTEXT.Process(target=_record, args=(there, address, protocol, path, case.naps))
    begun = time.monotonic()
    process.start()
    there.close()
    try:
        ended = here.recv() if here.poll(DEADLINE_S) else Ended(End.HUNG, f"no end after {DEADLINE_S:g} s")
    except EOFError:
        ended = Ended(End.CRASHED, "the program ended without a word")
    took_s = time.monotonic() - begun
    process.join(5)
    if process.is_alive():
        process.kill()
        process.join()
    return ended, took_s


def _record(pipe: Connection, address: str, protocol: str, path: Path, naps: tuple[tuple[int, float], ...]) -> None:
    """Be the program: record, and tell how that ended."""
    text = path.with_suffix(".yaml")
    text.write_text(protocol)
    os.environ[FOLDER_VARIABLE] = str(path.parent)  # the numbers of ptys are used again while a guardian has one
    left = list(naps)

    def progress(done: int, total: int) -> None:
        if left and done > left[0][0]:
            time.sleep(left.pop(0)[1])

    try:
        outcome = session.record(text, address, path, progress).outcome
    except RigError as error:
        pipe.send(Ended(End.REFUSED, str(error)))
        return
    events = tuple(f"{event.kind}: {event.text}" for event in outcome.events)
    ends = {type(None): End.WHOLE, IncompleteError: End.GAPS, DeviceError: End.FAILED, StarvedError: End.FAILED}
    pipe.send(Ended(ends[type(outcome.failure)], outcome.reason, events))


def _output(device: Any, safe_level_v: float, ended: Ended) -> Output:
    """Return where the output comes to rest, by the device itself."""
    deadline = time.monotonic() + COME_TO_REST_S
    while True:
        level = device.look().level_v
        if level is None:
            return Output.NONE
        if abs(level - safe_level_v) < 1e-3:
            return Output.SAFE
        if time.monotonic() > deadline or ended.end is End.WHOLE:
            return Output.TOLD if "not confirmed safe" in ended.reason else Output.UNSAFE
        time.sleep(0.02)


def _kept(path: Path, bench: Bench) -> tuple[int, int, int]:
    """Return how many samples are recorded, of how many, and how many of them are wrong."""
    if not path.exists():
        return 0, 0, 0
    recording = read(path)
    here = recording.ledger == Entry.RECORDED
    made_up = ~here & ~np.isnan(recording.y)
    return int(here.sum()), here.size, int((here & bench.off(recording.u, recording.y)).sum() + made_up.sum())


def _wrong(
    case: Case, ended: Ended, output: Output, struck: tuple[int, ...], samples: tuple[int, int, int],
) -> tuple[str, ...]:
    """Return a sentence for everything that is not as it must be; ``samples`` are those wrong, kept and played."""
    wrong_samples, kept, total = samples
    found: dict[str, Any] = {
        f"ended {ended.end.value}": not case.ends(ended.end),
        f"does not say {case.says!r}": not case.told(" ".join([ended.reason, *ended.events])),
        f"{wrong_samples} wrong samples": wrong_samples,
        f"output {output.value}": not case.leaves(output),
        f"whole with {kept} of {total} samples": ended.end is End.WHOLE and not 0 < kept == total,
        "the fault did not happen": case.strikes and not all(struck),
        f"{kept} samples kept, not {case.keeps} or more": kept < case.keeps,
    }
    return tuple(sentence for sentence, true in found.items() if true)
