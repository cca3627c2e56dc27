"""Which stimuli are worth considering for a rig, within the limits of its input?

Walks of several spans, step sizes and dwells; sines and triangles over frequency and amplitude; a few multisines. What
leaves the gap stuck, drives w onto known rails, leaves the limits or runs with the mains is not offered.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from math import ceil, floor, log10

import numpy as np

from identify.effects import chain_of
from identify.holdout import settling_s
from identify.model import Backlash, LinearF, Model, Rational
from identify.planning.advice import mains_hit
from identify.planning.excitation import response
from identify.planning.gap import Gap, fastest_hz
from identify.planning.sampling import one_two_five
from identify.staircase import ENOUGH
from identify.trace import Array

KEEP_OFF = 0.97  # of the level at which a rail, a limit of the reading or the end of the input is met
CLEAR = 1.15  # of the amplitude at which the gap begins to move
SPANS, RUNGS, DWELLS = (1.0, 0.75, 0.5), (1, 2, 4, 8), (0.15, 0.4, 1.0)
SLOWER = 1.4  # a rig 30 % slower than its file must still settle within a dwell that counts as settled
AMPLITUDES = 4
FREQUENCIES = 10
POINTS = 12  # samples a period, at least
LEAST_BLOCKS, MOST_BLOCKS = 20, 2000  # repetitions in the time there is


@dataclass(frozen=True)
class Room:
    """What a protocol may use: the range of u and its slope, the sample rate, the time, the range of the reading."""

    low_v: float
    high_v: float
    rate_hz: float
    time_s: float
    slew_v_per_s: float = np.inf
    reading_v: float = np.inf

    @property
    def limit_v(self) -> float:
        """Return the largest amplitude about 0 V."""
        return min(-self.low_v, self.high_v)


@dataclass(frozen=True)
class Stairs:
    """Levels held one after the other, V.

    ``readable``: every level settles, and either border is met on two levels or more, so that a line goes through them.
    """

    levels_v: tuple[float, ...]
    dwell_s: float
    readable: bool

    @property
    def time_s(self) -> float:
        """Return the time of one walk."""
        return self.dwell_s * len(self.levels_v)

    def drawn(self, rate_hz: float) -> Array:
        """Return the samples of one walk."""
        return np.repeat(np.asarray(self.levels_v), round(self.dwell_s * rate_hz))


@dataclass(frozen=True)
class Tone:
    """So many periods of a sine, or of a triangle, from its offset up."""

    frequency_hz: float
    amplitude_v: float
    offset_v: float
    periods: int
    triangle: bool = False

    @property
    def time_s(self) -> float:
        """Return the time of one repetition."""
        return self.periods / self.frequency_hz

    def drawn(self, rate_hz: float) -> Array:
        """Return the samples of one repetition."""
        turns = np.arange(round(self.time_s * rate_hz)) * (self.frequency_hz / rate_hz)
        wave = 4.0 * np.abs((turns - 0.25) % 1.0 - 0.5) - 1.0 if self.triangle else np.sin(2.0 * np.pi * turns)
        return np.asarray(self.offset_v + self.amplitude_v * wave)


@dataclass(frozen=True)
class Chord:
    """Equal sines together with Schroeder phases, about 0 V, scaled to a peak."""

    frequencies_hz: tuple[float, ...]
    peak_v: float
    time_s: float

    def drawn(self, rate_hz: float) -> Array:
        """Return the samples of one repetition."""
        n = np.arange(len(self.frequencies_hz))
        phases = -np.pi * n * (n + 1) / n.size
        t = np.arange(round(self.time_s * rate_hz)) / rate_hz
        u = np.cos(2.0 * np.pi * np.outer(self.frequencies_hz, t) + phases[:, None]).sum(axis=0)
        return np.asarray(u * (self.peak_v / np.abs(u).max()))


Candidate = Stairs | Tone | Chord


@dataclass(frozen=True)
class Offer:
    """Everything that may be played on one rig in one room."""

    model: Model
    room: Room
    rails_w: tuple[float, float] = (-np.inf, np.inf)

    def candidates(self) -> tuple[Candidate, ...]:
        """Return all stimuli on offer, those included that take too long."""
        found: list[Candidate] = [*self._stairs(), *self._tones(), *self._chords()]
        return tuple(c for c in found if self.fits(c))

    @cached_property
    def gap(self) -> Gap | None:
        """Return the gap; None for a rig without."""
        return gap_of(self.model)

    @cached_property
    def centre_v(self) -> float:
        """Return the level of u in the middle of the gap; 0 where that is near, or jumps are too steep to go there."""
        if self.gap is None or np.isfinite(self.room.slew_v_per_s):
            return 0.0
        middle, width = 0.5 * (self.gap.d_l + self.gap.d_u), self.gap.d_l - self.gap.d_u
        return rounded(middle / self.model.g1.dc_gain) if abs(middle) > 0.1 * width else 0.0

    @cached_property
    def span_v(self) -> float:
        """Return how far u may go from the centre, settled, V."""
        low, high = self.reach_v
        room = min(self.room.high_v - self.centre_v, self.centre_v - self.room.low_v)
        inside = min(abs(v / self.model.g1.dc_gain - self.centre_v) for v in (low, high))
        return min(room, KEEP_OFF * inside)

    @cached_property
    def reach_v(self) -> tuple[float, float]:
        """Return the levels of v, lowest and highest, that keep w off the rails and y within the reading's range."""
        most = self.room.reading_v / abs(self.model.g2.dc_gain)
        low, high = max(self.rails_w[0], -most), min(self.rails_w[1], most)
        if isinstance(self.model.f, LinearF):
            ends = sorted((w - self.model.f.offset_v) / self.model.f.gain for w in (low, high))
            return ends[0], ends[1]
        assert self.gap is not None
        return self.gap.reach(low, high)

    @property
    def needed_v(self) -> float:
        """Return the settled span of u at which the gap begins to move, V; 0 for a rig without."""
        if self.gap is None:
            return 0.0
        ratio = self.gap.excess(self.centre_v * self.model.g1.dc_gain, 1.0, -1.0)
        return 1.0 / (ratio * abs(self.model.g1.dc_gain))

    @property
    def settled_dwell_s(self) -> float:
        """Return the shortest dwell in which a rig 30 % slower than its file is still read settled."""
        return rounded(SLOWER * settling_s(self.model) + 4.0 * ENOUGH / self.room.rate_hz, up=True)

    @cached_property
    def block_s(self) -> float:
        """Return the time of one repetition of everything periodic: 1, 2 or 5 times a power of ten."""
        corners = [abs(p) for block in (self.model.g1, self.model.g2) for p in np.roots(block.den)]
        slowest = min(corners, default=self.room.rate_hz / 10.0)
        wanted_s = max(8.0 * np.pi / slowest, self.room.time_s / MOST_BLOCKS)
        return one_two_five(min(wanted_s, self.room.time_s / LEAST_BLOCKS))

    def frequencies(self) -> tuple[float, ...]:
        """Return frequencies of which whole periods fit a block, clear of the mains, in nearly equal ratios."""
        low, high = 1.0 / self.block_s, self.room.rate_hz / POINTS
        if self.gap is not None:
            high = min(high, 0.95 * (fastest_hz(self.gap, self.model.g1, self.room.limit_v / CLEAR, high) or 0.0))
        else:
            high = min(high, 4.0 * self._fastest_corner_hz())
        if high < low:
            return ()
        orders = np.unique(np.rint(np.geomspace(1.0, high * self.block_s, 4 * FREQUENCIES)).astype(int))
        clear = [n / self.block_s for n in orders.tolist() if mains_hit(n / self.block_s, 1.0) is None]
        picks = np.unique(np.rint(np.linspace(0, len(clear) - 1, min(FREQUENCIES, len(clear)))).astype(int))
        return tuple(clear[k] for k in picks.tolist())

    def _fastest_corner_hz(self) -> float:
        """Return the fastest corner that the sample rate shows, Hz."""
        poles = np.abs(np.concatenate([np.roots(b.den) for b in (self.model.g1, self.model.g2)])) / (2.0 * np.pi)
        return float(np.max(poles[poles < 0.25 * self.room.rate_hz], initial=1.0 / self.block_s))

    def _stairs(self) -> Iterator[Stairs]:
        settled_s = self.settled_dwell_s
        for span in SPANS:
            top = span * self.span_v
            for rungs in RUNGS if top > CLEAR * self.needed_v else ():
                rung = rounded(top / rungs)
                levels = tuple(rounded(self.centre_v + k * rung, 6) for k in self._round(rungs))
                for share in DWELLS:
                    dwell_s = max(ceil(share * settled_s * self.room.rate_hz - 1e-6), 4) / self.room.rate_hz
                    yield Stairs(levels, dwell_s, share >= 1.0 and self._shows_borders(levels))

    def _round(self, rungs: int) -> tuple[int, ...]:
        """Return one round of a walk in rungs: from its lowest level up and down again; from 0 where jumps are slow."""
        if np.isfinite(self.room.slew_v_per_s):
            return (*range(1, rungs + 1), *range(rungs - 1, -rungs - 1, -1), *range(1 - rungs, 1))
        return (*range(-rungs, rungs + 1), *range(rungs - 1, -rungs, -1))

    def _shows_borders(self, levels_v: tuple[float, ...]) -> bool:
        """Return whether two levels or more end on either border; on a line without memory, whether there are two."""
        if self.gap is None:
            return len(set(levels_v)) > 1
        v = np.asarray(levels_v) * self.model.g1.dc_gain
        w = self.gap.passed(v)
        borders = (self.gap.s_l * (v - self.gap.d_l), self.gap.s_u * (v - self.gap.d_u))
        return all(np.unique(v[w == border]).size > 1 for border in borders)

    def _tones(self) -> Iterator[Tone]:
        for frequency in self.frequencies():
            periods = round(frequency * self.block_s)
            for amplitude in self.amplitudes(frequency):
                yield Tone(frequency, amplitude, self.centre_v, periods)
                if frequency in self.frequencies()[:3]:
                    yield Tone(frequency, amplitude, self.centre_v, periods, triangle=True)

    def amplitudes(self, frequency_hz: float) -> list[float]:
        """Return amplitudes from where the gap moves well to the largest allowed."""
        gain = gain_at(self.model.g1, frequency_hz)
        least = CLEAR * self.needed_v * abs(self.model.g1.dc_gain) / gain
        room = min(self.room.high_v - self.centre_v, self.centre_v - self.room.low_v)
        most = min(room, self.span_v * abs(self.model.g1.dc_gain) / gain)
        if self.gap is None:
            return [rounded(most)]
        return sorted({rounded(a) for a in np.geomspace(least, most, AMPLITUDES)}) if least <= most else []

    def _chords(self) -> Iterator[Chord]:
        frequencies = self.frequencies()
        for chosen in (frequencies[::2], frequencies[1::3], frequencies):
            if len(chosen) > 1:
                for share in (1.0, 0.7):
                    yield Chord(chosen, rounded(share * self.room.limit_v), self.block_s)

    def fits(self, candidate: Candidate) -> bool:
        """Return whether u stays within its range and slope, the first sample reached from 0 V."""
        u = candidate.drawn(self.room.rate_hz)
        steep = float(np.max(np.abs(np.diff(u, prepend=0.0, append=0.0)))) * self.room.rate_hz
        return bool(u.min() >= self.room.low_v and u.max() <= self.room.high_v and steep <= self.room.slew_v_per_s)


