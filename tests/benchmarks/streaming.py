"""How fast, how cheaply and in how much memory does a stream get from a serial port into a recording?

    python -m tests.benchmarks.streaming speed --seconds 5
    python -m tests.benchmarks.streaming endurance --minutes 10

The device is the emulated serial DAQ in a process of its own, on a real pty, in front of a simulated rig, with 16 bits
each way, four inputs and a fast link. The host is the product as `rig run` uses it: driver with CRC and ledger, runner,
HDF5. Bytes of samples are those of codes on the wire, without frames and CRCs.

`speed` is of a device that sends a run as fast as the host takes it (``played_ahead``), with raw reads of the same
frames by pyserial beside it; on a busy machine bytes per second of processor time still hold. `endurance` plays
4 x 50 kS/s in real time and tells processor time and memory.
"""

import argparse
import json
import os
import pty
import subprocess
import sys
import tempfile
import threading
import time
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np
import serial

from drivers.converter import dac
from drivers.emulators.device_model import Hardware
from drivers.emulators.serial_pty import HARDWARE
from identify.trace import Array, Step, blocks
from rig.plan import Limits, Plan
from rig.recorded import Entry, Recording
from rig.recording import Writer
from rig.registry import connect
from rig.rigfile import parse_rig
from rig.runner import run
from rig.session import equipment
from tests.benchmarks.played_ahead import PlayedAhead, said
from tests.rigs import QUIET
from tests.wire.emulated import CONTEXT, Emulated, emulated

MODULE = "tests.benchmarks.streaming"
INPUTS = ("y", "u_measured", "v", "w")
BYTES_PER_SAMPLE = 2 * len(INPUTS)
LINK_BYTES_PER_S = 200e6
FIFO = 1 << 20
SETTLED_S = 10
"""Memory is compared from here on to the end."""


def hardware() -> dict[str, Any]:
    """Return what is soldered into the device of this benchmark."""
    can = replace(HARDWARE.capabilities, input_bits=16, max_rate_hz=1e7, max_total_rate_hz=4e7, buffer_samples=FIFO)
    return {"capabilities": can, "link_bytes_per_s": LINK_BYTES_PER_S, "output_fifo": FIFO, "input_fifo": FIFO,
            "history": FIFO, "clock_hz": 1.2e9}


@contextmanager
def device() -> Iterator[Emulated]:
    """Run the device in a process of its own."""
    with emulated(QUIET, **hardware()) as made:
        yield made


@dataclass(frozen=True)
class Streamed:
    """What one run took on the host, from its first block on; memory in bytes, ``resident`` by second of the run."""

    whole: bool
    reason: str
    samples: int
    wall_s: float
    cpu_s: float
    finishing_s: float
    resident: tuple[int, ...]
    peak_bytes: int


def plan(rate_hz: float, seconds: float) -> Plan:
    """Return a triangle of 8 V that crosses the gap of the rig twenty times a second at 50 kHz."""
    u = 8.0 * np.interp(np.arange(round(rate_hz * seconds)) % 2500, [0, 625, 1875, 2500], [0, 1, -1, 0])
    return Plan("a stream", u, rate_hz, (Step("triangle", "triangle", 0, u.size),), Limits(-10.0, 10.0), inputs=INPUTS)


def stream(address: str, rate_hz: float, seconds: float, folder: Path) -> Streamed:
    """Play and record in this process, as `rig run` does."""
    path, watch = folder / "stream.h5", _Watch()
    with connect(address) as daq:
        made = plan(daq.achievable_rate(rate_hz), seconds)
        with Writer(path, made, equipment(address, daq, made.rate_hz), daq.quantise(made.u)) as writer, watch:
            clocked = _Clocked(writer)
            outcome = run(made, daq, clocked)
            ended_s = time.perf_counter()
            found = writer.finish(outcome.complete, outcome.reason, outcome.events)
    kept = found.count(Entry.RECORDED)
    whole = outcome.complete and kept == made.u.size and _is_right(found)
    path.unlink()
    finishing_s, (wall_s, cpu_s) = time.perf_counter() - ended_s, clocked.took()
    return Streamed(whole, outcome.reason, kept, wall_s, cpu_s, finishing_s, tuple(watch.resident), _status("VmHWM"))


