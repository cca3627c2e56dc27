"""Which steps answer an operator's question on a rig, sized so that its gap moves and nothing is driven too far?

Simple, readable steps to begin with and to change, as the gallery has them for the op-amp circuit; ``rig design`` finds
the best ones. V = U |G1| is the amplitude at the gap and d half its width: the gap moves where V > d.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import ceil, floor, inf, log10, pi

import numpy as np

from identify.model import Backlash, Model, Rational
from rig.linearblock import settling_time_s
from rig.protocolfile import exact

Steps = list[str]
NEAR, FAR = 1.3, 1.8
"""Of d, the amplitudes V at which the gap moves, and moves well: twice d is where the paper's rig meets its rails."""
SETTLED = 1e-3
SEEN = 0.2
"""Of its gain at 0 Hz, what G2 must let through of a frequency that is worth playing."""
LEAST_PERIODS = 6
MULTIPLES, RUNGS = (1, 3, 5, 7, 9), 3
"""Odd: they share harmonics, which ties the phases of G1 at one to those at another."""
NOISE_S = 10.0


@dataclass(frozen=True)
class Bench:
    """A rig with values, the largest level in V about 0, and a frequency in Hz to begin with."""

    model: Model
    level_v: float
    frequency_hz: float

    @property
    def half_gap_v(self) -> float:
        """Return d, half the width of the gap at v in V; 0 where there is none, or it is bent."""
        f = self.model.f
        return (f.d_l_v - f.d_u_v) / 2.0 if isinstance(f, Backlash) else 0.0

    @cached_property
    def settling_s(self) -> float:
        """Return how long G1 and G2 take to settle to 0.1 % of a step; where they do at once, half of a period."""
        blocks = (self.model.g1, self.model.g2)
        dead_s = sum(block.dead_time_s for block in blocks)
        found_s = settling_time_s([(block.num, block.den) for block in blocks], dead_s, SETTLED)
        return found_s or 0.5 / self.frequency_hz

    def gain(self, frequency_hz: float) -> float:
        """Return |G1| at a frequency."""
        return _gain(self.model.g1, frequency_hz)

    def amplitude_v(self, share: float, frequency_hz: float = 0.0) -> float:
        """Return the amplitude of u in V whose V is ``share`` times d, within the level; of the level without a gap."""
        wanted = share * self.half_gap_v / self.gain(frequency_hz) if self.half_gap_v else share / FAR * self.level_v
        return short(min(wanted, self.level_v))

    def moves(self, frequency_hz: float) -> bool:
        """Return whether the level is enough to move the gap at a frequency, and G2 lets it be seen."""
        seen = _gain(self.model.g2, frequency_hz) >= SEEN * _gain(self.model.g2, 0.0)
        return seen and self.level_v * self.gain(frequency_hz) >= NEAR * self.half_gap_v

    def periods(self, frequency_hz: float) -> int:
        """Return so many periods of a simple part or multiple of the frequency that they fill a round time."""
        round_s = 10.0 ** -floor(log10(self.frequency_hz) + 1e-9)
        return round(frequency_hz * round_s * ceil(LEAST_PERIODS / (frequency_hz * round_s) - 1e-9))


def borders(bench: Bench) -> Steps:
    """Return a walk over both borders, and one of 0.6 of it, clear of what the first may meet."""
    step = short(bench.amplitude_v(2.0 * FAR / 1.5) / 6.0)
    top, down = exact(6 * step, "V"), exact(-6 * step, "V")
    there, back = (f"{{from: {a}, to: {b}, step: {exact(step, 'V')}}}" for a, b in ((down, top), (top, down)))
    dwell = f"{{settle: 0.1 %, hold: {exact(long(0.5 * bench.settling_s), 's')}}}"
    return [
        *_step("walk", "staircase", [f"levels: [{there}, {back}]", f"dwell: {dwell}"]),
        *_step("0.6 of it", "staircase", [f"levels: [{there}, {back}]", "scale: 0.6", f"dwell: {dwell}"]),
    ]


def response(bench: Bench) -> Steps:
    """Return sines at odd multiples of a frequency, in two sizes each, as far as the gap moves, off the mains."""
    from identify.planning.advice import mains_hit

    rungs = [bench.frequency_hz * multiple for multiple in MULTIPLES]
    clear = [rung for rung in rungs if bench.moves(rung) and not mains_hit(rung, bench.periods(rung) / rung)]
    return [
        _tone("sine", bench, rung, size) for rung in (clear or rungs)[:RUNGS]
        for size in dict.fromkeys(bench.amplitude_v(share, rung) for share in (NEAR, FAR))
    ]


def speed(bench: Bench) -> Steps:
    """Return triangles that reach the same level at the gap at speeds that double."""
    rungs = (bench.frequency_hz * share for share in (0.25, 0.5, 1.0, 2.0))
    return [_tone("triangle", bench, rung, bench.amplitude_v(FAR, rung)) for rung in rungs if bench.moves(rung)]


