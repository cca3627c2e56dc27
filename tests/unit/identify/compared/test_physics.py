"""Is physics that appeared told from physics with two names, and from what the other day would not have shown?"""

from collections.abc import Mapping, Sequence
from types import SimpleNamespace
from typing import TYPE_CHECKING, cast

import pytest

from identify.compared import physics as tested
from identify.compared.physics import Explained, PhysicsChange, Pieces, kept, physics_changes, sets_tried, shared_set
from identify.compared.together import Rise
from identify.model import LinearF, Model, Physics, Rational

if TYPE_CHECKING:
    from identify.explain.explanation import Explanation
    from identify.identification import Identification

RAIL, DELAY, POLE = (Physics(name, {}, stage) for name, stage in (("saturation", "F"), ("dead_time", "G2"),
                                                                  ("extra_pole", "G2")))  # fmt: skip
ONE = Rational((1.0,), (1.0,))
PLAIN = Model("plain", ONE, LinearF(), ONE)


@pytest.fixture(autouse=True)
def _no_data(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let sides have no recordings: their fits are the costs a test gives, and no interval is wider."""
    monkeypatch.setattr(tested, "Side", SimpleNamespace(of=lambda found: SimpleNamespace(wider=1.0)))


def side(costs: Mapping[str, float], findings: Sequence[tuple[str, str]] = ()) -> Explained:
    """Return a side by its chi-squared with every set of effects, written ``saturation+dead_time``."""

    def fitted(pieces: Pieces) -> "Identification":
        names = "+".join(sorted(piece.id for piece in pieces))
        searched = tuple(SimpleNamespace(name=f"{piece.id}.value") for piece in pieces)
        fit = SimpleNamespace(cost=costs[names], coordinates=searched, chain=SimpleNamespace(added=()))
        return cast("Identification", SimpleNamespace(fit=fit))

    effects = [SimpleNamespace(id=name, stage=stage, could_also_be=()) for name, stage in findings]
    return Explained(cast("Explanation", SimpleNamespace(effects=effects)), fitted)


def judged(
    monkeypatch: pytest.MonkeyPatch, before: Explained, after: Explained, pieces: Pieces, same_p: float
) -> tuple[PhysicsChange, ...]:
    monkeypatch.setattr(tested, "rise", lambda sides, shared: Rise(0.0, 1.0, same_p))
    return physics_changes(before, after, pieces)


def test_sets_are_tried_from_the_smallest_to_all_together() -> None:
    assert sets_tried((), (RAIL,)) == [(), (RAIL,)]
    assert sets_tried((DELAY,), (RAIL,)) == [(DELAY,), (RAIL,), (RAIL, DELAY)]
    assert sets_tried((), ()) == [()]


def test_what_one_side_needs_is_tried_on_both() -> None:
    before, after = side({"": 100.0, "saturation": 99.0}), side({"": 500.0, "saturation": 101.0})
    assert shared_set(before, after, ((), (RAIL,))) == (RAIL,)
    assert (kept(before, (RAIL,)), kept(after, (RAIL,))) == ((), (RAIL,))


def test_two_names_for_the_same_data_are_no_change() -> None:
    before = side({"dead_time": 100.0, "extra_pole": 102.0, "dead_time+extra_pole": 99.0})
    after = side({"dead_time": 180.0, "extra_pole": 100.0, "dead_time+extra_pole": 99.0})
    assert shared_set(before, after, ((DELAY,), (POLE,))) == (POLE,)


def test_where_no_side_s_set_does_for_both_all_are_taken() -> None:
    before = side({"dead_time": 100.0, "saturation": 400.0, "dead_time+saturation": 99.0})
    after = side({"dead_time": 400.0, "saturation": 100.0, "dead_time+saturation": 99.0})
    assert shared_set(before, after, ((DELAY,), (RAIL,))) == (RAIL, DELAY)


CASES = [
    (100.0, 500.0, 1e-6, "appeared"), (500.0, 100.0, 1e-6, "disappeared"), (100.0, 500.0, 0.3, "cannot tell"),
    (500.0, 100.0, 0.3, "cannot tell"), (500.0, 500.0, 0.3, "in both"), (500.0, 500.0, 1e-6, "changed"),
]  # fmt: skip


@pytest.mark.parametrize(("before", "after", "same_p", "state"), CASES)
def test_an_effect_is_judged_by_who_needs_it_and_whether_it_can_be_the_same(
    monkeypatch: pytest.MonkeyPatch, before: float, after: float, same_p: float, state: str
) -> None:
    sides = [side({"": cost, "saturation": 99.0}) for cost in (before, after)]
    found = judged(monkeypatch, sides[0], sides[1], (RAIL,), same_p)
    assert [(change.id, change.state) for change in found] == [("saturation", state)]


def test_what_neither_side_needs_is_not_told(monkeypatch: pytest.MonkeyPatch) -> None:
    idle = side({"": 100.0, "saturation": 99.0})
    assert judged(monkeypatch, idle, idle, (RAIL,), 0.5) == ()


def test_blemishes_of_readings_are_told_by_where_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    spikes, lost = ("spikes", "sense"), ("missing_samples", "sense")
    found = judged(monkeypatch, side({"": 1.0}, [spikes]), side({"": 1.0}, [spikes, lost]), (), 0.5)
    assert {change.id: change.state for change in found} == {"spikes": "in both", "missing_samples": "appeared"}


def test_physics_the_rig_file_has_is_none_of_a_side_s_own() -> None:
    told = SimpleNamespace(model=SimpleNamespace(physics=(RAIL, DELAY)))
    own = Explained(cast("Explanation", told), lambda pieces: cast("Identification", None))
    assert own.own(tested.with_pieces(PLAIN, (RAIL,))) == (DELAY,)
