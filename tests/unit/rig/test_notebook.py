"""Does a notebook get what the command line gives?"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import rig
from rig.errors import FileError, UsageError
from rig.recording import write
from rig.workflow import identify_runs, load

RIG = """spec: 1
rig: "<b>one pole</b>"
G1: {num: [1], den: [0.01, 1]}
F: linear
G2: {num: [1], den: [1]}
noise: 1 mV
"""
PROTOCOL = """spec: 1
title: two levels
question: What does the pole do?
rig: mine.yaml
limits: {level: 1 V}
acquisition: {rate: 1 kHz}
steps: [{repeats: 2, staircase: {levels: [0.5 V, -0.5 V, 1 V], dwell: 80 ms}}]
"""


@pytest.fixture(autouse=True)
def _closed() -> Iterator[None]:
    import matplotlib.pyplot as plt

    yield
    plt.close("all")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "mine.yaml").write_text(RIG)
    (tmp_path / "levels.yaml").write_text(PROTOCOL)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_run_is_kept_under_the_protocol_s_name_and_never_written_over(folder: Path) -> None:
    found = rig.check("levels.yaml")
    assert repr(found).startswith("Accepted: two levels, 480 samples at 1 kHz, 480 ms; nothing was output")
    recording = rig.run("levels.yaml")
    assert (folder / "levels.h5").exists()
    again = rig.read("levels.h5")
    assert np.array_equal(recording.y[:], again.y[:])
    assert repr(again) == repr(recording)
    assert "480 samples at 1 kHz, 480 ms, complete" in repr(again)
    with pytest.raises(FileError, match="there is a file of this name already"):
        rig.run("levels.yaml")


def test_recordings_are_given_by_path_or_as_they_are(folder: Path) -> None:
    recording = rig.run("levels.yaml")
    here, there = rig.identify(recording), rig.identify("levels.h5")
    assert here.to_dict() == there.to_dict() == identify_runs(load(["levels.h5"])).to_dict()
    assert "<b>" not in here._repr_html_().replace("<b>Identification</b>", "")
    with pytest.raises(UsageError, match="no recording is named"):
        rig.identify()
    with pytest.raises(UsageError, match="no run is left to fit"):
        rig.explain(recording, hold_out=[recording])
    with pytest.raises(UsageError, match="no run is left to fit"):
        rig.explain("levels.h5", hold_out=[Path("levels.h5")])


def test_a_simulation_says_and_draws_how_far_off_it_is(folder: Path) -> None:
    rig.run("levels.yaml")
    played = rig.simulate("levels.h5")
    off = np.sqrt(np.mean(np.square(played.trace.y[:] - played.answer)))
    assert repr(played).endswith(f"{off * 1e3:.4g} mV rms")
    _, y = played.plot()
    assert y.get_legend_handles_labels()[1] == ["recorded", "model"]


def test_what_is_incomplete_is_called_so_in_words_and_pictures(folder: Path) -> None:
    from dataclasses import replace

    recording = rig.run("levels.yaml")
    ledger = recording.ledger.copy()
    ledger[300:] = 0
    y = np.where(ledger == 1, recording.y[:], np.nan)
    write("cut.h5", replace(recording, y=y, ledger=ledger, complete=False, reason="stopped by Ctrl-C"))
    cut = rig.read("cut.h5")
    assert "INCOMPLETE: stopped by Ctrl-C" in repr(cut)
    assert "180 samples" in repr(cut)
    axes = cut.plot()
    assert axes[0].get_title("left") == "cut: incomplete, stopped by Ctrl-C"
    assert "samples missing" in axes[-1].get_legend_handles_labels()[1]
