"""What goes wrong between a serial DAQ and its host?"""

import math

from drivers.emulators.faults import Fault, Faults, What
from drivers.framing import MARKER, Frame, encode
from drivers.serial_messages import Kind
from tests.wire.matrix.case import Case, End, Output, happens, script

GONE = "not confirmed safe"
ALWAYS = math.inf
PLAYED = 9000
"""Samples: a run is nearly at its end."""
BEYOND = encode(Frame(Kind.INPUT, 4_000_000_000, b"\x0a" * 30)) + encode(Frame(Kind.LOST, 0, b"\xff" * 8))


def impossible(old: bytes, new: bytes) -> Faults:
    """Return the script of a device that describes itself so."""
    return script(Fault(What.REPLACED, to="CAP?", times=ALWAYS, old=old, new=new))


def late(to: str, seconds: float) -> Fault:
    """Return the fault of a reply that comes late at the end of a run."""
    return Fault(What.LATE, to=to, at_sample=PLAYED, seconds=seconds)


CONNECTING = (
    Case("identity comes 0.7 s late", script(Fault(What.LATE, to="ID?", seconds=0.7)), End.WHOLE),
    Case("the first identity is lost", script(Fault(What.LOST, to="ID?")), End.WHOLE),
    Case("nobody answers", script(Fault(What.LOST, times=ALWAYS)), End.REFUSED, "no answer", Output.NONE),
    Case("wrong identity: another protocol", script(Fault(What.REPLACED, to="ID?", times=ALWAYS, old=b"protocol=",
                                                           new=b"protocol=not-")),
         End.REFUSED, "speaks another protocol", Output.NONE),
    Case("control characters in its identity", script(Fault(What.REPLACED, to="ID?", times=ALWAYS, old=b"EMU-1",
                                                           new=b"\x00\x1b[2J")), End.WHOLE),
    Case("a reply that is no text", script(Fault(What.REPLACED, to="CAP?", times=ALWAYS, new=b"\xff\x00\xfe")),
         End.REFUSED, "the device refused", Output.NONE),
    Case("claims converters of 64 bits", impossible(b"input_bits=24", b"input_bits=64"), End.REFUSED, "bits",
         Output.NONE, in_ci=True),
    Case("claims a range upside down", impossible(b"output_high_v=10.0", b"output_high_v=-30.0"), End.REFUSED,
         "output_high_v", Output.NONE),
    Case("claims a FIFO of 1e15 samples", impossible(b"output_fifo=32768", b"output_fifo=1000000000000000"),
         End.REFUSED, "output_fifo", Output.NONE, in_ci=True),
    Case("claims a clock of nan Hz", impossible(b"clock_hz=48000000.0", b"clock_hz=nan"), End.REFUSED, "clock_hz",
         Output.NONE),
    Case("garbage before every message", script(Fault(What.PRECEDED, times=ALWAYS, new=b"\n\x00ERR\xa5\x5a\x01")),
         End.WHOLE),
)

STARTING = (
    Case("reply to ARM comes after its time-out", script(Fault(What.LATE, to="ARM", seconds=2.0)), End.FAILED,
         "no answer"),
    Case("ARM arrives twice", script(Fault(What.TWICE, to="ARM", heard=True)), End.WHOLE),
    Case("reply to GO is lost", script(Fault(What.LOST, to="GO")), End.WHOLE),
    Case("reply to GO is lost every time", script(Fault(What.LOST, to="GO", times=ALWAYS)), End.FAILED, "no answer",
         in_ci=True),
    Case("GO never arrives", script(Fault(What.LOST, to="GO", heard=True, times=ALWAYS)), End.FAILED, "no answer"),
    Case("the device refuses to start", script(Fault(What.REPLACED, to="GO", new=b"ERROR hot")), End.FAILED,
         "refused: 'GO': ERROR hot"),
    Case("no output sample arrives", script(Fault(What.LOST, to="OUTPUT", heard=True, times=ALWAYS)), End.FAILED,
         "does not take its output samples"),
    Case("some output frames are lost", script(Fault(What.LOST, to="OUTPUT", heard=True, skip=3, times=4)), End.WHOLE,
         hardware={"output_fifo": 4096}, speed=1.0),
    Case("output frames arrive twice", script(Fault(What.TWICE, to="OUTPUT", heard=True, times=ALWAYS)), End.WHOLE),
)