def memory(bench: Bench) -> Steps:
    """Return nested loops of one slow slope, three times, as the first begins from rest."""
    amplitudes = ", ".join(exact(short(share * bench.amplitude_v(FAR)), "V") for share in (1.0, 0.87, 0.74))
    slope = exact(short(4.0 * bench.amplitude_v(FAR) * bench.frequency_hz / 4.0), "V/s")
    return ["  - repeats: 3", f"    minor_loops: {{amplitudes: [{amplitudes}], slope: {slope}}}"]


def held(bench: Bench) -> Steps:
    """Return levels on either border and on a plateau behind it, held for three times."""
    top = bench.amplitude_v(FAR)
    behind = short(max(top - bench.half_gap_v / bench.gain(0.0), 0.2 * top))
    levels = f"levels: [{', '.join(exact(level, 'V') for level in (top, behind, -top, -behind))}]"
    times = [long(share * bench.settling_s) for share in (2.0, 7.0, 20.0)]
    return [line for time in times for line in
            _step(f"held {time:g} s", "staircase", [levels, f"dwell: {exact(time, 's')}"])]  # fmt: skip


def noise(bench: Bench) -> Steps:
    """Return 0 V and a held level, long enough to tell lines 0.1 Hz apart."""
    levels = (("idle", 0.0), ("held", bench.amplitude_v(FAR)))
    return [f"  - {{label: {label}, hold: {{level: {exact(v, 'V')}, time: {NOISE_S:g} s}}}}" for label, v in levels]


@dataclass(frozen=True)
class Kind:
    """What may be asked: the question, the steps that answer it, and what they rest on."""

    question: str
    steps: Callable[[Bench], Steps]
    because: str


KINDS = {
    "borders": Kind("Where are the borders of the backlash?", borders,
                    "A walk up and down meets both borders; the smaller one stays clear of what the larger may meet."),
    "response": Kind("What do G1 and G2 do at these frequencies?", response,
                     "Two sizes at each frequency: one cannot tell |G1| from |G2| where both borders have one slope."),
    "memory": Kind("Is the memory one gap, of one width at any size of loop?", memory,
                   "Loops of one slope, nested: of one gap all have the same width."),
    "speed": Kind("Does the gap depend on the speed at which it is crossed?", speed,
                  "The same level at the gap at speeds that double: of a delay, all are late by one time."),
    "held": Kind("Does a held level stay where it is, however long it is held?", held,
                 "After each level on a border one on the plateau behind it: what runs there grows with the time."),
    "noise": Kind("What is there at the output while nothing is put out?", noise,
                  "At rest and at a held level: noise that is larger there comes from before it."),
}  # fmt: skip


def usual_hz(model: Model) -> float:
    """Return the frequency to begin with: 1, 3 or 7 times a power of ten, below the slowest corner of the rig.

    Odd multiples of these keep off the mains, and ten times a second is a whole number of periods.
    """
    corners = [abs(pole) for block in (model.g1, model.g2) for pole in np.roots(block.den)]
    slowest = min(corners, default=2.0 * pi * 10.0) / (2.0 * pi)
    power = floor(log10(slowest) + 1e-9)
    steps = [float(f"{m}e{p}") for p in (power - 1, power) for m in (1, 3, 7)]
    return max(step for step in steps if step <= slowest * (1.0 + 1e-9))


def _gain(block: Rational, frequency_hz: float) -> float:
    s = 2j * pi * frequency_hz
    return float(abs(np.polyval(block.num, s) / np.polyval(block.den, s)))


def short(value: float) -> float:
    """Return a value of two digits, at most as large."""
    return _two_digits(value, floor, inf)


def long(value: float) -> float:
    """Return a value of two digits, at least as large."""
    return _two_digits(value, ceil, -inf)


def _two_digits(value: float, towards: Callable[[float], int], side: float) -> float:
    if value == 0.0:
        return 0.0
    unit = floor(log10(abs(value)) + 1e-9) - 1
    whole = round(value / 10.0**unit, 6)
    return float(f"{towards(np.nextafter(whole, side) if whole == round(whole) else whole)}e{unit}")


def _tone(kind: str, bench: Bench, frequency_hz: float, amplitude_v: float) -> str:
    size = f"frequency: {exact(float(f'{frequency_hz:.9g}'), 'Hz')}, amplitude: {exact(amplitude_v, 'V')}"
    return f"  - {{repeats: 2, {kind}: {{{size}, periods: {bench.periods(frequency_hz)}}}}}"


def _step(label: str, kind: str, lines: Steps) -> Steps:
    return [f"  - label: {label}", f"    {kind}:", *(f"      {line}" for line in lines)]