class _Clocked:
    """A recording that notes when its blocks come: what goes before the first is no stream."""

    def __init__(self, writer: Writer) -> None:
        self._writer = writer
        self._first: tuple[float, float] | None = None
        self._last = (0.0, 0.0)

    def append(self, start: int, y: Array, further: Array) -> None:
        now = time.perf_counter(), time.process_time()
        self._first = self._first or now
        self._writer.append(start, y, further)
        self._last = time.perf_counter(), time.process_time()

    def took(self) -> tuple[float, float]:
        """Return the seconds, and those of the processor, from the first block to the end of the last."""
        first = self._first or self._last
        return self._last[0] - first[0], self._last[1] - first[1]


def _is_right(found: Recording) -> bool:
    """Return whether the input at the output reads, everywhere, what was put out one sample before."""
    assert found.u_measured is not None
    return all(np.abs(found.u_measured[a + 1:b] - found.u[a:b - 1]).max() < 1e-3 for a, b in blocks(0, found.u.size))


class _Watch:
    """Notes the memory of this process every second."""

    def __init__(self) -> None:
        self.resident: list[int] = []
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._look)

    def _look(self) -> None:
        while not self._over.wait(1.0):
            self.resident.append(_status("VmRSS"))

    def __enter__(self) -> None:
        self._thread.start()

    def __exit__(self, *error: object) -> None:
        self._over.set()
        self._thread.join()


def _status(name: str) -> int:
    """Return an entry of this process's status in bytes."""
    text = Path("/proc/self/status").read_text()
    return 1024 * int(text.split(f"{name}:")[1].split(maxsplit=1)[0])


def apart(rate_hz: float, seconds: float, address: str) -> Streamed:
    """Stream in a process of its own, so that its memory and time are those of the stream alone."""
    with tempfile.TemporaryDirectory(dir=os.environ.get("STREAMING_FOLDER")) as folder:
        command = [sys.executable, "-m", MODULE, "host", address, repr(rate_hz), repr(seconds), folder]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(done.stderr)
    said = json.loads(done.stdout)
    return Streamed(**{**said, "resident": tuple(said["resident"])})


def raw(spoken: Path) -> tuple[float, float]:
    """Return the seconds, and those of the processor, that it takes to read the bytes in a file raw by pyserial.

    Another process writes them to a pty, as fast as it takes them.
    """
    command = [sys.executable, "-m", MODULE, "bytes", str(spoken)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, stdin=subprocess.PIPE) as source:
        assert source.stdout is not None
        with serial.Serial(source.stdout.readline().strip(), timeout=2.0) as port:
            port.write(b"!")
            begun_s, cpu_s, left = time.perf_counter(), time.process_time(), spoken.stat().st_size
            while left:
                data = port.read(min(left, max(1, port.in_waiting)))
                if not data:
                    raise RuntimeError(f"{left} bytes did not come")
                left -= len(data)
            took = time.perf_counter() - begun_s, time.process_time() - cpu_s
        source.communicate("")
    return took


def written(spoken: Path) -> None:
    """Write the bytes in a file to a pty, as fast as it takes them, once the reader says so."""
    master, slave = pty.openpty()
    tty.setraw(slave)
    view = memoryview(spoken.read_bytes())
    print(os.ttyname(slave), flush=True)
    os.read(master, 1)
    while view:
        view = view[os.write(master, view[:65_536]):]
    sys.stdin.read()


def ahead(rate_hz: float, seconds: float) -> tuple[Hardware, bytes]:
    """Return a device that holds a whole run, and what it says while it plays it."""
    soldered = replace(HARDWARE, **hardware())
    made = plan(rate_hz, seconds)
    soldered = replace(soldered, output_fifo=made.u.size, input_fifo=FIFO, history=0)
    codes = dac(soldered.capabilities).codes(made.u)
    assert soldered.clock_hz is not None
    return soldered, said(parse_rig(QUIET, "test"), soldered, codes, round(soldered.clock_hz / rate_hz), len(INPUTS))


