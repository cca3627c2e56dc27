"""Does a shipped protocol give the same recording over a real pty as on the loopback, but for the noise?"""

from pathlib import Path

import numpy as np

from rig import session
from rig.recording import Entry
from rig.rigfile import read_rig
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
