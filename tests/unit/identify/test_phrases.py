"""Does a sentence leave open what the data leave open?"""

from identify.explain.explanation import Alternative, Finding
from identify.explain.phrases import called, listed


def finding(*others: Alternative) -> Finding:
    return Finding("extra_pole", "G1", "", 0.5, {}, "", "", others, None)


def test_a_name_that_is_as_likely_is_said_beside_the_first() -> None:
    twin, faint = Alternative("source_pole", "source", 0.45), Alternative("resonance", "G1", 0.05)
    assert called(finding(twin, faint)) == "extra_pole at G1 or source_pole at source"
    assert called(finding(faint)) == "extra_pole at G1"


def test_parts_are_joined_as_in_a_sentence() -> None:
    told = ["nothing", "a", "a and b", "a, b and c"]
    assert [listed(parts) for parts in ([], ["a"], ["a", "b"], ["a", "b", "c"])] == told
