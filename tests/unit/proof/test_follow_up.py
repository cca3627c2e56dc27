"""Is a follow-up counted as what it was: decided, left open honestly, or decided wrongly?"""

from typing import Any

import pytest

from tests.proof.follow_up import outcome, summary
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
