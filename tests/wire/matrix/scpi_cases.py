"""What goes wrong between a host and an instrument that is asked and answers, over TCP or USB?

These transports deliver bytes whole and in order, or break: bits do not flip. What does fail are instruments that
answer late, twice, in part, wrongly or not at all, and links that tear.
"""

import math
from dataclasses import dataclass

from drivers.emulators.faults import Fault, Faults, What
from tests.wire.matrix.case import Case, End, Output, happens, script

GONE = "not confirmed safe"
ALWAYS = math.inf
MIDDLE, PLAYED = 6000, 9000
"""Samples: a run is in its middle, or nearly at its end."""


@dataclass(frozen=True)
class Words:
    """What the messages of an instrument are called: those the faults strike.

    ``own``, in its identity, is what no other kind has there; ``stranger`` is what is said of one that has not.
    ``untouched``: where the output is when the first settings are refused. ``twice``: how a reply that comes twice
    ends; TCP shows that bytes are waiting, USBTMC does not.
    """

    own: bytes
    stranger: str
    untouched: Output
    twice: End
    said_twice: tuple[str, str]
    setting: str
    start: str
    ready: str
    data: str
    level: str
    stop: str


def late(to: str, seconds: float, times: float = 1) -> Faults:
    """Return the script of replies that come late."""
    return script(Fault(What.LATE, to=to, seconds=seconds, times=times))


def said(to: str, new: bytes, times: float = 1, skip: int = 0) -> Faults:
    """Return the script in which something else is replied."""
    return script(Fault(What.REPLACED, to=to, new=new, times=times, skip=skip))


def scpi_cases(words: Words) -> tuple[Case, ...]:
    """Return the faults of an instrument that calls its messages so."""
    return (*_connecting(words), *_starting(words), *_running(words), *_blocks(words), *_gone(words), *_ending(words))


def _connecting(words: Words) -> tuple[Case, ...]:
    refused = {"end": End.REFUSED, "output": Output.NONE}
    return (
        Case("identity comes 0.7 s late", late("*IDN?", 0.7), End.WHOLE),
        Case("the first identity comes 2.5 s late", late("*IDN?", 2.5), End.WHOLE),
        Case("nobody answers", script(Fault(What.LOST, times=ALWAYS)), says="no answer", **refused),
        Case("wrong identity: another maker", script(Fault(What.REPLACED, to="*IDN?", times=ALWAYS, old=words.own,
                                                           new=b"ACME")), says=words.stranger, **refused),
        Case("an identity that is none", said("*IDN?", b"hello", ALWAYS), says="identity", **refused),
        Case("garbage before the first reply", script(Fault(What.PRECEDED, new=b"\x00\xffboot\n")), End.WHOLE),
        Case("a line without an end", script(Fault(What.PRECEDED, to="*IDN?", times=ALWAYS, new=b"x" * 100_000)),
             says="line", **refused),
    )


def _starting(words: Words) -> tuple[Case, ...]:
    return (
        Case("a setting is read back 1.5 s late", late(words.setting, 1.5), End.FAILED, "no answer"),
        Case("a setting was not taken", said(words.setting, b"17"), End.FAILED, "17"),
        Case("a setting read back as control characters", said(words.setting, b"\x00\x1b[2J\x07"), End.FAILED,
             r"\x00\x1b[2J\x07"),
        Case("a setting is refused", said("SYST:ERR?", b'-222,"Data out of range"'), End.FAILED, "Data out of range"),
        Case("errors without an end", said("SYST:ERR?", b'-350,"Queue overflow"', ALWAYS), End.FAILED, GONE,
             words.untouched),
        Case("the start never arrives", script(Fault(What.LOST, to=words.start, heard=True)), End.FAILED,
             "fell silent"),
    )


def _running(words: Words) -> tuple[Case, ...]:
    return (
        Case("samples come 0.5 s late", late(words.data, 0.5), End.WHOLE),
        Case("samples come after their time-out", late(words.data, 3.0), End.FAILED, "no answer", in_ci=True),
        Case("samples never come", script(Fault(What.LOST, to=words.data)), End.FAILED, "no answer"),
        Case("a block comes twice", script(Fault(What.TWICE, to=words.data)), words.twice, words.said_twice[0],
             in_ci=True),
        Case("the state comes 0.4 s late, three times", late(words.ready, 0.4, 3), End.WHOLE),
        Case("the state comes after its time-out", late(words.ready, 1.5), End.FAILED, "no answer", in_ci=True),
        Case("the state comes twice", script(Fault(What.TWICE, to=words.ready, skip=3)), words.twice,
             words.said_twice[1]),
        Case("all replies are 20 ms late", Faults(delay_s=0.02), End.WHOLE),
        Case("mute for 0.5 s", happens(What.MUTE, 3000, 0.5), End.WHOLE),
        Case("mute for 2 s", happens(What.MUTE, 3000, 2.0), End.FAILED, "no answer"),
        Case("the host sleeps for 1 s", Faults(), End.WHOLE, naps=((2000, 1.0),)),
    )


