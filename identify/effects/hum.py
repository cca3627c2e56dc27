"""The mains: lines at 50 or 60 Hz and odd harmonics, or the even ones of a rectifier, phase free of the stimulus."""

from dataclasses import replace
from math import sqrt
from typing import TYPE_CHECKING, ClassVar, final

import numpy as np
from scipy.stats import chi2, f

from identify import kernels
from identify.altered_play import Law
from identify.chain import Chain
from identify.effects.effect import Confusion, short
from identify.effects.inside_play import InsidePlay
from identify.mains import RANGE_HZ, Line, Mains
from identify.stage import Block, Grid, Parameter, Place, Run, Shape, Values
from identify.trace import Array

if TYPE_CHECKING:
    from identify.evidence import Evidence

MAINS_HZ = (50.0, 60.0)
NO_MAINS_HZ = 55.0
BY_CHANCE = 1e-3  # probability at which noise would stand out so
NOISE_OFF = 3.0  # sd of chi-squared of white noise by which it may be off
SEARCHED = 12  # numbers that two frequencies are worth to noise alone, each found within 1 Hz, in runs of up to 60 s
A_LINE = 1.5  # the same of a line's size and angle in a run: sizes are those of all runs, angles hang together
LINES = {
    "": (Line(1, "amplitude", "phase"), Line(3, "third", "third_phase"), Line(5, "fifth", "fifth_phase")),
    "rectified": (Line(2, "second", "phase"), Line(4, "fourth", "fourth_phase")),
}
FREQUENCY = Parameter("hum.frequency", "Hz", scale=0.01)
AMPLITUDES = tuple(Parameter(f"hum.{line.size}", "V", scale=0.1) for lines in LINES.values() for line in lines)
ANGLES = tuple(Parameter(f"hum.{line.angle}", "rad") for lines in LINES.values() for line in lines[1:])
PHASE = Parameter("hum.phase", "rad", local=True)


def near_mains(frequency_hz: float) -> bool:
    """Return whether a frequency is next to that of the mains, or to twice that, as behind a rectifier."""
    return any(abs(frequency_hz - order * mains_hz) < RANGE_HZ for mains_hz in MAINS_HZ for order in (1, 2))


