"""Does a delay that a cable told stay out of the rig, from `rig calibrate` to the answer and its page?"""

import json
from pathlib import Path

import pytest

from rig import session, workflow
from tests.flow.console import here, protocol, refused
from tests.rigs import CABLE

PLAIN = """
spec: 1
rig: op-amp
G1: {num: [1000], den: [1.0e-4, 20, 1000]}
F:  {backlash: {S_L: 8, D_L: 1.25 V, S_U: 8, D_U: -1.25 V}}
G2: {num: [1000], den: [1.0e-6, 2, 1000]}
noise: 10 mV
"""
BOARD = PLAIN.replace("op-amp", "a cable").replace("2, 1000]}", "2, 1000], dead_time: 237 us}")
"""The rig on a device of the same identity as the cable's, late by the device alone."""
SAME = "delay shared between G1 and G2"


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a run whose readings are late by the device, its calibration, and the run with it."""
    folder = tmp_path_factory.mktemp("bench")
    for name, text in (("plain.yaml", PLAIN), ("board.yaml", BOARD), ("cable.yaml", CABLE)):
        (folder / name).write_text(text)
    path = protocol(folder, ("rigs/opamp_backlash.yaml", "plain.yaml"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RIG_CALIBRATIONS", str(folder / "kept"))
        for name in ("before.h5", "after.h5"):
            session.record(path, f"loopback:{folder / 'board.yaml'}", folder / name, lambda done, total: None)
            if name == "before.h5":
                ended = here("calibrate", "loopback:cable.yaml", "--rate", "4kHz", cwd=folder)
                assert ended.code == 0, ended.err
                assert "delay     23" in ended.out
    return folder


def kept(bench: Path) -> Path:
    (path,) = (bench / "kept").iterdir()
    return path


def test_a_recording_keeps_the_calibration_of_its_device_and_identify_says_where_the_delay_is_known_from(
    bench: Path,
) -> None:
    ended = here("identify", "after.h5", "--json", "-", "--report", "after.html", cwd=bench)
    assert ended.code == 0, ended.err
    told = json.loads(ended.out)
    (device,) = told["device"]
    assert device["used"]
    assert device["from"].startswith("calibration of loopback a cable at 4 kHz, ")
    assert device["delay"]["value"] == pytest.approx(237e-6, abs=1e-6)
    assert SAME not in [item["what"] for item in told["not_identifiable"]]
    low, high = told["G1"]["rational"]["ci95"]["den"][1]
    assert low < 0.02 < high
    assert device["from"] in (bench / "after.html").read_text()


def test_without_it_the_delay_bends_the_poles(bench: Path) -> None:
    told = workflow.identify_runs(workflow.load([bench / "before.h5"])).to_dict()
    assert told["device"] == []
    low, high = told["G1"]["rational"]["ci95"]["den"][1]  # type: ignore[index]
    assert not low < 0.02 < high
    assert SAME in [item["what"] for item in told["not_identifiable"]]  # type: ignore[attr-defined]


def test_explain_finds_nothing_missing_where_the_delay_is_the_devices(bench: Path) -> None:
    told = workflow.explain_runs(workflow.load([bench / "before.h5"], calibration=kept(bench)))
    assert told.verdict == "consistent"
    assert [device["used"] for device in told.to_dict()["device"]][:1] == [True]  # type: ignore[attr-defined]


def test_a_calibration_of_another_device_is_refused(bench: Path, recording: Path) -> None:
    ended = here("identify", recording, "--calibration", kept(bench), cwd=bench)
    refused(ended, 2, "not true of this recording", "it is of loopback a cable 1, the run of loopback op-amp")
