"""How does the board in simavr get a port on one side and the simulated rig on the other?

The board (``board.c``) asks for every sample as its DAC moves, and waits for the answer: its clock stands still
meanwhile, so that the rig costs no time of the firmware's. What goes wrong on the link is that of all serial emulators.
"""

import multiprocessing
import re
import select
import signal
import socket
import struct
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from drivers.emulators.bench import Bench
from drivers.emulators.device_model import Hardware
from drivers.emulators.faults import NO_FAULTS, Faults
from drivers.emulators.pty_port import PtyPort
from drivers.emulators.serial_faults import FaultyWire
from drivers.framing import FrameReader
from drivers.serial_messages import Kind
from rig.device import Capabilities, Identity
from rig.rigfile import parse_rig
from tests.wire.simavr.built import Built, built

UNO = Hardware(
    Identity("rig DAQ on ATmega328P", "1", "1"),
    Capabilities(output_low_v=-10.0, output_high_v=10.0, input_low_v=-12.5, input_high_v=12.5, min_rate_hz=31.0,
                 max_rate_hz=5_000.0, output_bits=12, input_bits=10, buffer_samples=384),
    output_fifo=384, input_fifo=256, clock_hz=2e6, watchdog_s=2.0,
)
"""The same as an emulator's hardware; a test holds it to what the firmware says of itself."""
FREQUENCY_HZ = 16e6
SAMPLE, LEVEL, END, FAULT, RESET = range(5)
TROUBLE = {1: "the output moved before the input was held", 2: "a byte was lost in the UART", 3: "no word for the DAC",
           4: "the controller stopped"}
SIGNALS = {"reset": signal.SIGUSR1, "hang": signal.SIGUSR2}
TURN_S, MOST_BYTES = 0.001, 4096
LONGEST_TURN_S = 0.02  # of waiting for the host: longer, and the computer had no time for it
_ARM = re.compile(rb"ARM (\d+) ")
_ENDS = (b"HALT", b"SAFE")
_RECORD, _ANSWER = struct.Struct("<4i"), struct.Struct("<i")
CONTEXT = multiprocessing.get_context("forkserver")
CONTEXT.set_forkserver_preload(["tests.wire.emulated", "tests.wire.warm"])


@dataclass(frozen=True)
class Seen:
    """What the board really does, not asked over its link; ``struck`` counts every scripted fault.

    ``periods`` are the shortest and longest of the last run, in cycles of the processor, and ``idle`` is the part of
    that run which the processor slept.
    """

    level_v: float | None = None
    played: int = 0
    runs: int = 0
    resets: int = 0
    periods: tuple[int, int] = (0, 0)
    idle: float = 0.0
    troubles: tuple[str, ...] = ()
    struck: tuple[int, ...] = ()
    said: tuple[str, ...] = ()


@dataclass(frozen=True)
class Board:
    """Firmware running in simavr, in a process of its own."""

    path: str
    pipe: Connection

    @property
    def address(self) -> str:
        """Return its device address."""
        return f"serial:{self.path}?baud=500000"

    def look(self) -> Seen:
        """Return what the board does now."""
        return self._told("look")

    def reset(self) -> None:
        """Reset the controller, as opening its port does on some boards; return when that is done."""
        before = self._told("reset").resets
        deadline = time.monotonic() + 5
        while self.look().resets == before:
            assert time.monotonic() < deadline, "the board does not restart"

    def hang(self) -> None:
        """Let the controller execute nothing any more, as firmware with a bug would."""
        self._told("hang")

    def _told(self, what: str) -> Seen:
        self.pipe.send(what)
        assert self.pipe.poll(5), "the board does not answer its test"
        seen: Seen = self.pipe.recv()
        return seen


@contextmanager
def on_simavr(rig: str, *, speed: float = 1.0, faults: Faults = NO_FAULTS, seed: int = 0,
              patience_s: float = 3.0, **settings: Any) -> Iterator[Board]:
    """Run the firmware in front of ``rig``, at most ``speed`` times as fast as a real one; ``settings`` build it.

    In a run the board's clock stands still, ``patience_s`` at most, while the host has left half of its FIFO empty: a
    computer that is busy with other tests is not to fail this one.
    """
    here, there = CONTEXT.Pipe()
    args = there, built(**settings), rig, speed, faults, seed, patience_s
    process = CONTEXT.Process(target=_live, args=args, daemon=True)
    process.start()
    there.close()
    try:
        assert here.poll(20), "the board does not start"
        yield Board(here.recv(), here)
    finally:
        here.close()
        process.join(5)
        if process.is_alive():
            process.kill()


def _live(pipe: Connection, files: Built, rig: str, speed: float, faults: Faults, seed: int,
          patience_s: float) -> None:
    """Be the rig in front of the board, and the wire behind it, until the test hangs up."""
    bench = Bench(parse_rig(rig, "test"), UNO.capabilities)
    bench.reset(1000.0, 0)
    bench.play(np.zeros(4, dtype=np.int32))
    (asked, of_bench), (uart, of_uart) = socket.socketpair(), socket.socketpair()
    of_uart.setblocking(False)
    numbers = of_uart.fileno(), of_bench.fileno()
    command = [str(files.board), str(files.firmware), *map(str, numbers), str(speed)]
    with asked, uart, subprocess.Popen(command, pass_fds=numbers, stdout=subprocess.DEVNULL) as board:
        of_bench.close()
        of_uart.close()
        cable = _Cable(uart, faults, patience_s)
        pipe.send(cable.path)
        with suppress(EOFError, ConnectionError):
            _serve(_Rig(bench, asked, seed), cable, pipe, board)
        cable.close()
        board.kill()