@final
class Hum(InsidePlay):
    """Mains lines added to v (where the gap rectifies them) or to the reading, or to the half of the gap.

    The waveform is the same in every run; where in its period a run starts is the run's own. Transformers and open
    wires bring odd harmonics; the ripple of a rectified supply, the ``rectified`` form, has even ones alone.
    """

    id = "hum"
    title = "mains hum"
    equation = (
        "s' = s + sum over n = 1, 3, 5 (rectified: 2, 4) of a_n sin(n (2 pi f t + phase) + phase_n), "
        "phase free in every run; at F the same is added to D_L and taken from D_U"
    )
    sentence = (
        "The mains is picked up: {}. Odd harmonics come from transformers and open wires: shield them, use one ground; "
        "even ones are the ripple of a rectified supply: filter it."
    )
    axis = "mains lines"
    fingerprint = "a line whose phase is free of the stimulus; at v the gap rectifies it"
    places = (Place.SENSE, Place.G1, Place.F)
    shapeless = True
    forms = ("", "rectified")
    declared = (FREQUENCY, *AMPLITUDES, *ANGLES, PHASE)
    absent: ClassVar = {"frequency": 50.0, **{p.name.partition(".")[2]: 0.0 for p in (*AMPLITUDES, *ANGLES, PHASE)}}
    confused_with = (
        Confusion("feedthrough", "a stimulus that is no multiple of the mains frequency"),
        Confusion("process_noise", "the same run at another time of the mains: noise has no phase", here=Place.F),
    )
    example: ClassVar = {"frequency": 50.02, "amplitude": 0.03, "third": 0.012, "fifth": 0.006}

    @property
    def lines(self) -> tuple[Line, ...]:
        """Return the lines of the form; the angle of the first is the run's own."""
        return LINES[self.form]

    def parameters(self) -> tuple[Parameter, ...]:
        """Return the frequency, and the sizes and angles of the lines of the form."""
        mine = {name for line in self.lines for name in (line.size, line.angle)}
        return self.own(p for p in self.declared if p is FREQUENCY or short(p.name) in mine)

    def freedom(self, runs: int) -> int:
        """Return how many numbers noise alone could use: of lines that are not there, any frequency and angle will do.

        Counted in simulations of noise: 1 to 12 runs of 2 to 60 s.
        """
        return SEARCHED + round(A_LINE * len(self.lines) * runs)

    @property
    def inside(self) -> bool:
        """Return whether the lines are on the borders of the play operator, not on a signal."""
        return self.place == Place.F

    def altered(self, law: Law, values: Values, grid: Grid) -> Law:
        """Return the law whose borders the mains push apart."""
        before, added = law.ripple, self._waveform(values, grid)
        return replace(law, ripple=added if before is None else lambda block: before(block) + added(block))

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the addition at work."""
        if self.inside:
            return super().begin(values, grid, shape)
        added = self._waveform(values, grid)
        return (lambda block: block.signal + added(block)), shape

    def _waveform(self, values: Values, grid: Grid) -> Run:
        """Return what makes the lines at the instants of a block; time runs from the start of the run, as phases do."""
        count = len(self.lines)
        frequency, phase = values[0], values[-1]
        sizes, angles = np.array(values[1 : count + 1]), np.array([0.0, *values[count + 1 : -1]])
        orders = np.array([line.order for line in self.lines])
        turn = 2.0 * np.pi * frequency * grid.step_s

        def run(block: Block) -> Array:
            out = np.zeros(block.signal.size)
            if sizes.any():
                kernels.waveform(turn * block.first + phase, turn, orders, sizes, angles, out)
            return out

        return run

    def upright(self, chain: Chain) -> Chain:
        """Return ``chain`` with no size below zero: a line upside down is one half a turn away.

        The angles of the others are told against the phase of the run, which turns the first line.
        """
        values, first = dict(chain.values), self.lines[0]
        for line in self.lines:
            if values[f"{self.name}.{line.size}"] < 0.0:
                values[f"{self.name}.{line.size}"] *= -1.0
                turns = {line.angle: np.pi}
                if line is first:
                    turns = {one.angle: -np.pi * one.order / first.order for one in self.lines[1:]}
                    turns[first.angle] = np.pi / first.order
                for key in values:
                    values[key] += turns.get(key.partition("[")[0].removeprefix(f"{self.name}."), 0.0)
        return chain.with_values(values) if values != chain.values else chain

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the mains of the residual, where they stand out of what lines at no mains' frequency explain as well.

        What hangs together, as what the gap makes of noise in front of it, has as much there.
        """
        freedom = self.freedom(len(evidence.observations))
        near = [Mains(evidence, self, self.lines, mains_hz) for mains_hz in MAINS_HZ]
        seen = [mains for mains in near if chi2.sf(mains.told, freedom) < BY_CHANCE]
        if not seen:
            return []
        elsewhere = Mains(evidence, self, self.lines, NO_MAINS_HZ).told
        return [mains.values() for mains in seen if _by_chance(evidence, mains.told, elsewhere, freedom) < BY_CHANCE]


def _by_chance(evidence: "Evidence", told: float, elsewhere: float, freedom: int) -> float:
    """Return how likely a residual that hangs together would let lines explain so much of it.

    Those at no mains' frequency say how many numbers it is worth: each would explain as much as another then, and what
    lines explain over what they leave beyond white noise has the distribution of Fisher's F.
    """
    count, level = sum(o.count for o in evidence.observations), max(elsewhere, float(freedom))
    total, white = float(evidence.residual @ evidence.residual), NOISE_OFF * sqrt(2.0 * count)
    rest = freedom * (total / level - 1.0)
    if rest <= 0.0:
        return 1.0
    left, otherwise = (max(total - one - count, 0.0) + white for one in (told, level))
    return float(f.sf(told / level * otherwise / left, freedom, rest))
