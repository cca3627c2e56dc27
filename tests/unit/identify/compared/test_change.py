"""Is a difference as sure as its two intervals, and are many tests at once paid for?"""

from dataclasses import replace
from math import inf

import numpy as np
import pytest

from identify.compared.change import FALSE_ALARMS, Change, among_all, difference, noise_interval
from identify.interval import Interval
from identify.noise import Noise

ONE = Interval(1.0, 0.9, 1.1)


def test_halves_of_intervals_add_in_squares() -> None:
    by = difference(ONE, Interval(1.5, 1.3, 1.7))
    assert (by.value, by.low, by.high) == pytest.approx((0.5, 0.5 - np.hypot(0.1, 0.2), 0.5 + np.hypot(0.1, 0.2)))


def test_only_the_ends_that_face_each_other_count() -> None:
    lopsided = Interval(1.5, 1.49, 9.0)
    assert changed(ONE, lopsided).standard_errors == pytest.approx(1.96 * 0.5 / np.hypot(0.01, 0.1), rel=1e-3)
    assert changed(lopsided, ONE).standard_errors == pytest.approx(-1.96 * 0.5 / np.hypot(0.01, 0.1), rel=1e-3)


def test_an_open_interval_makes_every_change_possible_and_none_sure() -> None:
    assert changed(ONE, Interval(5.0, 0.0, inf)).by.high == inf
    assert changed(Interval(0.1, 0.0, inf), ONE).standard_errors == 0.0


def test_what_is_certain_on_both_sides_and_the_same_did_not_change() -> None:
    certain = Interval(2.0, 2.0, 2.0)
    assert changed(certain, certain).standard_errors == 0.0
    assert changed(certain, Interval(3.0, 3.0, 3.0)).standard_errors == inf


def changed(before: Interval, after: Interval) -> Change:
    return Change("F.D_L", "V", before, after, difference(before, after), 1.0)


def rows(*p_values: float) -> list[Change]:
    return [replace(changed(ONE, ONE), name=f"x{i}", p_value=p) for i, p in enumerate(p_values)]


def test_the_smallest_of_many_is_multiplied_by_their_number_and_none_overtakes() -> None:
    found = among_all(rows(0.004, 0.5, 0.003, 0.0001))
    assert [c.adjusted for c in found] == pytest.approx([0.009, 0.5, 0.009, 0.0004])
    assert [c.state for c in found] == ["changed", "no change seen", "changed", "changed"]


def test_what_is_not_told_is_not_tested() -> None:
    one, other = rows(0.006, 0.0)
    alone, untold = among_all([one, replace(other, state="not told")])
    assert alone.adjusted == 0.006
    assert untold.state == "not told"


def test_chance_alone_raises_the_alarm_as_rarely_as_is_said() -> None:
    chance = np.random.default_rng(0).uniform(size=(1500, 9))
    alarms = sum(any(c.state == "changed" for c in among_all(rows(*row))) for row in chance)
    assert alarms / 1500 == pytest.approx(FALSE_ALARMS, abs=4 * np.sqrt(FALSE_ALARMS / 1500))


def test_the_interval_of_a_noise_holds_it_as_often_as_is_said() -> None:
    freedom, rng = 200, np.random.default_rng(1)
    told = [noise_interval(Noise(float(np.sqrt(rng.chisquare(freedom) / freedom)), "", freedom)) for _ in range(600)]
    assert np.mean([i.low <= 1.0 <= i.high for i in told]) == pytest.approx(0.95, abs=0.04)


def test_a_noise_that_was_given_has_no_interval() -> None:
    assert noise_interval(Noise(0.01, "the rig file")) == Interval(0.01, 0.01, 0.01)
