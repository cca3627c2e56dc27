"""Does one test file run on the mock and on an emulator, the output left safe whatever a test does?"""

import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from rig import pytest_plugin
from tests.architecture.house import ROOT
from tests.flow.console import start
from tests.rigs import QUIET
from tests.wire.emulated import emulated

EXAMPLE = ROOT / "tests" / "hardware"


def typed(*arguments: str | Path, cwd: Path = ROOT) -> subprocess.CompletedProcess[str]:
    """Run pytest with its plug-ins as installed."""
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-rs", "--no-cov", "-p", "no:cacheprovider", *map(str, arguments)],
        cwd=cwd, capture_output=True, text=True, timeout=100, check=False)  # fmt: skip


def test_the_example_runs_on_an_emulator_and_skips_what_needs_hardware() -> None:
    ended = typed("-v", "--rig-device", "emulated:serial", EXAMPLE)
    assert ended.returncode == 0, ended.stdout
    assert "rig device: emulated:serial" in ended.stdout
    assert "2 passed, 1 skipped" in ended.stdout
    assert "needs hardware, and emulated:serial is none" in ended.stdout


FAILING = """
import numpy as np
import pytest
from rig.plan import Limits

KEPT = []  # a run that is collected while pytest parses the source of a failed test crashes CPython 3.11

def test_that_leaves_the_output_on(rig_device):
    blocks = rig_device.stream(np.full(40_000, 3.0), 10_000.0, Limits(-5.0, 5.0))
    KEPT.append(blocks)
    next(block for block in blocks if block.y.size)
    raise RuntimeError("a test that fails in mid-run")

@pytest.mark.rig_hardware
def test_that_finds_it_safe(rig_device):
    print("level", rig_device.level_v())
"""


def test_a_device_with_an_address_of_its_own_is_hardware_and_left_safe_by_a_test_that_fails(tmp_path: Path) -> None:
    (tmp_path / "test_it.py").write_text(FAILING)
    with start("emulate", "serial", cwd=tmp_path) as board:
        try:
            assert board.stdout is not None
            address = board.stdout.readline().strip()
            ended = typed("--rig-device", address, "--rig-safe-level", "0.5 V", "-s", "test_it.py", cwd=tmp_path)
        finally:
            board.terminate()
            board.communicate(timeout=10)
    assert "a test that fails in mid-run" in ended.stdout
    assert "1 failed, 1 passed" in ended.stdout
    level_v = float(ended.stdout.partition("level ")[2].split()[0])
    assert level_v == pytest.approx(0.5, abs=1e-3)


KILLED = """
import numpy as np
from pathlib import Path
from rig.plan import Limits

def test_that_is_killed(rig_device):
    for block in rig_device.stream(np.full(400_000, 3.0), 10_000.0, Limits(-5.0, 5.0)):
        if block.y.size:
            Path("playing").touch()
"""


def test_killed_tests_leave_the_output_safe(tmp_path: Path) -> None:
    (tmp_path / "test_it.py").write_text(KILLED)
    with emulated(QUIET, watchdog_s=60.0) as board:
        options = ["-q", "--no-cov", "-p", "no:cacheprovider", "--rig-device", board.address, "test_it.py"]
        command = [sys.executable, "-m", "pytest", *options]
        said, playing = tmp_path / "said", tmp_path / "playing"
        with said.open("w") as out, subprocess.Popen(command, cwd=tmp_path, stdout=out, stderr=out) as tests:
            assert within(100.0, lambda: playing.exists() or tests.poll() is not None)
            assert playing.exists(), said.read_text()
            assert board.look().level_v == pytest.approx(3.0, abs=1e-3)
            tests.kill()
        assert within(5.0, lambda: board.look().level_v == 0.0)


def within(seconds: float, fact: Callable[[], bool]) -> bool:
    """Return whether something becomes true in time."""
    deadline = time.monotonic() + seconds
    while not fact():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.02)
    return True


def test_what_is_simulated_is_told_by_its_driver_and_a_wrong_address_is_a_usage_error() -> None:
    assert pytest_plugin.is_simulated("loopback:")
    assert pytest_plugin.is_simulated("emulated:serial")
    assert pytest_plugin.is_simulated("drivers.replay:ReplayDevice:run.h5")
    assert not pytest_plugin.is_simulated("serial:/dev/ttyACM0")
    with pytest.raises(pytest.UsageError, match="did you mean 'loopback'"):
        pytest_plugin.is_simulated("lopback:")
