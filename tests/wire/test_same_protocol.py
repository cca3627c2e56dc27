"""Does a shipped protocol give the same recording over a real pty as on the loopback, but for the noise?"""

from pathlib import Path

import numpy as np

from drivers.emulators.faults import Faults
from rig import session
from rig.plan import Limits
from rig.recording import Entry
from rig.registry import connect
from rig.rigfile import read_rig
from tests.rigs import QUIET
from tests.wire.emulated import emulated

PROTOCOL, RIG = "demo_hold_out.yaml", "rigs/opamp_backlash.yaml"


def silent(done: int, total: int) -> None:
    """Show nothing."""


def test_serial_and_loopback_differ_by_the_noise_alone(tmp_path: Path) -> None:
    rig = read_rig(session.shipped(RIG))
    on_loopback = session.record(PROTOCOL, f"loopback:{RIG}", tmp_path / "loopback.h5", silent)
    with emulated(rig.text, speed=5) as bench:
        on_serial = session.record(PROTOCOL, bench.address, tmp_path / "serial.h5", silent)
    one, other = on_loopback.recording, on_serial.recording
    assert (other.ledger == Entry.RECORDED).all()
    assert other.rate_hz == one.rate_hz
    assert np.array_equal(other.u, one.u)
    noise_v, difference = rig.model.noise_v or 0.0, other.y - one.y
    spread = noise_v * np.sqrt(2.0)
    assert np.ptp(one.y) > 100 * noise_v
    assert abs(difference.std() / spread - 1.0) < 5.0 / np.sqrt(2.0 * difference.size)
    assert abs(difference.mean()) < 5.0 * spread / np.sqrt(difference.size)
    assert np.abs(difference).max() < 6.0 * spread


def test_four_inputs_over_a_line_that_loses_bytes_are_those_of_the_loopback(tmp_path: Path) -> None:
    """Every input's every sample arrives, and none takes another's place."""
    (tmp_path / "quiet.yaml").write_text(QUIET)
    u = 8.0 * np.sin(np.arange(20_000) * 0.004)
    with emulated(QUIET, speed=4, faults=Faults(drop=1e-4, corrupt=1e-4, spare=3000)) as bench:
        on_serial = four_inputs(bench.address, u)
    on_loopback = four_inputs(f"loopback:{tmp_path / 'quiet.yaml'}", u)
    assert np.ptp(on_loopback, axis=1).min() > 1.0
    assert np.array_equal(on_serial, on_loopback)


def four_inputs(address: str, u: np.ndarray) -> np.ndarray:
    """Return what four inputs read, (4, N), every sample of them received."""
    with connect(address) as device:
        blocks = [block for block in device.stream(u, 5000.0, Limits(-10.0, 10.0), inputs=4) if block.y.size]
        device.safe()
    read = np.concatenate([np.vstack([block.y, block.further]) for block in blocks], axis=1)
    assert read.shape == (4, u.size)
    return read
