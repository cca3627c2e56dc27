"""How does a streaming DAQ behave behind its transport: clock, FIFOs, converters, flags, watchdog?

One model serves every transport. It does no input or output and knows no clock: time is an argument, in seconds of the
device's own time, and never runs backwards. Sample k is read, then put out, at ``start + k / rate``.
"""

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from drivers.converter import Codes
from drivers.emulators.bench import Bench
from rig.device import Capabilities, Identity

CHUNK = 2048
"""Most samples simulated at once."""


class State(Enum):
    """What the device is doing."""

    IDLE = "idle"
    ARMED = "armed"
    RUNNING = "running"
    RAMPING = "ramping"


@dataclass(frozen=True)
class Hardware:
    """What is soldered in: who the device is, what it can do, how much it stores. ``clock_hz`` None: any rate.

    A link carries ``link_bytes_per_s`` each way; 300 kB/s are 3 Mbaud at ten bits a byte.
    """

    identity: Identity
    capabilities: Capabilities
    output_fifo: int
    input_fifo: int
    history: int = 0
    clock_hz: float | None = None
    watchdog_s: float = math.inf
    link_bytes_per_s: float = 300_000.0


class Ring:
    """The last ``size`` samples of a numbered series, each found by its number; numbers may be skipped."""

    def __init__(self, size: int, *row: int) -> None:
        """Start empty; ``row`` is the shape of one sample."""
        self._values = np.zeros((size, *row), dtype=np.int32)
        self._numbers = np.full(size, -1, dtype=np.int64)

    def put(self, start: int, values: NDArray[np.integer]) -> None:
        """Store ``values`` (at most the size) under the numbers ``start``, ``start + 1``, ..."""
        done = 0
        for at in self._stretches(start, start + len(values)):
            count = at.stop - at.start
            self._values[at] = values[done:done + count]
            self._numbers[at] = np.arange(start + done, start + done + count)
            done += count

    def get(self, start: int, stop: int) -> list[tuple[int, Codes]]:
        """Return what is still stored of [start, stop) as runs of consecutive numbers: [(first number, values)]."""
        numbers = np.arange(max(start, stop - self._numbers.size), stop)
        if not numbers.size:
            return []
        stretches = self._stretches(int(numbers[0]), stop)
        here = np.concatenate([self._numbers[at] for at in stretches]) == numbers
        if here.all():
            return [(int(numbers[0]), np.concatenate([self._values[at] for at in stretches]))]
        kept = numbers[here]
        runs = np.split(kept, np.flatnonzero(np.diff(kept) > 1) + 1) if kept.size else []
        return [(int(run[0]), self._values[run % self._numbers.size]) for run in runs]

    def _stretches(self, start: int, stop: int) -> list[slice]:
        """Return where the samples [start, stop), at most the size, stand."""
        size = self._numbers.size
        first, last = start % size, start % size + stop - start
        return [slice(first, last)] if last <= size else [slice(first, size), slice(0, last - size)]


