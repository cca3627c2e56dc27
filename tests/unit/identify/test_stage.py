"""Do places, blocks and clocks mean what reports and stages take them to mean?"""

import numpy as np
import pytest

from identify.stage import Block, Grid, Place, Ramp, memoryless


def test_places_are_ordered_from_source_to_sense_and_go_by_their_names():
    assert [place.label for place in sorted(Place)] == ["source", "G1", "F", "G2", "sense"]
    assert all(Place.of(place.label) is place for place in Place)
    assert all(Place), "the first of them is a place, too"


@pytest.mark.parametrize("label", ["g1", "", "SENSE"])
def test_another_word_is_no_place(label):
    with pytest.raises(ValueError, match=f"no stage {label!r}: source, G1, F, G2, sense"):
        Place.of(label)


def test_a_block_knows_its_clock():
    block = Block(np.zeros(3), np.zeros(3), 4, Grid("a", 0.5, 2, 10.0))
    assert block.time_s().tolist() == [12.0, 12.5, 13.0]


def test_a_law_without_memory_keeps_the_shape():
    run, shape = memoryless(np.square, Ramp())
    assert isinstance(shape, Ramp)
    assert run(Block(np.array([2.0, 3.0]), np.zeros(2), 0, Grid("a", 1.0))).tolist() == [4.0, 9.0]