def _serve(rig: "_Rig", cable: "_Cable", pipe: Connection, board: "subprocess.Popen[bytes]") -> None:
    """Answer board, host and test until one of them is gone (EOFError, ConnectionError)."""
    while True:
        waiting = cable.host.is_behind(rig.position)
        ready, _, _ = select.select([cable.uart, pipe, *([] if waiting else [rig.asked])], [], [], TURN_S)
        if rig.asked in ready:
            rig.answer()
        if pipe in ready:
            what = pipe.recv()
            rig.catch_up()
            if what in SIGNALS:
                board.send_signal(SIGNALS[what])
            pipe.send(replace(rig.seen, struck=cable.struck))
        cable.carry(rig.seen.played)


class _Rig:
    """The simulated rig between DAC and ADC of the board, which asks for a reading as its output moves."""

    def __init__(self, bench: Bench, asked: socket.socket, seed: int) -> None:
        self.asked, self.seen = asked, Seen()
        self.position = 0
        self._bench, self._seed = bench, seed

    def catch_up(self) -> None:
        """Do all that the board has told so far."""
        while select.select([self.asked], [], [], 0)[0]:
            self.answer()

    def answer(self) -> None:
        """Do what the board tells: a sample is read, its level moved, a run ended, something is wrong."""
        record = self.asked.recv(_RECORD.size, socket.MSG_WAITALL)
        if len(record) < _RECORD.size:
            raise EOFError("the board is gone")
        kind, a, b, c = _RECORD.unpack(record)
        if kind == SAMPLE:
            self._sample(a, b, c)
        if kind in (SAMPLE, LEVEL):
            self.seen = replace(self.seen, level_v=float(self._bench.dac.volts(np.array([a]))[0]))
        elif kind == END:
            self.seen, self.position = replace(self.seen, periods=(b, c), idle=a / 1000), 0
        elif kind == RESET:
            self.seen = replace(self.seen, resets=self.seen.resets + 1)
        elif kind == FAULT:
            self.seen = replace(self.seen, troubles=(*self.seen.troubles, TROUBLE[a]))

    def _sample(self, code: int, number: int, period: int) -> None:
        """Play one sample; the first of a run finds the rig at rest, as after a long pause."""
        if number == 0:
            self._bench.reset(FREQUENCY_HZ / period, self._seed + self.seen.runs)
            self.seen = replace(self.seen, runs=self.seen.runs + 1)
        self.asked.sendall(_ANSWER.pack(self._bench.play(np.array([code], dtype=np.int32))[0, 0]))
        self.position = number + 1
        self.seen = replace(self.seen, played=self.position)


class _Host:
    """How far the host has got with the output samples of its run, as the wire shows."""

    def __init__(self, patience_s: float) -> None:
        self._patience_s, self._reader = patience_s, FrameReader()
        self._total = self._fed = 0
        self._waited_s, self._asked_s = 0.0, time.monotonic()

    def said(self, data: bytes) -> None:
        """Note what the host sent."""
        for frame in self._reader.feed(data):
            if frame.kind == Kind.COMMAND and (armed := _ARM.match(frame.payload)):
                self._total, self._fed = int(armed[1]), 0
            elif frame.kind == Kind.COMMAND and frame.payload.startswith(_ENDS):
                self._total = 0  # nothing more of that run comes: the board is not kept from answering
            elif frame.kind == Kind.OUTPUT:
                self._fed, self._waited_s = frame.number + len(frame.payload) // 2, 0.0

    def is_behind(self, played: int) -> bool:
        """Return whether to wait for it; while this process stood still, the host may have, too."""
        now_s = time.monotonic()
        self._waited_s += min(now_s - self._asked_s, LONGEST_TURN_S)
        self._asked_s = now_s
        needed = min(self._total, played + UNO.output_fifo // 2)
        return self._fed < needed and self._waited_s < self._patience_s


class _Cable:
    """Host and board, joined by a link on which messages may be lost, late or wrong; what nobody takes is gone."""

    def __init__(self, uart: socket.socket, faults: Faults, patience_s: float) -> None:
        uart.setblocking(False)
        self.host = _Host(patience_s)
        self.uart, self._wire, self._port = uart, FaultyWire(faults), PtyPort()
        self.path, self._to_host = self._port.path, b""

    @property
    def struck(self) -> tuple[int, ...]:
        """Return how often each fault of the script happened."""
        return tuple(self._wire.mischief.struck)

    def carry(self, played: int) -> None:
        """Pass on what has arrived on both sides; faults may wait for so many samples ``played``."""
        now_s = time.monotonic()
        self._wire.happening(played)
        if heard := self._wire.to_device(self._port.read(MOST_BYTES), now_s):
            self.host.said(heard)
            self.uart.sendall(heard)
        with suppress(BlockingIOError):
            self._to_host += self._wire.to_host(self.uart.recv(MOST_BYTES), now_s)
        self._to_host += self._wire.to_host(b"", now_s)
        self._to_host = self._to_host[self._port.write(self._to_host):][-MOST_BYTES:]

    def close(self) -> None:
        """Pull the plug."""
        self._port.close()