def _blocks(words: Words) -> tuple[Case, ...]:
    return (
        Case("blocks in pieces of 500 bytes", script(Fault(What.SPLIT, to=words.data, size=500, seconds=0.002,
                                                           times=ALWAYS)), End.WHOLE, in_ci=True),
        Case("a block cut short", script(Fault(What.SHORT, to=words.data, size=100)), End.FAILED, "no answer",
             in_ci=True),
        Case("a block longer than it says", said(words.data, b"#14\n\n\n\n" + b"\x0a" * 40), End.FAILED, "bytes",
             in_ci=True),
        Case("a block of 999,999,999 bytes", said(words.data, b"#9999999999"), End.FAILED, "999999999"),
        Case("a block whose size is no number", said(words.data, b"#8ABCDEFGH"), End.FAILED, "size of a block"),
        Case("a block of no stated size", said(words.data, b"#0abcdefgh"), End.FAILED, "a block"),
        Case("a block of half a sample", said(words.data, b"#17\n\n\n\n\n\n\n"), End.FAILED, "7 bytes"),
        Case("an empty block", said(words.data, b"#10"), End.FAILED, "0 bytes"),
        Case("a word in place of a block", said(words.data, b"BUSY"), End.FAILED, "a block"),
        Case("a state there is not", said(words.ready, b"\x0bQ"), End.FAILED, words.ready.rstrip("?")),
    )


def _gone(words: Words) -> tuple[Case, ...]:
    """Return what ends a run in the middle: played in real time, so that there is a middle."""
    def case(name: str, faults: Faults, says: str, output: Output = Output.SAFE, in_ci: bool = False) -> Case:
        return Case(name, faults, End.FAILED, says, output, keeps=500, speed=1.0, in_ci=in_ci)

    other = Fault(What.REPLACED, to="*IDN?", skip=1, times=ALWAYS, old=words.own, new=b"ACME")
    return (
        case("mute from now on", happens(What.MUTE, MIDDLE), GONE),
        case("hung with its output on", happens(What.HUNG, MIDDLE), GONE, Output.TOLD),
        case("restarted in the middle", happens(What.RESTARTED, MIDDLE), "the device | a block of"),
        case("link torn for good", happens(What.TORN, MIDDLE), GONE, Output.TOLD),
        case("link torn within a block", script(Fault(What.TORN, to=words.data, skip=3, seconds=0.3)), "gone"),
        case("link torn and back after 0.5 s", happens(What.TORN, MIDDLE, 0.5), "gone", in_ci=True),
        case("unplugged for good", happens(What.UNPLUGGED, MIDDLE), GONE, Output.NONE),
        case("unplugged and replugged after 0.5 s", happens(What.UNPLUGGED, MIDDLE, 0.5), "gone", in_ci=True),
        case("unplugged, another one plugged in", Faults((Fault(What.UNPLUGGED, at_sample=MIDDLE, seconds=0.3), other)),
             "another device answers", Output.NONE),
    )


def _ending(words: Words) -> tuple[Case, ...]:
    level = {"to": words.level, "at_sample": PLAYED}
    return (
        Case("the level is read back 1.5 s late", script(Fault(What.LATE, **level, seconds=1.5)), End.WHOLE,
             in_ci=True),
        Case("the level read back is another", script(Fault(What.REPLACED, **level, times=ALWAYS, new=b"0.77")),
             End.FAILED, GONE),
        Case("the level read back is no number", script(Fault(What.REPLACED, **level, times=ALWAYS, new=b"ON")),
             End.FAILED, GONE),
        Case("the stop never arrives", script(Fault(What.LOST, to=words.stop, heard=True, at_sample=PLAYED,
                                                    times=ALWAYS)), End.WHOLE),
    )


U2300A = scpi_cases(Words(
    b"U2351A", "not an instrument this driver knows", Output.SAFE, End.FAILED, ("a wrong answer", "a wrong answer"),
    "ACQ:SRAT?", "SOUR:DIG:DATA:BIT 1", "WAV:STAT?", "WAV:DATA?", "SOUR:VOLT?", "STOP"))
REDPITAYA = scpi_cases(Words(
    b"REDPITAYA", "not a Red Pitaya", Output.NONE, End.WHOLE, ("", ""),
    "ACQ:DEC:Factor?", "SOUR1:TRig:INT", "ACQ:WPOS?", "ACQ:SOUR1:DATA:STA:N?", "SOUR1:VOLT:OFFS?", "ACQ:STOP"))