def offered(model: Model, room: Room) -> Offer:
    """Return what can be played; ValueError where no input within the limits moves the gap."""
    if not isinstance(model.f, Backlash | LinearF):
        raise ValueError("borders given as points are not designed for: give the rig straight borders close to them")
    values = chain_of(model).values
    offer = Offer(model, room, (values.get("saturation.lower", -np.inf), values.get("saturation.upper", np.inf)))
    if offer.span_v <= 1.2 * offer.needed_v:
        raise ValueError(
            f"the gap hardly moves within {room.low_v:g} to {room.high_v:g} V and the rails: it takes "
            f"{offer.needed_v:.3g} V about {offer.centre_v:g} V, {offer.span_v:.3g} V are allowed; widen the limit"
        )
    return offer


def gap_of(model: Model) -> Gap | None:
    """Return the gap of a rig; None for one without."""
    f = model.f
    return Gap(f.s_l, f.d_l_v, f.s_u, f.d_u_v) if isinstance(f, Backlash) else None


def gain_at(block: Rational, frequency_hz: float) -> float:
    """Return |G(j 2 pi f)|."""
    return float(np.abs(response(block, np.array([frequency_hz])))[0])


def rounded(value: float, digits: int = 3, up: bool = False) -> float:
    """Return a number to so many digits, towards zero or away from it."""
    if value == 0.0:
        return 0.0
    decimals = digits - 1 - floor(log10(abs(value)))
    turn = ceil if up == (value > 0.0) else floor
    scaled = value * 10.0**decimals
    near = round(scaled)
    whole = near if abs(scaled - near) < 1e-6 * max(abs(near), 1) else turn(scaled)
    return float(f"{whole}e{-decimals}")
