"""Is the output safe when the program that plays is killed, and left alone when it is none of a guardian's business?"""

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Timer

import numpy as np
import pytest

from rig import guardian, ownership
from rig.device import Device
from rig.errors import DeviceError
from rig.guardian import Order, make_safe
from rig.recording import Entry, read
from rig.registry import connect, driver_at
from rig.runner import Outcome, run
from tests.benchmarks.killed_runner import KEPT_S, kill
from tests.rigs import GAIN
from tests.wire.emulated import Emulated, emulated
from tests.wire.host import long_plan, short_plan
from tests.wire.waiting import eventually

ROOT = Path(__file__).parents[2]
SAFE_V = pytest.approx(1.0, abs=1e-3)
NEVER = 1e9


class Nowhere:
    """A recording nobody keeps."""

    def append(self, start: int, y: np.ndarray, further: np.ndarray) -> None:
        pass


def guardian_of(program: int) -> int:
    """Return the process that was posted by ``program``."""
    posted = [int(child) for child in Path(f"/proc/{program}/task/{program}/children").read_text().split()]
    return next(child for child in posted if b"rig.guardian" in Path(f"/proc/{child}/cmdline").read_bytes())


@contextmanager
def played(bench: Emulated, path: Path) -> Iterator[subprocess.Popen[str]]:
    """Give a program in the middle of a run at 5 V."""
    command = [sys.executable, "-m", "tests.wire.host", bench.address, str(path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=ROOT) as host:
        assert host.stdout is not None
        while int(host.stdout.readline()) < 500:
            pass
        yield host
        host.kill()


@pytest.mark.parametrize(("kind", "at_s"), [("serial", 0.4), ("redpitaya", 0.7), ("u2300a", 0.2)])
def test_a_killed_run_ends_safe_and_recorded_without_any_watchdog(tmp_path: Path, kind: str, at_s: float) -> None:
    """A share of the fifty of ``tests/benchmarks/killed_runner.py``, which asks for half a second: here others work."""
    with emulated(GAIN, kind=kind, watchdog_s=NEVER) as bench:
        run = kill(bench, tmp_path / "run.h5", at_s)
        assert run.level_v is not None
        assert abs(run.level_v) > 0.15, "there was nothing to make safe"
        assert np.isfinite(run.safe_s), run
        assert run.missing_s <= KEPT_S, run


def test_where_the_guardian_is_killed_too_the_watchdog_acts(tmp_path: Path) -> None:
    with emulated(GAIN, watchdog_s=0.5) as bench, played(bench, tmp_path / "run.h5") as host:
        os.kill(guardian_of(host.pid), signal.SIGKILL)
        os.kill(host.pid, signal.SIGKILL)
        host.wait(5)
        assert eventually(lambda: bench.look().level_v == SAFE_V, 2.0)
        assert bench.look().watchdog_tripped
        assert not bench.look().underrun, "the FIFO ran empty: the watchdog was not needed"
    recording = read(tmp_path / "run.h5")
    assert not recording.complete
    assert (recording.ledger == Entry.RECORDED).sum() >= 500


def test_a_guardian_outlives_signals_and_holds_the_port_over_the_death_of_the_program(tmp_path: Path) -> None:
    with emulated(GAIN, watchdog_s=NEVER) as bench, played(bench, tmp_path / "run.h5") as host:
        watching = guardian_of(host.pid)
        assert os.getpgid(watching) != os.getpgid(host.pid), "Ctrl-C at the terminal would reach it"
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGSTOP):
            os.kill(watching, number)
        os.kill(host.pid, signal.SIGKILL)
        host.wait(5)
        with pytest.raises(DeviceError, match=r"in use: by process .*one program at a time"):
            connect(bench.address)
        assert bench.look().level_v == pytest.approx(5.0, abs=1e-3)
        os.kill(watching, signal.SIGCONT)
        assert eventually(lambda: bench.look().level_v == SAFE_V, 2.0)


def test_a_program_that_dies_before_it_played_leaves_the_output_as_it_was() -> None:
    program = ("import os, sys; from rig import guardian, registry; device = registry.connect(sys.argv[1]); "
               "posted = guardian.post(device); posted.ready(); os.abort()")
    with emulated(GAIN, watchdog_s=NEVER) as bench:
        with connect(bench.address) as device:
            device.safe(4.0, 0.0)
        ended = subprocess.run(
            [sys.executable, "-c", program, bench.address], check=False, cwd=ROOT, capture_output=True, text=True)
        assert ended.returncode == -signal.SIGABRT, ended.stderr
        with connect(bench.address) as device:  # waits for the lock: the guardian is gone by now
            assert device.level_v() == pytest.approx(4.0, abs=1e-3)
        assert "guardian:" not in ended.stderr


