"""How fast do samples come over the links of instruments that are asked, and what do the checks of a link cost?

``python -m tests.benchmarks.scpi_transfer [ROUNDS]``: one million samples of an emulated U2300A over USBTMC and the
buffer of an emulated Red Pitaya over TCP, through ``ScpiLink``; beside each the same block read by pyvisa alone, taking
turns. The devices run in processes of their own, on the same computer. Then what a query and a setting take, and how
long the first answer after a time-out takes: the link is fenced before it.
"""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from statistics import median
from typing import Any

import numpy as np
import pyvisa

from drivers.emulators.faults import Fault, Faults, What
from drivers.emulators.usb_cable import plug_in
from drivers.scpi_link import ScpiLink
from rig.errors import DeviceError
from tests.rigs import GAIN
from tests.wire.emulated import Emulated, emulated

SAMPLES, BUFFER = 1_000_000, 16_384
ENDS = {"u2300a": "\n", "redpitaya": "\r\n"}


@dataclass(frozen=True)
class Row:
    """One thing measured: what it took each round, s, and how many bytes it brought."""

    name: str
    seconds: tuple[float, ...]
    size: int = 0

    def __str__(self) -> str:
        middle = median(self.seconds)
        rate = f"{self.size / middle / 1e6:8.1f} MB/s" if self.size else ""
        return f"{self.name:45}{1e3 * middle:10.2f} ms{rate}"


def named(device: Emulated) -> str:
    """Return the VISA name of a device, plugged in where it is one on USB."""
    name, _, place = device.path.partition("?usb=")
    if place:
        host, _, port = place.rpartition(":")
        plug_in((host, int(port)))
    return name


@contextmanager
def alone(name: str, end: str) -> Iterator[Any]:
    """Give an instrument as pyvisa has it."""
    with closing(pyvisa.ResourceManager("@py").open_resource(name, read_termination=None)) as resource:
        resource.write_termination = end
        resource.timeout = 10_000
        yield resource


def timed(act: Callable[[], object]) -> float:
    """Return how long an action takes, s."""
    begun = time.perf_counter()
    act()
    return time.perf_counter() - begun


def usb_blocks(rounds: int) -> list[Row]:
    """Return the rows of a million samples over USBTMC."""
    ours, theirs = [], []
    with emulated(GAIN, kind="u2300a", speed=4.0) as device:
        name = named(device)
        for _ in range(rounds):
            with closing(ScpiLink(name)) as link:
                link.tell(*acquired())
                await_complete(link.ask)
                ours.append(timed(lambda: link.ask_block("WAV:DATA?", 2 * SAMPLES)))
            with alone(name, "\n") as resource:
                for command in acquired():
                    resource.write(command)
                await_complete(resource.query)
                theirs.append(timed(lambda: resource.query_binary_values("WAV:DATA?", "h", container=np.array)))
    return [Row("USBTMC, 1,000,000 samples, ScpiLink", tuple(ours), 2 * SAMPLES),
            Row("the same, pyvisa alone", tuple(theirs), 2 * SAMPLES)]


def acquired() -> tuple[str, ...]:
    """Return the commands after which a million samples can be fetched."""
    return "STOP", "TRIG:SOUR NONE", "ACQ:SRAT 250000", f"ACQ:POIN {SAMPLES}", "DIG"


def await_complete(ask: Callable[[str], str]) -> None:
    """Wait for the end of an acquisition."""
    while ask("WAV:COMP?").strip() != "YES":
        time.sleep(0.01)


def tcp_blocks(rounds: int) -> list[Row]:
    """Return the rows of a whole buffer over TCP."""
    ours, theirs = [], []
    with emulated(GAIN, kind="redpitaya") as device:
        name = named(device)
        for _ in range(rounds):
            with closing(ScpiLink(name, "\r\n")) as link:
                link.tell("ACQ:DATA:FORMAT BIN")
                ours.append(timed(lambda: link.ask_block("ACQ:SOUR1:DATA?", 4 * BUFFER)))
            with alone(name, "\r\n") as resource:
                theirs.append(timed(lambda: fetched(resource)))
    return [Row("TCP, 16,384 samples, ScpiLink", tuple(ours), 4 * BUFFER),
            Row("the same, pyvisa alone", tuple(theirs), 4 * BUFFER)]


def fetched(resource: Any) -> bytes:
    """Return a whole buffer as its bytes: on a socket pyvisa has to be told how many there are."""
    resource.write("ACQ:SOUR1:DATA?")
    return bytes(resource.read_bytes(len("#565536") + 4 * BUFFER + len("\r\n")))


def questions(kind: str, rounds: int) -> list[Row]:
    """Return the rows of short messages."""
    faults = Faults((Fault(What.LATE, to="SYST:ERR:COUN?", seconds=0.2, times=rounds),))
    rows: dict[str, list[float]] = {"a query": [], "a setting, checked": [], "a query after a time-out": []}
    with emulated(GAIN, kind=kind, faults=faults) as device, closing(ScpiLink(named(device), ENDS[kind])) as link:
        for _ in range(rounds):
            rows["a query"].append(timed(lambda: link.ask("*OPC?")))
            rows["a setting, checked"].append(timed(lambda: link.tell("*ESE 0")))
            try:
                link.ask("SYST:ERR:COUN?", timeout_s=0.1)
            except DeviceError:
                time.sleep(0.2)
                rows["a query after a time-out"].append(timed(lambda: link.ask("*OPC?")))
    return [Row(f"{kind}: {name}", tuple(seconds)) for name, seconds in rows.items()]


def measured(rounds: int) -> list[Row]:
    """Return all rows."""
    return [*usb_blocks(rounds), *tcp_blocks(rounds), *questions("u2300a", rounds), *questions("redpitaya", rounds)]


if __name__ == "__main__":
    for row in measured(int(sys.argv[1]) if len(sys.argv) > 1 else 5):
        print(row)
