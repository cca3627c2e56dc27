"""Is a picture drawn when it moves, one of the whole run in its turn, and all of them once the run has ended?"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rig.live import following
from rig.live.columns import VISIBLE, columns
from rig.live.figures import EVERY, TURNS, Figures, figures
from rig.live.following import follow
from rig.live.watching import Watch
from tests.unit.rig.live.test_watching import a_run

STRETCH = 1000


@pytest.fixture
def watch(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Watch:
    """Return what is known of the first thousand samples of a recording that is looked at by thousands."""
    monkeypatch.setattr(following, "AT_ONCE", STRETCH)
    begun = Watch(follow(a_run(tmp_path, bent=0.05)))
    begun.catch_up(0.0)
    return begun


def moved(shown: Figures, watch: Watch, number: int, *, going_on: bool) -> set[str]:
    """Return the names of what is drawn anew."""
    before = {name: dict(source.data) for name, source in shown.sources.items()}
    watch.stands = replace(watch.stands, going_on=going_on)
    shown.show(watch, columns(watch), number)
    return {name for name, source in shown.sources.items()
            if any(source.data[column] is not values for column, values in before[name].items())}


def test_what_has_not_moved_is_not_drawn_again(watch: Watch) -> None:
    shown = figures(watch, columns(watch))
    assert not moved(shown, watch, 0, going_on=False)
    watch.catch_up(0.0)
    assert {"latest", "trail", "whole", "residual"} <= moved(shown, watch, 1, going_on=False)
    assert not moved(shown, watch, 2, going_on=False)


def test_pictures_of_the_whole_run_take_turns_and_are_whole_at_its_end(watch: Watch) -> None:
    shown = figures(watch, columns(watch))
    for number in range(1, EVERY + 1):
        watch.catch_up(0.0)
        drawn = moved(shown, watch, number, going_on=True)
        assert "latest" in drawn
        assert {name for name in TURNS if name in drawn} == {name for name, at in TURNS.items() if number % EVERY == at}
    while watch.behind:
        watch.catch_up(0.0)
    moved(shown, watch, EVERY + 1, going_on=False)
    for name, source in shown.sources.items():
        for column, values in columns(watch)[name].items():
            np.testing.assert_array_equal(source.data[column], values, err_msg=name)


def test_a_picture_of_the_whole_run_is_as_fine_as_it_shows_and_no_finer(watch: Watch) -> None:
    while watch.behind:
        watch.catch_up(0.0)
    held, exact = columns(watch)["residual"], watch.whole["residual"]
    span = np.nanmax(exact.high) - np.nanmin(exact.low)
    for name in ("low", "high"):
        np.testing.assert_allclose(held[name], getattr(exact, name), rtol=0.0, atol=0.51 * span / VISIBLE)
    assert np.unique(held["mean"]).size < np.unique(watch.means.means()).size
