"""Does an emulated instrument read SCPI as the standard writes it, and put what it refuses into its error queue?"""

from collections.abc import Mapping

import pytest

from drivers.emulators.scpi_instrument import BlockHandler, Handler, RefusedError, ScpiParser, real, whole, word


class Instrument:
    identity = "MAKER,MODEL,1,2"

    def __init__(self) -> None:
        self.level, self.pattern, self.resets = 0.0, b"", 0

    def commands(self) -> Mapping[str, Handler]:
        return {"SOURce:VOLTage": self._set, "SOURce:VOLTage?": lambda text, now_s: f"{self.level:g}",
                "ACQuire:DECimation[:Factor]?": lambda text, now_s: "8"}

    def blocks(self) -> Mapping[str, BlockHandler]:
        return {"DATA": self._take}

    def reset(self, now_s: float) -> None:
        self.resets += 1

    def _set(self, text: str, now_s: float) -> None:
        self.level = real(text.partition(",")[0], -10.0, 10.0)

    def _take(self, payload: bytes, now_s: float) -> None:
        self.pattern = payload


@pytest.fixture
def instrument() -> Instrument:
    return Instrument()


@pytest.fixture
def parser(instrument: Instrument) -> ScpiParser:
    return ScpiParser(instrument)


@pytest.mark.parametrize("header", ["SOUR:VOLT", "SOURCE:VOLTAGE", "sour:volt", ":Source:Volt", "sOURcE:vOLT"])
def test_headers_are_long_or_short_in_any_case(parser: ScpiParser, instrument: Instrument, header: str) -> None:
    assert parser.execute(f"{header} 2.5,(@201)\n".encode(), 0.0) == b""
    assert instrument.level == 2.5


@pytest.mark.parametrize("header", ["SOURC:VOLT 1", "SOUR:VOLTS 1", "SOUR", "VOLT 1", "SOUR:VOLT:X 1", "NONSENSE?"])
def test_neither_long_nor_short_is_no_header(parser: ScpiParser, instrument: Instrument, header: str) -> None:
    assert parser.execute(header.encode(), 0.0) == b""
    assert parser.execute(b"SYST:ERR?", 0.0) == b'-113,"Undefined header"'
    assert parser.execute(b"SYST:ERR?", 0.0) == b'0,"No error"'
    assert instrument.level == 0.0


def test_what_stands_in_brackets_may_be_left_out(parser: ScpiParser) -> None:
    assert parser.execute(b"ACQ:DEC?", 0.0) == parser.execute(b"ACQUIRE:DEC:FACTOR?\r\n", 0.0) == b"8"
    assert parser.execute(b"SYST:ERR:NEXT?", 0.0) == b'0,"No error"'


def test_several_commands_in_a_message_reply_as_one(parser: ScpiParser) -> None:
    assert parser.execute(b"*CLS;:SOUR:VOLT 3;:SOUR:VOLT?;*ESE 137;*ESE?;*IDN?\n", 0.0) == b"3;137;MAKER,MODEL,1,2"


@pytest.mark.parametrize("payload", [b"", b"\n", b"ends in \r\n", b"; SOUR:VOLT 5;", b"#15hello", bytes(range(256))])
def test_a_block_holds_anything(parser: ScpiParser, instrument: Instrument, payload: bytes) -> None:
    for end in (b"", b"\n", b"\r\n"):
        instrument.pattern = b"before"
        parser.execute(f"DATA #8{len(payload):08d}".encode() + payload + end, 0.0)
        assert instrument.pattern == payload
        assert parser.execute(b"SYST:ERR:COUN?", 0.0) == b"0"
    assert instrument.level == 0.0


@pytest.mark.parametrize("block", [b"#15hell", b"#15hello more", b"#0hello", b"hello", b"", b"#1xhello", b"#9"])
def test_a_block_that_is_not_whole_is_refused(parser: ScpiParser, instrument: Instrument, block: bytes) -> None:
    parser.execute(b"DATA " + block, 0.0)
    assert parser.execute(b"SYST:ERR?", 0.0).startswith(b"-161")
    assert instrument.pattern == b""


@pytest.mark.parametrize(("text", "number"), [("", -109), ("x", -224), ("11", -222), ("nan", -222)])
def test_a_parameter_that_cannot_be_is_told_by_its_number(parser: ScpiParser, text: str, number: int) -> None:
    parser.execute(f"SOUR:VOLT {text}".encode(), 0.0)
    assert parser.execute(b"SYST:ERR?", 0.0).startswith(f"{number},".encode())


def test_errors_come_oldest_first_and_are_cleared(parser: ScpiParser, instrument: Instrument) -> None:
    parser.execute(b"SOUR:VOLT 99;:NONSENSE", 0.0)
    assert parser.execute(b"SYST:ERR:COUN?", 0.0) == b"2"
    assert parser.execute(b"SYST:ERR?", 0.0).startswith(b"-222")
    assert parser.execute(b"*CLS;:SYST:ERR?;*RST", 0.0) == b'0,"No error"'
    assert instrument.resets == 1


def test_numbers_and_words_are_checked() -> None:
    assert whole("7", 0, 10) == 7
    assert word("burs", "BURSt", "CONTinuous") == word("BURST", "BURSt") == "BURST"
    for wrong in ("7.5", "11", "-1", "seven"):
        with pytest.raises(RefusedError):
            whole(wrong, 0, 10)
    with pytest.raises(RefusedError):
        word("BUR", "BURSt")