class DeviceModel:
    """A DAQ with a DAC, an ADC, a FIFO in each direction, one sample clock and a watchdog, in front of a bench."""

    def __init__(self, hardware: Hardware, bench: Bench) -> None:
        """Power up: nothing is output, nothing runs."""
        self.hardware = hardware
        self.bench = bench
        self.state = State.IDLE
        self.rate_hz = hardware.capabilities.min_rate_hz
        self._level_v: float | None = None
        self._safe = (0.0, 0.0)
        self._ramp = (0.0, 0.0, 0.0, 0.0)
        self._heard_s = 0.0
        self.accepted = self.played = self.sent = self.overrun_samples = 0
        self._clear(0, 1)

    def achievable_rate(self, rate_hz: float) -> float:
        """Return the nearest rate the clock divider makes, in Hz."""
        clock = self.hardware.clock_hz
        return rate_hz if clock is None else clock / max(1, round(clock / rate_hz))

    def arm(self, total: int, rate_hz: float, safe: tuple[float, float], seed: int, inputs: int = 1) -> None:
        """Prepare a run of ``total`` samples: FIFOs empty, rig at rest; ``safe`` is (level in V, ramp in s).

        Raises ValueError when there are not so many ``inputs``.
        """
        if not 1 <= inputs <= self.hardware.capabilities.inputs:
            raise ValueError(f"{inputs} inputs of {self.hardware.capabilities.inputs}")
        self._clear(total, inputs)
        self.rate_hz, self._safe = self.achievable_rate(rate_hz), safe
        self.bench.reset(self.rate_hz, seed, inputs)
        self.state = State.ARMED

    def push(self, start: int, codes: NDArray[np.integer]) -> bool:
        """Append output codes numbered from ``start``; return False when they do not follow, or do not fit.

        What was accepted before is skipped, so a repeated block does no harm.
        """
        known = self.accepted - start
        if known >= codes.size:
            return True
        room = self.played + self.hardware.output_fifo - self.accepted
        if known < 0 or codes.size - known > room or self.state not in (State.ARMED, State.RUNNING):
            return False
        self._output.put(self.accepted, codes[known:])
        self.accepted += codes.size - known
        return True

    def go(self, now_s: float) -> None:
        """Start the sample clock."""
        self._start_s, self._heard_s, self.state = now_s, now_s, State.RUNNING

    def halt(self, now_s: float) -> None:
        """Stop the sample clock; the output holds its level."""
        self.advance(now_s)
        if self.state in (State.RUNNING, State.ARMED):
            self.state = State.IDLE

    def safe(self, level_v: float, ramp_s: float, now_s: float) -> None:
        """Stop the clock and ramp from the present level to ``level_v``; a device never used goes there at once."""
        self.advance(now_s)
        self._safe = (level_v, ramp_s)
        self._ramp_to(level_v, ramp_s, now_s)

    def heard(self, now_s: float) -> None:
        """Note that the host is alive."""
        self._heard_s = now_s

    def level_v(self, now_s: float) -> float | None:
        """Return the level at the output in V, a step of the DAC; None before anything was output."""
        if self._level_v is None:
            return None
        level = self._level_v if self.state is not State.RAMPING else self._on_ramp(now_s)
        return float(self.bench.dac.volts(self.bench.dac.codes(np.array([level])))[0])

    def _on_ramp(self, now_s: float) -> float:
        """Return where the ramp stands, in V."""
        first, last, start_s, ramp_s = self._ramp
        share = 1.0 if ramp_s <= 0 else min(1.0, (now_s - start_s) / ramp_s)
        return first + (last - first) * share

    def advance(self, now_s: float) -> None:
        """Do all that is due until ``now_s``: samples, the end of a ramp, the watchdog."""
        if self.state is State.RUNNING:
            self._play_due(now_s)
        self._watch(now_s)
        if self.state is State.RAMPING and now_s >= self._ramp[2] + self._ramp[3]:
            self.state = State.IDLE

    def take(self, most: int) -> tuple[int, Codes] | None:
        """Return up to ``most`` samples not handed over yet as (first number, codes (n, inputs)), None without any.

        Lost ones are skipped.
        """
        runs = self._input.get(self.sent, min(self.played, self.sent + most)) or self._input.get(self.sent, self.played)
        if not runs:
            self.sent = self.played
            return None
        start, codes = runs[0][0], runs[0][1][:most]
        self.sent = start + len(codes)
        return start, codes

    def again(self, start: int, stop: int) -> list[tuple[int, Codes]]:
        """Return what is still stored of the samples [start, stop) handed over before."""
        return self._input.get(start, min(stop, self.sent))

    @property
    def done(self) -> bool:
        """Return whether every sample of the run was played."""
        return self.played >= self._total

    def _clear(self, total: int, inputs: int) -> None:
        """Empty the FIFOs and forget the last run."""
        self._total, self._start_s = total, 0.0
        self._output = Ring(self.hardware.output_fifo)
        self._input = Ring(self.hardware.input_fifo + self.hardware.history, inputs)
        self.accepted = self.played = self.sent = self.overrun_samples = 0
        self.underrun = self.watchdog_tripped = self.clipped = False

    def _play_due(self, now_s: float) -> None:
        """Play the samples due; an empty output FIFO ends the run, since a rig with memory cannot wait."""
        due = min(self._total, math.floor((now_s - self._start_s) * self.rate_hz + 1e-6) + 1)
        while self.played < due and not self.underrun:
            count = min(due - self.played, self.accepted - self.played, CHUNK)
            if count > 0:
                self._play(count)
            else:
                self.underrun = True
                self._ramp_to(*self._safe, now_s)

    def _play(self, count: int) -> None:
        """Play the next ``count`` samples; those read while the input FIFO is full are lost and counted."""
        ((_, codes),) = self._output.get(self.played, self.played + count)
        y = self.bench.play(codes)
        room = max(0, self.sent + self.hardware.input_fifo - self.played)
        self._input.put(self.played, y[:room])
        self.overrun_samples += max(0, count - room)
        self.clipped = self.clipped or self.bench.adc.clipped(y)
        self.played += count
        self._level_v = float(self.bench.dac.volts(codes[-1:])[0])

    def _ramp_to(self, level_v: float, ramp_s: float, now_s: float) -> None:
        """Start a ramp from the present level."""
        at = self.level_v(now_s)
        self._ramp = (level_v if at is None else at, level_v, now_s, ramp_s)
        self._level_v, self.state = level_v, State.RAMPING

    def _watch(self, now_s: float) -> None:
        """Return the output to the safe level when the host has been silent for too long."""
        at_rest = self.state in (State.IDLE, State.RAMPING) and self._level_v in (None, self._safe[0])
        if not at_rest and now_s - self._heard_s > self.hardware.watchdog_s:
            self.watchdog_tripped = True
            self._ramp_to(*self._safe, now_s)
