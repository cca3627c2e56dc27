"""How late is what comes over a cable: which dead time and which time constant fit the taps?

The step response is taken as s(t) = 1 - exp(-(t - d) / tau) behind a dead time d, s(t) = 0 before. With tau far below a
sample period only the period that d lies in shows, and the interval is all of it; a tail over several samples tells d
to a part of one. An interval is all values at which chi-squared, with the other value at its best, is near its least.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from scipy.stats import f as f_distribution

from identify.calibration.taps import Taps
from identify.interval import Interval
from identify.trace import Array

EACH_PERIOD = 25
"""Dead times tried in a sample period at first."""
REACH = 2
"""Periods to either side of the largest tap in which a dead time is looked for."""
CONSTANTS = 40
"""Time constants tried at first."""
FASTEST = 1e-3
"""Of a sample period: a time constant below it leaves nothing to see."""
ZOOMS, EACH_ZOOM = 4, 21
HALVINGS = 18
SURE = 0.95

Law = Callable[[Array], Array]


@dataclass(frozen=True)
class Lateness:
    """Dead time and time constant, s, with 95 % intervals; ``misfit`` is chi-squared over its freedom, about 1."""

    delay: Interval
    time_constant: Interval
    misfit: float


def lateness(rates: Sequence[Taps]) -> Lateness:
    """Return how late the answer is that taps at one rate or at several tell."""
    seen = _Seen(tuple(rates))
    laws = (seen.over_delay, seen.delays), (seen.over_constant, seen.constants)
    walks = [_Walk(law, tried, law(tried)) for law, tried in laws]
    least = min(walk.best[1] for walk in walks)
    misfit = least / seen.freedom
    level = least + seen.threshold * max(1.0, misfit, *(taps.scatter for taps in rates))
    delay, constant = (walk.interval(level) for walk in walks)
    return Lateness(delay, constant, misfit)


@dataclass(frozen=True)
class _Seen:
    """The taps, and how well a dead time and a time constant fit them."""

    rates: tuple[Taps, ...]

    @property
    def freedom(self) -> int:
        """Return how many numbers are left over: dead time, time constant and a gain at every rate are fitted."""
        return max(sum(taps.h.size - 1 for taps in self.rates) - 2, 1)

    @property
    def threshold(self) -> float:
        """Return the rise of chi-squared that 95 % of chance stays below."""
        freedom = sum(taps.freedom for taps in self.rates)
        return float(f_distribution.ppf(SURE, 1, freedom)) if freedom else 3.84

    @cached_property
    def delays(self) -> Array:
        """Return the dead times to be tried: finely around the largest tap of the slowest rate."""
        taps = min(self.rates, key=lambda taps: taps.rate_hz)
        largest = taps.first + int(np.argmax(np.abs(taps.h)))
        low, high = largest - 1 - REACH, largest - 1 + REACH
        return np.linspace(low, high, EACH_PERIOD * (high - low) + 1) / taps.rate_hz

    @cached_property
    def constants(self) -> Array:
        """Return the time constants to be tried, 0 among them."""
        fastest, slowest = (pick(taps.rate_hz for taps in self.rates) for pick in (max, min))
        longest = max(taps.h.size for taps in self.rates) / slowest
        return np.concatenate(([0.0], np.geomspace(FASTEST / fastest, longest, CONSTANTS)))

    def cost(self, delay_s: Array, constant_s: Array) -> Array:
        """Return chi-squared at dead times and time constants (M,), the gain at every rate at its best."""
        return np.asarray(np.sum([_cost(taps, delay_s, constant_s) for taps in self.rates], axis=0))

    def over_delay(self, delays_s: Array) -> Array:
        """Return chi-squared at every dead time, the time constant at its best."""
        return np.array([_least(partial(self._of_constants, d), self.constants) for d in delays_s.tolist()])

    def over_constant(self, constants_s: Array) -> Array:
        """Return chi-squared at every time constant, the dead time at its best."""
        return np.array([_least(partial(self._of_delays, tau), self.delays) for tau in constants_s.tolist()])

    def _of_constants(self, delay_s: float, constants_s: Array) -> Array:
        return self.cost(np.full(constants_s.size, delay_s), constants_s)

    def _of_delays(self, constant_s: float, delays_s: Array) -> Array:
        return self.cost(delays_s, np.full(delays_s.size, constant_s))


def _cost(taps: Taps, delay_s: Array, constant_s: Array) -> Array:
    """Return chi-squared (M,) of one rate, from what is left of the taps: their squares would drown it in rounding."""
    instants = np.arange(taps.first - 1, taps.first + taps.h.size) / taps.rate_hz
    ages = np.maximum(instants - delay_s[:, None], 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        late = np.where(constant_s[:, None] > 0.0, np.exp(-ages / constant_s[:, None]), 0.0)
    model = np.diff(np.where(ages > 0.0, 1.0 - late, 0.0), axis=1)
    weighed = model @ taps.information
    sizes = np.sum(weighed * model, axis=1)
    gains = (weighed @ taps.h) / np.where(sizes > 0.0, sizes, np.inf)
    left = taps.h - gains[:, None] * model
    return np.asarray(np.sum((left @ taps.information) * left, axis=1))


def _least(law: Law, tried: Array) -> float:
    """Return the least value of ``law``: the best of ``tried``, then ever finer between the neighbours of the best."""
    return _best(law, tried, law(tried))[1]


def _best(law: Law, tried: Array, values: Array) -> tuple[float, float]:
    """Return where ``law`` is least, and what it is there; ``values`` are those at ``tried``."""
    for _ in range(ZOOMS):
        at = int(np.argmin(values))
        best = float(tried[at]), float(values[at])
        low, high = tried[max(at - 1, 0)], tried[min(at + 1, tried.size - 1)]
        tried = np.sort(np.append(np.linspace(low, high, EACH_ZOOM), best[0]))
        values = law(tried)
    at = int(np.argmin(values))
    return float(tried[at]), float(values[at])


@dataclass(frozen=True)
class _Walk:
    """A law of chi-squared, and what it is at the values tried at first."""

    law: Law
    tried: Array
    values: Array

    @cached_property
    def best(self) -> tuple[float, float]:
        """Return where it is least, and what it is there."""
        return _best(self.law, self.tried, self.values)

    def interval(self, level: float) -> Interval:
        """Return all between the outermost values at which it stays below ``level``, their middle as the value."""
        inside = self.tried[self.values <= level]
        least, most = (float(pick(self.best[0], *inside) if inside.size else self.best[0]) for pick in (min, max))
        below, above = self.tried[self.tried < least], self.tried[self.tried > most]
        low = _edge(self.law, float(below[-1]), least, level) if below.size else least
        high = _edge(self.law, float(above[0]), most, level) if above.size else most
        return Interval(0.5 * (low + high), low, high)


def _edge(law: Law, outside: float, inside: float, level: float) -> float:
    """Return where ``law`` crosses ``level``, on the outer side of the crossing."""
    for _ in range(HALVINGS):
        middle = 0.5 * (outside + inside)
        outside, inside = (outside, middle) if law(np.array([middle]))[0] <= level else (middle, inside)
    return outside
