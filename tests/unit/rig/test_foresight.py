"""Is it said before a run which points of G1 and G2 its sines would leave open, and with what they would be told?"""

from pathlib import Path

import pytest

import protocols
from rig.foresight import Foresight, foreseen_plan
from rig.narration import foreseen
from rig.plan import plan
from rig.protocol import read_protocol

SHIPPED = Path(protocols.__path__[0])


def told_by(name: str, text: str | None = None, folder: Path = SHIPPED) -> Foresight:
    path = SHIPPED / name
    if text is not None:
        path = folder / name
        path.write_text(text.replace("rigs/", f"{SHIPPED}/rigs/"))
    protocol = read_protocol(path)
    assert protocol.rig is not None
    return foreseen_plan(plan(protocol), protocol.rig.model, 0.01)


@pytest.mark.parametrize(
    ("name", "untold"),
    [
        ("sine_50hz.yaml", ["|G1| against |G2| at 50 Hz"]),
        ("demo.yaml", ["|G1| against |G2| at 8 Hz and 28 Hz", "phase of G1 at 28 Hz against that at 8 Hz"]),
        ("sine_ladder.yaml", ["phase of G1 at 16 Hz, 28 Hz, 32 Hz and 44 Hz against that at 8 Hz"]),
        ("fig13_staircase.yaml", []),
    ],
)
def test_the_points_a_protocol_leaves_to_the_rig_file_are_named(name: str, untold: list[str]) -> None:
    assert [item.what for item in told_by(name).untold] == untold


def test_the_amplitude_that_is_proposed_settles_it_within_the_limits(tmp_path: Path) -> None:
    text = (SHIPPED / "sine_50hz.yaml").read_text(encoding="utf-8")
    (item,) = told_by("sine_50hz.yaml").untold
    amplitude = item.fixed_by.partition("50 Hz also at ")[2].partition(" V")[0]
    assert 7.95 < float(amplitude) < 10.0
    more = f"  - {{repeats: 4, sine: {{frequency: 50 Hz, amplitude: {amplitude} V, periods: 25}}}}\n"
    assert told_by("both.yaml", text + more, tmp_path).untold == ()


def test_it_is_said_on_the_terminal() -> None:
    lines = list(foreseen(told_by("sine_50hz.yaml")))
    at = lines.index("  what its sines leave to the orders in the rig file:")
    assert lines[at + 1] == "    |G1| against |G2| at 50 Hz"
    assert lines[at + 2].startswith("      because  a larger |G1| with a smaller |G2|")
    assert lines[at + 3].startswith("      held by  the orders of G1 and G2 in the rig file")


def test_a_stuck_gap_is_foreseen_of_bent_borders_too(tmp_path: Path) -> None:
    """The op-amp rig with a slight bend: its 50 Hz sine at a tenth of the level leaves the gap stuck."""
    rig = (SHIPPED / "rigs/opamp_backlash.yaml").read_text()
    bent = "curved_backlash: {L: [[-1 V, -18 V], [1 V, -2 V], [3 V, 13 V]], U: [[-3 V, -14 V], [1 V, 18 V]]}"
    (tmp_path / "bent.yaml").write_text(rig.replace("backlash: {S_L: 8, D_L: 1.25 V, S_U: 8, D_U: -1.25 V}", bent))
    text = (SHIPPED / "sine_50hz.yaml").read_text().replace("rigs/opamp_backlash.yaml", str(tmp_path / "bent.yaml"))
    path = tmp_path / "weak.yaml"
    path.write_text(text.replace("amplitude: 10 V", "amplitude: 1 V"))
    protocol = read_protocol(path)
    assert protocol.rig is not None
    told = foreseen_plan(plan(protocol), protocol.rig.model, 0.01)
    assert any("the gap is stuck at U = 1 V" in item.sentence for item in told.advice)
