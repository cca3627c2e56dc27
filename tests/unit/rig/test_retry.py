"""Does a retry begin with a rig whose past no longer matters, and play the lost step and all after it?"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.trace import Step
from rig.errors import FileError
from rig.limits import Limits
from rig.plan import Plan
from rig.protocol import parse_protocol
from rig.retry import again, path_of, paths_beside, preconditioning

RATE_HZ = 1000.0
PROTOCOL = """
spec: 1
title: a step
question: What is done about lost samples?
limits: {level: 10 V}
acquisition: {rate: 1 kHz}
steps:
  - hold: {level: 1 V, time: 1 s}
"""


def plan(slew: float | None = None) -> Plan:
    """Return three passes: two of a sine that reaches 4 V and -3 V, one between -1 V and 1 V."""
    wave = np.sin(np.arange(400) * 2 * np.pi / 400)
    big = np.where(wave > 0, 4.0 * wave, 3.0 * wave)
    steps = (Step("big", "sine", 0, 400), Step("big", "sine", 400, 800, 1), Step("small", "sine", 800, 1200),
             Step("big", "sine", 1200, 1600, 2))  # fmt: skip
    return Plan("waves", np.concatenate([big, big, np.cos(np.arange(400) * 0.01), big]), RATE_HZ, steps,
                Limits(-5.0, 5.0, slew), 0.5, 0.1, retries=2)


def play(w_v: float, u: np.ndarray, half_gap_v: float = 1.25) -> float:
    """Return where a play operator ends that was at ``w_v`` before ``u``."""
    for level in u:
        w_v = min(max(w_v, level - half_gap_v), level + half_gap_v)
    return float(w_v)


def test_the_lost_step_and_all_after_it_are_played_again() -> None:
    first = plan()
    second = again(first, 850)
    assert second is not None
    lead = second.steps[0].stop
    assert np.array_equal(second.u[lead:], first.u[800:])
    assert second.steps == (
        Step("preconditioning", "table", 0, lead), Step("small", "sine", lead, lead + 400),
        Step("big", "sine", lead + 400, lead + 800),
    )  # fmt: skip
    assert (second.initial, second.retries, second.title) == ("in_motion", 1, "waves, again from small")


def test_retries_come_to_an_end() -> None:
    second = again(plan(), 100)
    assert second is not None
    third = again(second, second.steps[1].start)
    assert third is not None
    assert again(third, 100) is None
    assert third.steps[1:] == second.steps[1:]


@pytest.mark.parametrize("lost_at", [None, 1600])
def test_where_nothing_is_to_be_played_again_there_is_no_retry(lost_at: int | None) -> None:
    assert again(plan(), lost_at) is None
    assert again(replace(plan(), retries=0), 100) is None


@pytest.mark.parametrize(("until", "levels"), [
    (350, (4.0, -3.0)), (720, (4.0, -3.0)), (520, (-3.0, 4.0)), (0, (0.0, 0.0)),
])
def test_the_extremes_of_what_was_played_are_visited_in_their_order(until: int, levels: tuple[float, float]) -> None:
    u = preconditioning(plan(), until, 1.0)
    assert u[99] == pytest.approx(levels[0])
    assert u[199] == pytest.approx(levels[1])
    assert (u[-100:] == 1.0).all()
    assert u[0] == pytest.approx(0.5 + (levels[0] - 0.5) / 100)


@pytest.mark.parametrize("until", [350, 520, 1300])
def test_the_gap_forgets_where_it_was(until: int) -> None:
    u = preconditioning(plan(), until, 1.0)
    assert len({play(before_v, u) for before_v in np.linspace(-20.0, 20.0, 41)}) == 1


def test_the_slope_of_a_preconditioning_is_within_the_limits() -> None:
    for lost_at in (100, 900, 1300):
        first = plan(slew=40.0)
        u = preconditioning(first, lost_at, 1.0)
        assert np.abs(np.diff(u, prepend=first.safe_level_v)).max() * RATE_HZ <= 40.0 * (1 + 1e-9)
        assert np.abs(np.diff(u, prepend=first.safe_level_v)).max() * RATE_HZ >= 30.0


def test_a_loss_in_the_preconditioning_does_not_double_it() -> None:
    second = again(plan(), 850)
    assert second is not None
    third = again(second, 10)
    assert third is not None
    assert [step.label for step in third.steps] == ["preconditioning", "small", "big"]


@pytest.mark.parametrize(("text", "retries"), [("report", 0), ("retry 1", 1), ("retry 99", 99)])
def test_a_protocol_says_what_is_done_about_lost_samples(text: str, retries: int) -> None:
    assert parse_protocol(f"{PROTOCOL}on_overrun: {text}\n", "p.yaml").retries == retries


@pytest.mark.parametrize("text", ["retry", "retry 0", "retry 100", "ignore", "retry -1"])
def test_anything_else_is_refused_with_its_place(text: str) -> None:
    with pytest.raises(FileError, match=r"p.yaml:\d+: on_overrun: .*report, or retry N"):
        parse_protocol(f"{PROTOCOL}on_overrun: {text}\n", "p.yaml")


def test_retries_stand_beside_their_run(tmp_path: Path) -> None:
    run = tmp_path / "run.h5"
    for number in (1, 3):
        path_of(run, number).touch()
    assert [path.name for path in paths_beside(run)] == ["run.retry1.h5", "run.retry3.h5"]
