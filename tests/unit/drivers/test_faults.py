"""Does a script strike the messages it names, as often as it says, in the way it says?"""

import pytest

from drivers.emulators.faults import Fault, Faults, Mischief, Piece, What
from drivers.emulators.serial_faults import FaultyWire
from drivers.framing import Frame, FrameReader, encode
from drivers.serial_messages import Kind


def framed(payload: bytes) -> bytes:
    return b"<" + payload + b">"


def arrives(fault: Fault, *names: str, payload: bytes = b"abcdef") -> list[list[Piece]]:
    mischief = Mischief([fault])
    return [mischief.said(name, payload, framed) for name in names]


WHOLE = [Piece(b"<abcdef>")]


@pytest.mark.parametrize(("fault", "pieces"), [
    (Fault(What.LOST), []),
    (Fault(What.LATE, seconds=1.5), [Piece(b"", 1.5), *WHOLE]),
    (Fault(What.TWICE), WHOLE * 2),
    (Fault(What.SPLIT, size=3, seconds=0.1), [Piece(b"<ab"), Piece(b"cde", 0.1), Piece(b"f>", 0.1)]),
    (Fault(What.SHORT, size=5), [Piece(b"<ab")]),
    (Fault(What.SHORT, size=50), [Piece(b"")]),
    (Fault(What.FLIPPED, size=1), [Piece(b"<qbcdef>")]),
    (Fault(What.FLIPPED, size=-1), [Piece(b"<abcdef.")]),
    (Fault(What.PRECEDED, new=b"??"), [Piece(b"??"), *WHOLE]),
    (Fault(What.REPLACED, new=b"no"), [Piece(b"<no>")]),
    (Fault(What.REPLACED, old=b"cd", new=b"no"), [Piece(b"<abnoef>")]),
    (Fault(What.TORN), [Piece(b"<abc")]),
    (Fault(What.MUTE, seconds=1.0), WHOLE),
], ids=lambda value: value.what.name if isinstance(value, Fault) else "")
def test_what_arrives_of_a_message(fault: Fault, pieces: list[Piece]) -> None:
    assert arrives(fault, "ANY") == [pieces]


def test_a_fault_strikes_the_messages_it_names_as_often_as_it_says() -> None:
    fault = Fault(What.LOST, to="LEV", skip=1, times=2)
    told = ["ID?", "LEVEL?", "LEVEL?", "ID?", "LEVEL?", "LEVEL?"]
    assert [bool(pieces) for pieces in arrives(fault, *told)] == [True, True, False, True, False, True]


def test_the_two_directions_are_told_apart() -> None:
    mischief = Mischief([Fault(What.LOST, to="GO", heard=True)])
    assert mischief.said("GO", b"", framed)
    assert not mischief.heard("GO", b"", framed)
    assert mischief.struck == [1]


def test_faults_of_one_message_add_up() -> None:
    mischief = Mischief([Fault(What.REPLACED, new=b"no"), Fault(What.PRECEDED, new=b"!"), Fault(What.TWICE)])
    assert b"".join(piece.data for piece in mischief.said("ID?", b"yes", framed)) == b"!<no>!<no>"


def test_what_happens_to_the_device_happens_once() -> None:
    mute, torn = Fault(What.MUTE, at_sample=100, seconds=1.0), Fault(What.TORN, to="GO")
    mischief = Mischief([mute, torn])
    assert mischief.happening(100) == []
    assert mischief.happening(101) == [mute]
    assert mischief.happening(500) == []
    mischief.said("GO", b"", framed)
    assert mischief.happening(500) == [torn]
    assert mischief.struck == [1, 1]


def test_a_fault_of_messages_may_wait_for_a_sample() -> None:
    mischief = Mischief([Fault(What.LOST, to="LEVEL?", at_sample=100), Fault(What.TORN, to="GO", at_sample=100)])
    assert mischief.of_messages
    for played, arrives in ((0, True), (100, True), (101, False)):
        assert mischief.happening(played) == []
        assert bool(mischief.said("LEVEL?", b"", framed)) is arrives


@pytest.mark.parametrize("what", [What.LATE, What.SPLIT])
def test_a_fault_that_never_ends_is_refused(what: What) -> None:
    with pytest.raises(ValueError, match="takes a finite time"):
        Fault(what)


def test_a_reply_on_the_serial_wire_is_named_like_its_command() -> None:
    wire = FaultyWire(Faults((Fault(What.LOST, to="GO"), Fault(What.LOST, to="STATUS"))))
    wire.to_device(encode(Frame(Kind.COMMAND, 7, b"GO")) + encode(Frame(Kind.COMMAND, 8, b"HALT")), 0.0)
    said = [Frame(Kind.REPLY, 7, b"OK\n"), Frame(Kind.STATUS, 0), Frame(Kind.REPLY, 8, b"OK\n"), Frame(Kind.INPUT, 5)]
    arrived = FrameReader().feed(wire.to_host(b"".join(map(encode, said)), 0.0))
    assert arrived == said[2:]


def test_what_is_late_holds_up_all_behind_it() -> None:
    wire = FaultyWire(Faults((Fault(What.LATE, to="STATUS", seconds=1.0),)))
    status, sample = encode(Frame(Kind.STATUS, 0)), encode(Frame(Kind.INPUT, 0))
    assert wire.to_host(status, 10.0) == b""
    assert wire.to_host(sample, 10.5) == b""
    assert wire.busy
    assert wire.to_host(b"", 11.0) == status + sample
    assert not wire.busy
