"""Does the circuit of op-amps do what the paper's chain does, and does its driver say what is wrong?"""

import shutil
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from drivers import ngspice
from drivers.spice import SpiceDevice
from rig.device import Array, Device
from rig.errors import DeviceError, FileError, UsageError
from tests.benchmarks.plain_circuit import LIMITS, RATE_HZ, compared, nrmse, sine, staircase
from tests.rigs import QUIET
from tests.wire.waiting import eventually

AGREED = 5e-3
"""NRMSE between the circuit and the ideal chain."""
needs_ngspice = pytest.mark.skipif(bool(ngspice.missing()), reason=ngspice.missing())


def record(device: Device, u: Array, inputs: int = 1) -> Array:
    """Return what was read (inputs, N)."""
    read = [np.vstack([block.y, *block.further]) for block in device.stream(u, RATE_HZ, LIMITS, inputs=inputs)
            if block.y.size]
    return np.hstack(read)


def alive(pid: int) -> bool:
    """Return whether a process runs; one that has ended and was not waited for does not."""
    with suppress(OSError):
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    return False


@pytest.fixture(autouse=True)
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Wait for a simulation on a computer that other tests keep busy; what is too late for a device has its own test.
    """
    monkeypatch.setattr("rig.device.STALL_S", 30.0)


@needs_ngspice
@pytest.mark.parametrize("u", [sine(0.2), staircase(200)], ids=["50 Hz sine", "staircase"])
def test_the_circuit_agrees_with_the_chain_within_its_rails(u: Array) -> None:
    signals, _ = compared(u)
    assert np.abs(signals["w"][1]).max() < 10.0
    assert {signal: nrmse(*pair) < AGREED for signal, pair in signals.items()} == dict.fromkeys("yvw", True)


@needs_ngspice
def test_u_is_read_back_just_before_it_acts() -> None:
    with SpiceDevice.connect("?noise=0V") as device:
        u = device.quantise(sine(0.02))
        read_back = record(device, u, inputs=2)[1]
    assert read_back[0] == 0.0
    assert np.abs(read_back[1:] - u[:-1]).max() < device.capabilities().input_lsb_v


@needs_ngspice
def test_the_gain_stage_ends_at_its_rails_and_another_supply_moves_them() -> None:
    up = np.full(1500, 5.0)
    with SpiceDevice.connect("?noise=0V") as device:
        assert record(device, up)[0, 1200:].mean() == pytest.approx(10.0, abs=0.01)
    with SpiceDevice.connect("?noise=0V&V4=-9.5") as device:
        assert record(device, up)[0, 1200:].mean() == pytest.approx(9.5 - 1.5, abs=0.01)


@needs_ngspice
def test_a_rig_of_ideal_parts_agrees_with_the_chain(tmp_path: Path) -> None:
    (tmp_path / "quiet.yaml").write_text(QUIET)
    signals, _ = compared(sine(0.1), str(tmp_path / "quiet.yaml"))
    assert nrmse(*signals["y"]) < AGREED


@needs_ngspice
def test_noise_is_added_to_readings_with_its_size_and_seed() -> None:
    u = np.zeros(2000)
    first, again, other = (record(SpiceDevice.connect(f"?noise=20mV&seed={seed}"), u)[0] for seed in (1, 1, 2))
    assert np.array_equal(first, again)
    assert np.std(first) == pytest.approx(0.02, rel=0.06)
    assert abs(np.corrcoef(first, other)[0, 1]) < 0.1


@needs_ngspice
def test_a_circuit_that_cannot_be_simulated_ends_the_run_with_what_ngspice_says(tmp_path: Path) -> None:
    path = tmp_path / "loop.cir"
    path.write_text("two sources against each other\nV1 u2 0 1\nV2 u2 0 2\nR1 u y 1k\nR2 y 0 1k\n")
    with SpiceDevice.connect(str(path)) as device, pytest.raises(DeviceError, match=r"ngspice gave up.*singular"):
        record(device, np.zeros(10))


@needs_ngspice
def test_a_run_that_is_left_leaves_no_process_and_no_files() -> None:
    device = SpiceDevice.connect("")
    blocks = device.stream(sine(0.5), RATE_HZ, LIMITS)
    next(blocks)
    running = device._running
    assert running is not None
    blocks.close()  # type: ignore[attr-defined]
    assert running._process.poll() is not None
    assert not running._folder.exists()


@needs_ngspice
def test_a_program_that_is_killed_takes_ngspice_with_it(tmp_path: Path) -> None:
    script = """
import numpy as np
from drivers.ngspice import Simulation
running = Simulation(["R1 u y 1k", "R2 y 0 1k"], ("y",), np.sin(np.arange(50_000.0)), 1e4)
assert running.take(10, 5.0) is not None
print(running._process.pid, running._folder, flush=True)
input()
"""
    command = [sys.executable, "-c", script]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stdin=subprocess.PIPE, text=True) as program:
        assert program.stdout is not None
        pid, folder = program.stdout.readline().split()
        assert alive(int(pid))
        program.kill()
    shutil.rmtree(folder)
    assert eventually(lambda: not alive(int(pid)))


@needs_ngspice
@pytest.mark.parametrize(("where", "error", "message"), [
    ("?R99=1k", UsageError, "unknown part 'R99'"),
    ("?noise=5", UsageError, "noise: .*with a unit|noise"),
    ("?noise=-5mV", UsageError, "below zero"),
    ("?seed=x", UsageError, "not a seed"),
    ("?R1", UsageError, r"not an option of a circuit.*R1"),
    ("nowhere.cir", FileError, "nowhere.cir"),
    ("rigs/opamp_backlash.yaml", FileError, "opamp_backlash"),
])
def test_what_an_address_cannot_mean_is_refused(where: str, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        SpiceDevice.connect(where)


@needs_ngspice
def test_a_netlist_without_the_nodes_that_are_driven_and_read_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.cir"
    path.write_text("a divider\nR1 in y 1k\nR2 y 0 1k\n")
    with pytest.raises(FileError, match="a node is missing: u"):
        SpiceDevice.connect(str(path))


def test_without_ngspice_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "which", lambda _name: None)
    assert SpiceDevice.attached() == ()
    with pytest.raises(DeviceError, match="apt-get install ngspice"):
        SpiceDevice.connect("")
