"""Is what a page says and draws true: lamps, figures, residual, dwells, and all of it in bounded memory?"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.simulate import Player
from identify.trace import Array, Step
from rig import workflow
from rig.live.columns import BRANCHES, CLOSE, TRAIL, columns
from rig.live.dwells import MOST
from rig.live.envelope import COLUMNS, LEVELS
from rig.live.facts import facts
from rig.live.following import follow
from rig.live.watching import Watch
from rig.recorded import Entry, Equipment, Event, Origin, Recording
from rig.recording import read, write
from rig.rigfile import parse_rig
from tests.rigs import GAP

RATE_HZ = 2000.0
PROTOCOL = """\
spec: 1
title: stairs
question: Where are the borders?
limits: {level: 2 V}
acquisition: {rate: 2 kHz}
steps:
  - hold: {level: 1 V, time: 1 s}
"""
RANGES = {"output_low": "-10 V", "output_high": "10 V", "input_low": "-5 V", "input_high": "5 V"}


def stairs() -> Array:
    """Return u: levels up and down, 0.1 s each."""
    levels = [0.0, 0.5, 1.0, 1.5, 1.0, 0.5, 0.0, -0.5, -1.0, -1.5, -1.0, -0.5]
    return np.repeat(np.array(levels * 3), round(0.1 * RATE_HZ))


def a_run(folder: Path, rig: str = GAP, bent: float = 0.0, lost: int = 0, u: Array | None = None) -> Path:
    """Return the recording of a rig that bends by ``bent`` of y more than its model, some samples lost."""
    u = stairs() if u is None else u
    y = Player(parse_rig(GAP, "rig").model, RATE_HZ, seed=3).play(u)
    y = y + bent * y
    ledger = np.full(u.size, Entry.RECORDED, dtype=np.uint8)
    ledger[500 : 500 + lost] = Entry.LOST
    y[500 : 500 + lost] = np.nan
    origin = Origin(Equipment("serial:/dev/x", "a board", settings=RANGES), started="2026-11-22T00:00:00+00:00",
                    finished="2026-11-22T00:01:00+00:00")
    half = u.size // 2
    steps = (Step("up", "staircase", 0, half), Step("up", "staircase", half, u.size, 1))
    path = folder / "run.h5"
    write(path, Recording("run", RATE_HZ, u, y, ledger, origin, title="stairs", question="?", steps=steps, rig_text=rig,
                          protocol_text=PROTOCOL, complete=not lost,
                          reason="samples were lost" if lost else "all there",
                          events=(Event("safe", "output at 0 V", u.size, u.size),)))
    return path


def watched(path: Path) -> Watch:
    """Return what is known of a recording once all of it was looked at."""
    watch = Watch(follow(path))
    while watch.behind:
        watch.catch_up(1.0)
    return watch


def test_the_residual_is_that_of_the_plain_model_and_of_nothing_fitted(tmp_path: Path) -> None:
    path = a_run(tmp_path, bent=0.05)
    played = workflow.simulate(path)
    watch = watched(path)
    residual = played.trace.y[:] - played.answer
    assert watch.squares.rms == pytest.approx(float(np.sqrt(np.mean(np.square(residual)))), rel=1e-3)
    drawn = columns(watch)["residual"]
    assert np.nanmax(drawn["high"]) == pytest.approx(residual.max(), abs=1e-3)
    assert np.nanmin(drawn["low"]) == pytest.approx(residual.min(), abs=1e-3)
    assert watch.noise_v == pytest.approx(0.005, rel=0.1)
    assert f"{watch.squares.rms / watch.noise_v:.3g} x the noise" in facts(watch)["figures"]["residual"]


def test_where_the_model_is_true_the_residual_is_the_noise(tmp_path: Path) -> None:
    watch = watched(a_run(tmp_path))
    assert watch.squares.rms == pytest.approx(watch.noise_v, rel=0.05)


def test_dwells_lie_on_the_models_borders(tmp_path: Path) -> None:
    watch = watched(a_run(tmp_path))
    assert watch.plain is not None
    (slope_l, crossing_l), (slope_u, crossing_u) = watch.plain.borders()
    found = {branch: [p for p in watch.points if p.branch == branch] for branch in ("loading", "unloading", "plateau")}
    assert all(len(points) >= 3 for points in found.values())
    for point in found["loading"]:
        assert point.y_v == pytest.approx(slope_l * (point.v_v - crossing_l), abs=0.01)
    for point in found["unloading"]:
        assert point.y_v == pytest.approx(slope_u * (point.v_v - crossing_u), abs=0.01)


def test_lamps_tell_lost_samples_and_the_ends_of_ranges_in_words(tmp_path: Path) -> None:
    quiet = facts(watched(a_run(tmp_path)))["lamps"]
    assert {name: lamp["state"] for name, lamp in quiet.items()} == dict.fromkeys(quiet, "good")
    told = facts(watched(a_run_over(tmp_path)))
    assert told["lamps"]["overrun"] == {"state": "bad", "words": "7 samples lost"}
    assert told["lamps"]["input"]["state"] == "bad"
    assert "at the end of the input's -5 to 5 V" in told["lamps"]["input"]["words"]
    assert told["lamps"]["output"]["state"] == "warn"
    assert "at the end of its limits -2 to 2 V" in told["lamps"]["output"]["words"]
    assert told["lamps"]["run"] == {"state": "bad", "words": "ended early"}
    assert told["state"].startswith("Ended early: samples were lost")


def a_run_over(folder: Path) -> Path:
    """Return a run that lost samples, whose output reached its limit and whose input its end."""
    (folder / "run.h5").unlink()
    return a_run(folder, bent=1.0, lost=7, u=stairs() * (2.0 / 1.5))


@pytest.mark.parametrize(("rig", "why"), [
    ("", "keeps no rig file"), ("spec: 1\nrig: x\n", "no model"),
    ("spec: 1\nrig: x\nG1: {orders: [0, 1]}\nF: backlash\nG2: {orders: [0, 1]}\n", "no model"),
])
def test_a_recording_whose_rig_is_not_known_is_shown_without_a_model(tmp_path: Path, rig: str, why: str) -> None:
    watch = watched(a_run(tmp_path, rig=rig))
    told = facts(watch)
    assert why in told["model"]
    assert told["figures"]["residual"] == "none"
    assert "y against u" in told["alternatives"]["loop"]
    assert np.isnan(columns(watch)["residual"]["mean"]).all()
    assert len(watch.points) == 36


def test_lost_samples_are_gaps_in_the_pictures(tmp_path: Path) -> None:
    watch = watched(a_run(tmp_path, lost=400))
    whole = columns(watch)["whole"]
    inside = (whole["t"] > 501 / RATE_HZ) & (whole["t"] < 898 / RATE_HZ)
    assert inside.any()
    assert np.isnan(whole["y"][inside]).all()
    assert not np.isnan(whole["u"][inside]).any()


def test_pictures_have_no_more_points_however_long_the_run_is(tmp_path: Path) -> None:
    lines = {"latest": 4 * 2 * CLOSE, "whole": 3 * 2 * COLUMNS, "residual": 6 * COLUMNS, "trail": 3 * TRAIL,
             "hull": 4 * LEVELS, "borders": 2 * 6, **dict.fromkeys(BRANCHES, 2 * (MOST + 1))}
    for times in (1, 30):
        (tmp_path / "run.h5").unlink(missing_ok=True)
        watch = watched(a_run(tmp_path, u=np.tile(stairs(), times)))
        for name, held in columns(watch).items():
            assert 0 < sum(values.size for values in held.values()) <= lines[name]


def test_a_watch_stops_in_time_and_goes_on_where_it_was(tmp_path: Path) -> None:
    path = a_run(tmp_path, u=np.tile(stairs(), 20))
    watch = Watch(follow(path))
    watch.catch_up(0.0)
    assert watch.behind > 0
    assert "behind" not in facts(watch)["lamps"]["run"]["words"]
    while watch.behind:
        watch.catch_up(0.0)
    assert watch.squares.rms == watched(path).squares.rms


def test_a_page_that_is_far_behind_says_that_the_run_is_not(tmp_path: Path) -> None:
    watch = Watch(follow(a_run(tmp_path, u=np.tile(stairs(), 20))))
    watch.catch_up(0.0)
    assert watch.behind > 20_000
    lamp = facts(watch)["lamps"]["page"]
    assert lamp["state"] == "warn"
    assert "the run is not" in lamp["words"]


def test_a_recording_of_a_measured_u_is_held_against_the_model_of_such_a_u(tmp_path: Path) -> None:
    path = a_run(tmp_path)
    linear = replace(read(path), intersample="linear", u=np.sin(np.arange(4000) * 0.01), y=np.zeros(4000),
                     ledger=np.full(4000, Entry.RECORDED, dtype=np.uint8), steps=())
    write(path, linear, overwrite=True)
    played = workflow.simulate(path)
    latest = watched(path).latest.signals["x"]
    assert latest == pytest.approx(played.answer[-latest.size :], abs=2e-3)
