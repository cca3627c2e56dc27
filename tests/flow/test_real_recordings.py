"""Do recordings of real circuits, made by others, import and explain as their circuits say?

They are not part of this tree: set RIG_RECORDINGS to the folder that holds wh2009/ and rcrc_circuit/, or keep it at
../shared/recordings beside the project.
"""

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.flow.console import rig

FOLDER = Path(os.environ.get("RIG_RECORDINGS", Path(__file__).parents[3] / "shared" / "recordings"))
PATIENCE_S = 600.0  # samples at a noise so low that the grid must be fine take a minute of a processor
BLEMISHES = {"spikes", "adc_quantisation"}  # of readings, not physics of the chain: both stand in the ladder's table
BLOCK, TAPS = 512, 60  # the ladder's readings came in blocks, and the first of a block is odd
pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason=f"no recordings at {FOLDER}: set RIG_RECORDINGS")


def explained(folder: Path, *words: str) -> dict[str, Any]:
    ended = rig("explain", *words, "--json", "told.json", "--quiet", cwd=folder, limit_s=PATIENCE_S)
    assert ended.code == 0, ended
    found: dict[str, Any] = json.loads((folder / "told.json").read_text(encoding="utf-8"))
    return found


def test_the_rc_ladder_is_late_by_a_sample_and_linear(tmp_path: Path) -> None:
    circuit = FOLDER / "rcrc_circuit"
    columns = ("--time", "Time", "--input", "DAC", "--output", "ADC", "--rows", f"0:{40 * BLOCK}")  # two thirds tell it
    assert rig("import", str(circuit / "ls_output_data.csv"), *columns, "--out", "ls.h5", cwd=tmp_path).code == 0
    told = explained(tmp_path, "ls.h5", "--rig", str(circuit / "rig.yaml"))
    readings = {e["id"]: e["parameters"] for e in told["effects"] if e["id"] in BLEMISHES}
    chain = [(e["id"], e["stage"]) for e in told["effects"] if e["id"] not in {*BLEMISHES, "unnamed"}]
    assert chain == [("dead_time", "G2")]
    delay = next(e for e in told["effects"] if e["id"] == "dead_time")["parameters"]["delay"]
    assert 0.5e-3 < delay["value"] < 1.5e-3
    assert 0.9 < told["model"]["F"]["linear"]["gain"] < 1.0
    held = told["fit"]["held_out"]
    assert held["named"] < 0.35 * held["before"]
    assert held["after"] <= held["named"]
    steps, odd_v = blemishes_of(circuit / "ls_output_data.csv")
    assert readings["adc_quantisation"]["LSB"]["value"] == pytest.approx(steps, rel=1e-4)
    if "spikes" in readings:  # told only where nothing else is left; here something unnamed at G1 is
        assert readings["spikes"]["size"]["value"] == pytest.approx(odd_v, rel=0.2)


def blemishes_of(table: Path) -> tuple[float, float]:
    """Return the smallest step between readings, and how far the first reading of a block of 512 is off, rms, V.

    A filter with 60 taps, fitted where it looks into no other block, says what a reading should have been.
    """
    _, reading, held = np.loadtxt(table, delimiter=",", skiprows=1).T
    past = np.lib.stride_tricks.sliding_window_view(held, TAPS)
    past, read, place = past[1:], reading[TAPS:], np.arange(TAPS, reading.size) % BLOCK
    inside = place >= TAPS
    taps = np.linalg.lstsq(past[inside], read[inside], rcond=None)[0]
    off = (read - past @ taps)[place == 0]
    return float(np.diff(np.unique(reading)).min()), float(np.sqrt(np.mean(off**2)))


@pytest.mark.slow
def test_the_diodes_between_two_filters_are_found_where_they_are(tmp_path: Path) -> None:
    (table,) = (FOLDER / "wh2009").glob("*.csv")
    kind = ("--input", "1", "--output", "2", "--rate", "51200", "--intersample", "bandlimited")
    for name, rows in (("train", "5200:11200"), ("test", "109200:129200")):
        ended = rig("import", str(table), *kind, "--rows", rows, "--out", f"{name}.h5", cwd=tmp_path)
        assert ended.code == 0, ended
    rig_file = str(FOLDER / "wh2009" / "rig.yaml")
    told = explained(tmp_path, "train.h5", "--hold-out", "test.h5", "--rig", rig_file)
    (clamp,) = (e for e in told["effects"] if e["id"] != "unnamed")
    assert (clamp["id"], clamp["stage"], clamp["form"]) == ("diode_clamp", "F", "upper, resistor")
    assert 0.03 < clamp["parameters"]["n_vt"]["value"] < 0.08  # V_T is 25 mV, n of a diode 1 to 2
    assert told["location"]["stage"] == "F"
    held = told["fit"]["held_out"]
    assert held["after"] <= held["named"] <= 0.7e-3
    assert held["before"] > 40e-3
