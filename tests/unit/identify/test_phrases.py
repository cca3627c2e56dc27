"""Does a sentence leave open what the data leave open?"""

from identify.explain.explanation import Alternative, Finding
from identify.explain.phrases import TAP, called, listed, probe


def finding(*others: Alternative) -> Finding:
    return Finding("extra_pole", "G1", "", 0.5, {}, "", "", others, None)


def test_a_name_that_is_as_likely_is_said_beside_the_first() -> None:
    twin, faint = Alternative("source_pole", "source", 0.45), Alternative("resonance", "G1", 0.05)
    assert called(finding(twin, faint)) == "extra_pole at G1 or source_pole at source"
    assert called(finding(faint)) == "extra_pole at G1"


def test_parts_are_joined_as_in_a_sentence() -> None:
    told = ["nothing", "a", "a and b", "a, b and c"]
    assert [listed(parts) for parts in ([], ["a"], ["a", "b"], ["a", "b", "c"])] == told


def test_the_probe_that_tells_two_stages_apart_is_at_the_end_of_the_path_that_one_of_them_is() -> None:
    """One at v says nothing of source and G1, which are both before it, nor one at w of G2 and the reading."""
    ends = ("G1", "source", "source"), ("G2", "sense", "sense")
    for stage, other, place in (*ends, ("G1", "F", "F"), ("G2", "F", "F"), ("G1", "G2", "G1")):
        assert probe(stage, other) == probe(other, stage) == TAP[place]
