"""Does the comparison with bare h5py run, on the same values?"""

from pathlib import Path

from tests.benchmarks.read_rate import make, measured, table


def test_both_sides_read_the_same(tmp_path: Path) -> None:
    path = make(tmp_path / "r.h5", 2000)
    assert "rig.recording.read" in table(measured(path, 1), path.stat().st_size)
