"""Which data fit, and which are kept back?"""

from dataclasses import replace

import numpy as np
import pytest

from identify.holdout import counted, last_repeats, settling_s, split
from identify.model import Backlash, LinearF, Model, Rational
from identify.trace import Array, Step, Trace

LAG = Rational((1.0,), (0.01, 1.0))
MODEL = Model("two lags", LAG, LinearF(), Rational((1.0,), (0.02, 1.0)), 0.01)
GAP = replace(MODEL, f=Backlash(1.0, 0.1, 1.0, -0.1))
RATE_HZ = 1000.0


def trace(name: str = "a", size: int = 4000, steps: tuple[Step, ...] = (), **kind: object) -> Trace:
    u = np.sign(np.sin(2 * np.pi * np.arange(size) / 250))
    y = 0.5 * u + np.random.default_rng(size).normal(0.0, 0.01, size)
    return Trace(name, RATE_HZ, u, y, steps=steps, **kind)  # type: ignore[arg-type]


def test_settling_is_that_of_the_slowest_poles_and_the_dead_time() -> None:
    late = Model("late", Rational((1.0,), (0.01, 1.0), 0.5), LinearF(), Rational((2.0,), (1.0,)))
    assert settling_s(MODEL) == pytest.approx(0.03 * np.log(1e4))
    assert settling_s(late) == pytest.approx(0.5 + 0.01 * np.log(1e4))


def test_a_block_that_is_not_stable_is_refused_with_its_pole() -> None:
    with pytest.raises(ValueError, match="not stable: a pole at 100"):
        settling_s(Model("no", Rational((1.0,), (-0.01, 1.0)), LinearF(), LAG))


def test_samples_before_a_rig_in_motion_has_settled_do_not_count() -> None:
    moving = counted(trace(from_rest=False), MODEL)
    first = int(np.argmax(moving))
    assert first == round(3 * 1e3 * settling_s(MODEL))
    assert moving[first:].all()
    assert counted(trace(), GAP).all()


def test_what_an_offset_of_a_line_has_left_in_g2_does_not_count() -> None:
    """A line F may have an offset, and G2 has settled on it before the run; a tenth of a run is given up at most."""
    late = counted(trace(size=8000), MODEL)
    assert int(np.argmax(late)) == round(3 * 20.0 * np.log(1e4))
    assert late[int(np.argmax(late)) :].all()
    assert int(np.argmax(counted(trace(size=2000), MODEL))) == 200


def test_samples_that_were_lost_do_not_count() -> None:
    valid = np.ones(4000, dtype=bool)
    valid[100:200] = False
    assert np.array_equal(counted(trace(valid=valid), GAP), valid)


def test_runs_that_are_named_are_kept_back_whole() -> None:
    data = split(GAP, [trace("a")], [trace("b")])
    assert [o.trace.name for o in data.train] == ["a"]
    assert [(o.trace.name, o.count) for o in data.test] == [("b", 4000)]
    assert "--hold-out" in data.how


def test_the_last_repeat_is_kept_back_where_there_are_repeats() -> None:
    steps = (Step("x", "table", 0, 1000), Step("x", "table", 1000, 2000, 1), Step("y", "table", 2000, 4000))
    kept = last_repeats(trace(steps=steps))
    assert np.flatnonzero(kept).tolist() == list(range(1000, 2000))
    data = split(GAP, [trace(steps=steps)])
    assert not (data.train[0].use & data.test[0].use).any()
    assert np.array_equal(data.test[0].use, kept)


def test_else_the_end_of_every_run_is_kept_back() -> None:
    data = split(GAP, [trace()])
    assert data.train[0].use.tolist() == [True] * 2800 + [False] * 1200
    assert np.array_equal(data.test[0].use, ~data.train[0].use)
    assert "30 %" in data.how


@pytest.mark.parametrize(
    ("u", "first"),
    [
        (np.sin(np.linspace(0.0, 40.0 * np.pi, 4000)), 2800),
        (np.where(np.arange(4000) < 3600, 0.0, 1.0), 2400),  # moves in its last tenth alone
        (np.sin(np.linspace(0.0, np.pi, 4000)) ** 2, 2000),  # comes back in its second half alone
        (np.concatenate([np.zeros(3000), np.linspace(0.0, 1.0, 100), np.ones(900)]), 1600),
        (np.zeros(4000), 2800),
    ],
    ids=["sine", "late step", "up and back", "late ramp", "still"],
)
def test_what_moves_in_one_part_of_a_run_alone_is_not_kept_back(u: Array, first: int) -> None:
    data = split(GAP, [replace(trace(), u=u)])
    kept = np.flatnonzero(data.test[0].use)
    assert (kept[0], kept.size) == (first, 1200)
    assert np.array_equal(data.test[0].use, ~data.train[0].use)
    assert ("the last 30 %" in data.how) == (first == 2800)


def test_a_stretch_without_which_no_run_moves_as_far_is_the_one_that_takes_least() -> None:
    ramp = np.repeat(np.linspace(0.0, 1.0, 10) ** 2, 400)  # steps grow up to its end
    data = split(GAP, [replace(trace(), u=np.concatenate([ramp[:3600], np.full(400, 10.0)]))])
    assert data.train[0].use[-1]


def test_of_beginnings_nothing_need_be_left_for_the_proof() -> None:
    early = replace(trace(), valid=np.arange(4000) < 2000)
    with pytest.raises(ValueError, match="no sample is left"):
        split(GAP, [early])
    data = split(GAP, [early], beginnings=True)
    assert ([o.count for o in data.train], data.test) == ([2000], ())


def test_nothing_to_fit_is_said() -> None:
    with pytest.raises(ValueError, match="every one given is held out"):
        split(GAP, [], [trace()])
    with pytest.raises(ValueError, match="no sample is left"):
        split(GAP, [trace(size=300, from_rest=False)])
