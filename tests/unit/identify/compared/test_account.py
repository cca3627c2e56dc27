"""Are the few numbers that account for a change told apart from those that only move with them?"""

import numpy as np
import pytest

from identify.compared.account import Moved, accounted
from identify.compared.device import by_device

NAMES = ("F.S_L", "F.D_L", "F.S_U", "F.D_U", "G2.dead_time")


def move(by: dict[str, float], correlation: float = 0.0, names: tuple[str, ...] = NAMES) -> Moved:
    """Return how far values of size 1000 (in standard deviations) moved; the first two hang together."""
    covariance = np.eye(len(names))
    covariance[0, 1] = covariance[1, 0] = correlation
    return Moved(names, np.array([by.get(name, 0.0) for name in names]), np.full(len(names), 1000.0), covariance)


def test_a_number_that_moved_alone_accounts_for_all() -> None:
    found = accounted(move({"F.D_L": 9.0}))
    assert (found.names, found.instead) == (("F.D_L",), ())
    assert found.is_whole


def test_numbers_that_moved_both_are_named_both_the_larger_first() -> None:
    assert accounted(move({"F.D_L": 9.0, "G2.dead_time": -20.0})).names == ("G2.dead_time", "F.D_L")


def test_numbers_that_hang_together_can_take_each_other_s_place() -> None:
    found = accounted(move({"F.S_L": 1.5}, correlation=0.99))
    assert (found.names, found.instead) == (("F.S_L",), ("F.D_L",))
    assert accounted(move({"F.S_L": 15.0}, correlation=0.99)).instead == ()


def test_a_small_move_against_the_correlation_is_a_large_change() -> None:
    change = move({"F.S_L": 1.0, "F.D_L": -1.0}, correlation=0.99)
    assert change.left(()) == pytest.approx(2.0 / 0.01)
    assert accounted(change).names


def test_chance_needs_no_account() -> None:
    found = accounted(move({"F.S_L": 0.5}))
    assert found.names == ()
    assert found.is_whole


def test_a_change_of_everything_is_not_said_to_be_accounted_for() -> None:
    names = tuple(f"F.w{i}" for i in range(8))
    found = accounted(move(dict.fromkeys(names, 30.0), names=names))
    assert len(found.names) == 4
    assert not found.is_whole


def test_gains_and_delay_of_a_device_move_values_in_their_own_ways() -> None:
    of_input = {"F.S_L": 7.0, "F.S_U": 7.0}
    of_output = {"F.S_L": 7.0, "F.S_U": 7.0, "F.D_L": -7.0, "F.D_U": -7.0}
    for by in (of_input, of_output, {"G2.dead_time": 50.0}):
        assert by_device(move(by)).is_possible
    for by in ({"F.S_L": 7.0}, {"F.D_L": 7.0, "F.D_U": -7.0}):
        assert not by_device(move(by)).is_possible