def test_a_run_that_ended_well_leaves_nobody_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "re.py").write_text("raise ImportError('a file of the operator hides a module of Python')")
    monkeypatch.syspath_prepend(tmp_path)
    with emulated(GAIN, speed=3) as bench:
        outcome = _run(bench)
        assert outcome.complete
        assert "guardian" not in [event.kind for event in outcome.events]
        with pytest.raises(StopIteration):
            guardian_of(os.getpid())


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_a_guardian_that_dies_or_hangs_in_a_run_is_told_and_does_not_hold_up_the_ramp(number: signal.Signals) -> None:
    with emulated(GAIN, speed=3) as bench:
        outcome = _run(bench, lambda done, total: _to_guardian(number) if 0 < done < total else None)
        assert outcome.complete
        assert outcome.events[-1].kind == "guardian"
        assert "did not watch over all of it" in outcome.events[-1].text
        assert bench.look().level_v == SAFE_V


def test_another_device_at_the_address_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(guardian, "TRY_FOR_S", 0.2)
    with emulated(GAIN) as bench:
        kind, where = driver_at(bench.address)
        port = kind.port(where)
        assert port is not None
        claim = ownership.claim(port)
        with pytest.raises(DeviceError, match="another device answers"):
            make_safe(bench.address, "the one that was pulled", claim, Order(3.0, 0.1))
        assert bench.look().level_v is None
        claim.release()


def test_whatever_is_put_out_is_watched_over_once_a_guardian_is_posted() -> None:
    program = ("import os, sys, numpy; from rig import guardian, registry; from rig.limits import Limits; "
               "device = registry.connect(sys.argv[1]); guardian.post(device); "
               "blocks = device.stream(numpy.full(50_000, 5.0), 10_000.0, Limits(-10.0, 10.0), 1.0); "
               "[next(blocks) for _ in range(20)]; os.abort()")
    with emulated(GAIN, watchdog_s=NEVER) as bench:
        ended = subprocess.run(
            [sys.executable, "-c", program, bench.address], check=False, cwd=ROOT, capture_output=True, text=True)
        assert ended.returncode == -signal.SIGABRT, ended.stderr
        assert "was brought to 1 V" in ended.stderr
        assert bench.look().level_v == SAFE_V


def test_a_run_without_a_guardian_is_not_begun(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", "/nowhere/python")
    with emulated(GAIN) as bench:
        with connect(bench.address) as device, pytest.raises(DeviceError, match="no guardian can be started"):
            run(long_plan(), device, Nowhere())
        assert bench.look().level_v is None


def test_a_guardian_that_stands_still_for_a_while_before_a_run_is_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(guardian, "ANSWER_S", 0.1)
    with emulated(GAIN, speed=3) as bench, _one_that_stands_still(bench) as (device, watching):
        Timer(0.5, os.kill, (watching, signal.SIGCONT)).start()
        outcome = run(short_plan(), device, Nowhere())
        assert outcome.complete
        assert "guardian" not in [event.kind for event in outcome.events]


def test_nothing_is_played_under_a_guardian_that_does_not_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    with emulated(GAIN) as bench, _one_that_stands_still(bench) as (device, _):
        monkeypatch.setattr(guardian, "READY_S", 0.3)
        outcome = run(short_plan(), device, Nowhere())
        assert "the guardian does not answer" in outcome.reason
        look = bench.look()
        assert (look.played, look.level_v) == (0, SAFE_V)


@contextmanager
def _one_that_stands_still(bench: Emulated) -> Iterator[tuple[Device, int]]:
    """Connect, post a guardian that is ready, and stop it; yield the device and the number of its process."""
    with connect(bench.address) as device:
        posted = guardian.post(device)
        assert posted is not None
        posted.ready()
        watching = guardian_of(os.getpid())
        os.kill(watching, signal.SIGSTOP)
        yield device, watching


def _run(bench: Emulated, progress: Callable[[int, int], None] = lambda done, total: None) -> Outcome:
    with connect(bench.address) as device:
        return run(short_plan(), device, Nowhere(), progress)


def _to_guardian(number: signal.Signals) -> None:
    try:
        os.kill(guardian_of(os.getpid()), number)
    except (StopIteration, FileNotFoundError):
        return
