"""Is every byte that crossed the wire in the transcript, and is it said what found no room?"""

import ast
import re
from pathlib import Path

import h5py
import pytest

from rig import session
from rig.recording import read
from rig.transcript import Transcript, ongoing, taken
from rig.verifying import verify
from tests.rigs import GAIN
from tests.wire.emulated import emulated

PROTOCOL = """spec: 1
title: a short hold
question: What crosses the wire?
limits: {level: 10 V}
acquisition: {rate: 1907.35 Hz}
steps:
  - hold: {level: 0.5 V, time: 100 ms}
"""


def bytes_of(text: str, direction: str) -> bytes:
    """Return all bytes of one direction that a transcript has."""
    lines = [line.split(" ", 2) for line in text.splitlines() if not line.startswith("#")]
    return b"".join(ast.literal_eval(re.sub(r" and \d+ more$", "", data)) for _, to, data in lines if to == direction)


def test_both_directions_are_kept_in_order_and_to_the_byte() -> None:
    transcript = Transcript()
    transcript.sent(b"*IDN?\n")
    transcript.received(b"")
    transcript.received(bytes(range(256)))
    first, second, third = transcript.text().splitlines()
    assert first.startswith("# seconds since 20")
    assert second.endswith(r" > b'*IDN?\n'")
    assert ast.literal_eval(third.split(" ", 2)[2]) == bytes(range(256))


def test_the_middle_is_left_out_and_counted() -> None:
    transcript = Transcript(most=40)
    for number in range(20):
        transcript.sent(bytes([number]) * 5)
    text = transcript.text()
    assert bytes_of(text, ">") == b"".join(bytes([n]) * 5 for n in (0, 1, 2, 3, 16, 17, 18, 19))
    assert "# left out here: 60 bytes in 12 pieces" in text.splitlines()


def test_a_long_piece_is_kept_by_its_beginning() -> None:
    transcript = Transcript(piece=4)
    transcript.received(b"abcdefgh")
    assert transcript.text().splitlines()[1].endswith(" < b'abcd' and 4 more")


def test_nothing_is_kept_where_nobody_asked() -> None:
    ongoing().sent(b"x")
    assert ongoing().text() == ""
    with taken():
        assert ongoing().text() == ""
        ongoing().sent(b"x")
        assert ongoing().text()
    assert ongoing().text() == ""


@pytest.mark.parametrize("kind", ["serial", "redpitaya", "u2300a"])
def test_a_run_keeps_what_crossed_its_wire(tmp_path: Path, kind: str) -> None:
    (tmp_path / "p.yaml").write_text(PROTOCOL)
    out = tmp_path / "run.h5"
    with emulated(GAIN, kind=kind) as bench, taken():
        session.record(tmp_path / "p.yaml", bench.address, out, lambda done, total: None)
    found = read(out)
    sent, received = (bytes_of(found.transcript, direction) for direction in "><")
    asked = b"ID?" if kind == "serial" else b"*IDN?"
    assert asked in sent
    assert found.origin.equipment.model.split()[-1].encode() in received
    assert verify(out).intact
    with h5py.File(out, "r") as file:
        assert file["transcript"].asstr()[()] == found.transcript
