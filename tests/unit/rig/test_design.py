"""Is a design refused with one sentence where limits, time, device or rig allow none, and written where they do?"""

from pathlib import Path

import pytest

from rig.design import Wish, design
from rig.errors import FileError, RefusedError, RigError, UsageError
from rig.plan import plan
from rig.protocol import read_protocol
from tests.flow.test_design import RIG


def silent(sentence: str, share: float) -> None:
    """Show no progress."""


def mine(folder: Path, text: str = RIG) -> Path:
    path = folder / "my_rig.yaml"
    path.write_text(text)
    return path


REFUSED = [
    (Wish(limit_v=1.0), RefusedError, r"my_rig.yaml: the gap hardly moves .* 1.25 V .*; widen the limit"),
    (Wish(0.2), RefusedError, r"my_rig.yaml: 0.2 s is too short"),
    (Wish(limit_v=30.0), RefusedError, r"--limit: .*: 30 V; allowed: -10 to 10 V"),
    (Wish(1.8e7), RefusedError, r"--time: the protocol is too long: .*; allowed: .* samples"),
    (Wish(rate_hz=3e6), RefusedError, r"cannot sample at this rate"),
    (Wish(slew_v_per_s=1e-3), RefusedError, r"allow a steeper slope"),
    (Wish(device="loopbak:"), UsageError, r"did you mean 'loopback'"),
]


@pytest.mark.parametrize(("wish", "kind", "words"), REFUSED, ids=[row[2] for row in REFUSED])
def test_what_limits_time_and_device_do_not_allow(tmp_path: Path, wish: Wish, kind: type[RigError], words: str) -> None:
    with pytest.raises(kind, match=words):
        design(mine(tmp_path), tmp_path / "x.yaml", wish, silent)
    assert not (tmp_path / "x.yaml").exists()


def test_bent_borders_and_unstable_blocks_are_not_designed_for(tmp_path: Path) -> None:
    bent = "F: {curved_backlash: {L: [[1 V, 0 V], [3 V, 9 V]], U: [[-1 V, 0 V], [1 V, 9 V]]}}"
    lines = [bent if line.startswith("F:") else line for line in RIG.splitlines() if not line.startswith("physics")]
    with pytest.raises(RefusedError, match="straight borders"):
        design(mine(tmp_path, "\n".join(lines) + "\n"), tmp_path / "x.yaml", Wish(8.0), silent)
    unstable = RIG.replace("den: [0.02, 1]", "den: [1, 1, 2, 8]")
    with pytest.raises(RefusedError, match="unstable G1"):
        design(mine(tmp_path, unstable), tmp_path / "x.yaml", Wish(8.0), silent)


def test_a_rig_that_is_not_there_and_a_file_that_is(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="no such file"):
        design("nowhere.yaml", tmp_path / "x.yaml", Wish(), silent)
    with pytest.raises(FileError, match="--overwrite"):
        design(mine(tmp_path), tmp_path / "my_rig.yaml", Wish(), silent)


def test_a_protocol_that_could_not_name_its_rig_is_not_written(tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    with pytest.raises(UsageError, match="could not name its rig file"):
        design(mine(tmp_path), tmp_path / "there" / "slow.yaml", Wish(), silent)


def test_slow_inputs_get_no_jumps_and_the_rig_is_found_from_another_folder(tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    out = tmp_path / "slow.yaml"
    done = design(mine(tmp_path / "there"), out, Wish(8.0, 5.0, 2000.0, 2000.0), silent)
    made = plan(read_protocol(out))
    assert made.rig_path is not None
    assert Path(made.rig_path).samefile(tmp_path / "there" / "my_rig.yaml")
    assert made.limits.slew_v_per_s == 2000.0
    assert made.slew_v_per_s <= 2000.0 * (1.0 + 1e-9)
    assert done.moving > 0
    assert all(row.designed.told for row in done.rows)
    assert "physics and design again" not in out.read_text()