@contextmanager
def played_ahead(soldered: Hardware, spoken: bytes) -> Iterator[str]:
    """Give the address of a device, in a process of its own, that says ``spoken`` in every run."""
    here, there = CONTEXT.Pipe()
    process = CONTEXT.Process(target=_live, args=(there, soldered, spoken), daemon=True)
    process.start()
    there.close()
    try:
        yield f"serial:{here.recv()}"
    finally:
        here.close()
        process.join(5)


def _live(pipe: Connection, soldered: Hardware, spoken: bytes) -> None:
    made = PlayedAhead(parse_rig(QUIET, "test"), soldered, spoken)
    pipe.send(made.path)
    made.run(pipe.poll)


def speed(seconds: float, rate_hz: float) -> None:
    """Print how fast the host takes a run that comes as fast as it can; a MB is 1e6 bytes of samples on the wire."""
    soldered, spoken = ahead(rate_hz, seconds)
    with tempfile.TemporaryDirectory() as folder:
        frames = Path(folder) / "frames"
        frames.write_bytes(spoken)
        raw_s, raw_cpu_s = raw(frames)
    with played_ahead(soldered, spoken) as address:
        done = apart(rate_hz, seconds, address)
    megabytes = done.samples * BYTES_PER_SAMPLE / 1e6
    print(f"whole: {done.whole} ({done.reason})")
    print(f"{'':36} {'MB':>8} {'MB/s':>8} {'MB per CPU s':>13}")
    for name, took_s, cpu_s in (("CRC, ledger and HDF5", done.wall_s, done.cpu_s),
                                ("raw pyserial, the same frames", raw_s, raw_cpu_s)):
        print(f"{name:36} {megabytes:8.1f} {megabytes / took_s:8.1f} {megabytes / cpu_s:13.1f}", flush=True)
    print(f"closing the recording: {done.finishing_s:.1f} s")


def endurance(minutes: float) -> None:
    """Print what 4 x 50 kS/s take."""
    with device() as made:
        done = apart(50_000.0, 60.0 * minutes, made.address)
        seen = made.look()
    held = done.resident[:int(done.wall_s)]
    settled = held[min(SETTLED_S, len(held) // 2):]
    print(f"whole: {done.whole} ({done.reason}), {done.samples} samples of {len(INPUTS)} inputs",
          f"in {done.wall_s:.1f} s; overrun in the device: {seen.overrun_samples}")
    print(f"processor: {done.cpu_s:.1f} s, {done.cpu_s / done.wall_s:.1%} of one core")
    if settled:
        print(f"memory: {settled[0] / 1e6:.1f} MB once settled, {settled[-1] / 1e6:.1f} MB at the end,",
              f"{max(settled) / 1e6:.1f} MB at most between; peak of the process {done.peak_bytes / 1e6:.0f} MB")
    print(f"closing the recording: {done.finishing_s:.1f} s")


def main(words: list[str]) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parts = parser.add_subparsers(dest="part", required=True)
    fast = parts.add_parser("speed")
    fast.add_argument("--seconds", type=float, default=8.0)
    fast.add_argument("--rate", type=float, default=2.5e6, metavar="HZ")
    parts.add_parser("endurance").add_argument("--minutes", type=float, default=10.0)
    host = parts.add_parser("host")
    for name, kind in (("address", str), ("rate_hz", float), ("seconds", float), ("folder", Path)):
        host.add_argument(name, type=kind)
    parts.add_parser("bytes").add_argument("spoken", type=Path)
    asked = parser.parse_args(words)
    if asked.part == "speed":
        speed(asked.seconds, asked.rate)
    elif asked.part == "endurance":
        endurance(asked.minutes)
    elif asked.part == "bytes":
        written(asked.spoken)
    else:
        print(json.dumps(asdict(stream(asked.address, asked.rate_hz, asked.seconds, asked.folder))))


if __name__ == "__main__":
    main(sys.argv[1:])