RUNNING = (
    Case("bytes dropped and corrupted", Faults(drop=3e-4, corrupt=3e-4, spare=3000, seed=4), End.WHOLE, speed=2.0),
    Case("a bit flipped in 5 blocks (CRC error)", script(Fault(What.FLIPPED, to="INPUT", skip=2, times=5, size=300)),
         End.WHOLE, in_ci=True),
    Case("a bit flipped in 5 headers", script(Fault(What.FLIPPED, to="INPUT", skip=2, times=5, size=8)), End.WHOLE),
    Case("blocks arrive twice", script(Fault(What.TWICE, to="INPUT", times=ALWAYS)), End.WHOLE),
    Case("blocks in pieces of 7 bytes", script(Fault(What.SPLIT, to="INPUT", times=ALWAYS, size=7, seconds=1e-5)),
         End.WHOLE),
    Case("blocks cut short", script(Fault(What.SHORT, to="INPUT", skip=1, times=4, size=100)), End.WHOLE, in_ci=True),
    Case("blocks that end within a sample", script(Fault(What.REPLACED, to="INPUT", skip=1, times=2, new=b"\x0a" * 31)),
         End.WHOLE),
    Case("blocks full of 0x0A and frame marks", script(Fault(What.PRECEDED, to="INPUT", times=ALWAYS,
                                                             new=b"\n\r\n" + MARKER * 3)), End.WHOLE),
    Case("a frame that claims 65,535 bytes", script(Fault(What.PRECEDED, to="INPUT", times=ALWAYS,
                                                          new=MARKER + b"\x04\0\0\0\0\xff\xff\x2f\x4d")), End.WHOLE),
    Case("samples beyond the end of the run", script(Fault(What.PRECEDED, to="INPUT", times=3, new=BEYOND)), End.WHOLE),
    Case("a block is lost every time it is sent", script(Fault(What.LOST, to="INPUT", skip=3),
                                                         Fault(What.LOST, to="RESENT", times=ALWAYS)), End.GAPS,
         "samples were lost", in_ci=True),
    Case("all the device says is 80 ms late", Faults(delay_s=0.08), End.WHOLE),
    Case("status says more than can be", script(Fault(What.REPLACED, to="STATUS", skip=5, times=3,
                                                      new=b"\x01\x00" + b"\xff" * 12)), End.WHOLE,
         hardware={"output_fifo": 4096}, speed=1.0),
    Case("overrun: no room while the link is mute", happens(What.MUTE, 2000, 0.4), End.GAPS, "samples were lost",
         hardware={"input_fifo": 1024}, in_ci=True),
    Case("overrun up to the last sample", happens(What.MUTE, 4000, 1.0), End.GAPS, "samples were lost",
         hardware={"input_fifo": 1024}),
    Case("underrun: the host sleeps", Faults(), End.FAILED, "ran out of output samples", naps=((100, 0.7),),
         hardware={"output_fifo": 1024}, speed=1.0),
    Case("watchdog: the host sleeps", Faults(), End.FAILED, "heard nothing from the host", naps=((100, 1.5),),
         hardware={"watchdog_s": 0.7}, speed=1.0),
    Case("mute for 1 s", happens(What.MUTE, 3000, 1.0), End.WHOLE),
    Case("mute from now on", happens(What.MUTE, 3000), End.FAILED, GONE, keeps=500),
    Case("hung with its output on", happens(What.HUNG, 3000), End.FAILED, GONE, Output.TOLD, keeps=500),
    Case("restarted in the middle", happens(What.RESTARTED, 3000), End.FAILED, "fell silent", keeps=500),
    Case("unplugged for good", happens(What.UNPLUGGED, 3000), End.FAILED, GONE, Output.NONE, keeps=500),
    Case("link torn for good", happens(What.TORN, 3000), End.FAILED, GONE, keeps=500),
    Case("link torn within a block", script(Fault(What.TORN, to="INPUT", skip=4)), End.FAILED, GONE),
    Case("link torn and back after 0.5 s", happens(What.TORN, 3000, 0.5), End.FAILED, "gone", keeps=500, in_ci=True),
    Case("unplugged and replugged after 0.5 s", happens(What.UNPLUGGED, 3000, 0.5), End.FAILED, "gone", keeps=500,
         in_ci=True),
    Case("unplugged, another one plugged in",
         Faults((Fault(What.UNPLUGGED, at_sample=3000, seconds=0.3),
                 Fault(What.REPLACED, to="ID?", skip=1, times=ALWAYS, old=b"EMU-1", new=b"EMU-2"))),
         End.FAILED, "another device answers", Output.NONE),
)

ENDING = (
    Case("reply to HALT comes after its time-out", script(late("HALT", 1.7)), End.FAILED, "no answer: to 'HALT'",
         in_ci=True),
    Case("reply to SAFE is lost every time", script(Fault(What.LOST, to="SAFE", at_sample=PLAYED, times=ALWAYS)),
         End.FAILED, GONE),
    Case("SAFE is refused", script(Fault(What.REPLACED, to="SAFE", at_sample=PLAYED, new=b"ERROR busy")), End.WHOLE),
    Case("the level read back is no number", script(Fault(What.REPLACED, to="LEVEL?", at_sample=PLAYED, times=ALWAYS,
                                                          new=b"OK\nlevel=?\nstate=idle")), End.FAILED, GONE),
    Case("a LEVEL? answered 0.6 s late", script(late("LEVEL?", 0.6)), End.WHOLE),
)

SERIAL = (*CONNECTING, *STARTING, *RUNNING, *ENDING)
