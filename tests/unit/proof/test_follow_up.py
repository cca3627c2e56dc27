"""Is a follow-up counted as what it was: decided, left open honestly, or decided wrongly?"""

from typing import Any

import pytest

from tests.proof.follow_up import outcome, place_outcome, summary
from tests.proof.seal import Sealed

POLE, DELAY, SOURCE = ["extra_pole", "G1", 0.5], ["dead_time", "G2", 0.4], ["source_pole", "source", 0.5]
TRUE = ("extra_pole", "G1")


@pytest.mark.parametrize(
    ("first", "last", "ended"),
    [
        ([[POLE, DELAY]], [[POLE]], "decided"),
        ([[DELAY, POLE]], [[POLE]], "decided"),
        ([[POLE, DELAY]], [[POLE, DELAY]], "undecided"),
        ([[POLE, DELAY]], [[DELAY]], "decided wrongly"),
        ([[POLE, DELAY]], [[SOURCE]], "decided wrongly"),
        ([[POLE, DELAY]], [], "decided wrongly"),
        ([[POLE, SOURCE]], [[SOURCE, POLE]], "inseparable"),
        ([[POLE, SOURCE, DELAY]], [[SOURCE, POLE, DELAY]], "undecided"),
        ([[POLE]], [[POLE]], "decided at once"),
        ([[DELAY]], [[DELAY]], "wrong at once"),
        ([[["unnamed", "F", 1.0]]], [], "missed"),
        ([], [], "missed"),
    ],
)
def test_an_end_is_told_from_the_sets_alone(first: list[Any], last: list[Any], ended: str) -> None:
    assert outcome(TRUE, {"first": first, "last": last}, ("source_pole",)) == ended


@pytest.mark.parametrize(
    ("first", "last", "ended"),
    [
        ([["G1", False]], [["G1", False]], "decided at once"),
        ([["sense", False], ["G2", True]], [], "decided at once"),
        ([["F", False]], [["G1", False]], "missed"),
        ([], [["G1", False]], "missed"),
        ([["F", False], ["G1", False]], [["G1", False]], "decided"),
        ([["G1", False], ["F", False]], [["G1", False], ["source", True]], "decided"),
        ([["G1", False], ["F", False]], [["F", False], ["G1", False]], "undecided"),
        ([["F", False], ["G1", False]], [["F", False]], "decided wrongly"),
        ([["F", False], ["G1", False]], [], "decided wrongly"),
    ],
)
def test_of_physics_in_no_catalogue_the_stage_is_what_is_decided(first: Any, last: Any, ended: str) -> None:
    true = "sense" if first[:1] == [["sense", False]] else "G1"
    assert place_outcome(true, {"places": [first, last]}) == ended
    assert place_outcome(true, {"failure": "Traceback"}) == "failure"


def test_the_stages_told_before_and_after_are_counted() -> None:
    truth = Sealed('{"unheard": [{"stage": "G1"}]}', "salt")
    case = {"commit": "here", "truth": truth.text, "salt": truth.salt, "seal": truth.seal, "trial": "1"}
    asked = [[["F", False], ["G1", False]], [["G1", False], ["F", False]]]
    told = {**case, "outcome": "undecided", "first": [], "last": [], "places": asked}
    text = summary([told, {**case, "outcome": "failure", "failure": "Traceback"}])
    assert "The right stage was told in 0 of 2 before, in 1 after." in text
    assert "- undecided: `1` F|G1 → G1|F" in text
    assert "- failure: `1` nothing → nothing" in text


def entries(ends: list[str]) -> list[dict[str, Any]]:
    """Return entries of a study that ended so."""
    truth = Sealed("{}", "salt")
    sealed = {"commit": "here", "truth": truth.text, "salt": truth.salt, "seal": truth.seal}
    return [{"outcome": end, "trial": str(k), "first": [[POLE]], "last": [], **sealed} for k, end in enumerate(ends)]


def test_what_shrank_is_counted_among_what_was_open_with_the_truth_in_it() -> None:
    ends = ["decided", "decided", "inseparable", "undecided", "decided wrongly", "missed", "decided at once"]
    text = summary(entries(ends))
    assert "7 sealed cases at commit `here`" in text
    assert "(asked: 90 %): **3 of 5 (60 %)**" in text
    assert "| decided | 2 |" in text
    assert text.count("\n- ") == 2
    assert outcome(TRUE, {"failure": "Traceback"}, ()) == "failure"


def test_a_case_whose_truth_is_not_the_sealed_one_is_refused() -> None:
    (case,) = entries(["decided"])
    with pytest.raises(ValueError, match="0: the truth is not what was sealed"):
        summary([case | {"truth": "{ }"}])
