"""Between which values does a number lie when the cost is no parabola: near a bound, near zero, or hardly told?

Profile likelihood: the number is drawn aside step by step, everything else is fitted anew, and the interval ends where
the cost has risen by 3.84 (Venzon and Moolgavkar, Applied Statistics 37 (1988) 87). An end the data do not set is
open: 0 or infinity.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import exp, inf, log, sqrt

from identify.chain import Chain
from identify.fit import Fit, Pull, fit
from identify.interval import Interval
from identify.observe import Observation
from identify.uncertainty.propagation import Z95

TRUSTED = 0.3  # sd of a log, up to which the curvature at the best fit tells the interval
WIDEST = 3.0  # sd of a log, as wide as a prior
FARTHER = 2.0  # factor by which the pull grows until the cost has risen enough
TRIES = 6
STUCK = 0.05  # of a standard deviation: a stronger pull that moves the number and the cost by less moves nothing
CLOSE = 0.02  # relative error in the root of the cost at which an end is found


@dataclass(frozen=True)
class Fitted:
    """A fit, what it was fitted to and under which prior, and by which factor its intervals are wider."""

    best: Fit
    observations: tuple[Observation, ...]
    centre: Mapping[str, float]
    fixed: tuple[str, ...] = ()
    wider: float = 1.0


def profile(fitted: Fitted, law: Callable[[Chain], float], sd: float) -> Interval:
    """Return the 95 % interval of a positive number ``law``; ``sd`` is that of its log by curvature."""
    walk = _Walk(fitted, law, min(sd, WIDEST))
    low, high = walk.end(-1.0), walk.end(1.0)
    return Interval(law(fitted.best.chain), 0.0 if low is None else exp(low), inf if high is None else exp(high))


@dataclass(frozen=True)
class _Point:
    """A fit drawn aside: how far the pull reached, where the log went, and the root of the rise in cost."""

    reach: float
    value: float
    root: float
    chain: Chain


@dataclass(frozen=True)
class _Walk:
    """A number on its way along its profile, in its log."""

    fitted: Fitted
    law: Callable[[Chain], float]
    sd: float

    @property
    def level(self) -> float:
        """Return the root of the rise in cost at the ends of the interval."""
        return Z95 * self.fitted.wider

    def end(self, side: float) -> float | None:
        """Return the end of the interval on one side, None when the data do not set it."""
        chain = self.fitted.best.chain
        inner, reach = _Point(0.0, log(self.law(chain)), 0.0, chain), 2.0 * self.level * side
        for _ in range(TRIES):
            outer = self.drawn(reach, inner)
            if outer.root >= self.level:
                return self.between(inner, outer)
            if outer.root - inner.root < STUCK * self.level and abs(outer.value - inner.value) < STUCK * self.sd:
                return None
            inner, reach = outer, FARTHER * reach
        return None

    def between(self, inner: _Point, outer: _Point) -> float:
        """Return where the cost has risen to the level, between a point below and one above it."""
        for _ in range(TRIES):
            if min(self.level - inner.root, outer.root - self.level) < CLOSE * self.level:
                break
            point = self.drawn(inner.reach + self.share(inner, outer) * (outer.reach - inner.reach), inner)
            inner, outer = (inner, point) if point.root >= self.level else (point, outer)
        return inner.value + self.share(inner, outer) * (outer.value - inner.value)

    def share(self, inner: _Point, outer: _Point) -> float:
        """Return which share of the way from one point to the other the level is; the root rises nearly straight."""
        return (self.level - inner.root) / (outer.root - inner.root)

    def drawn(self, reach: float, near: _Point) -> _Point:
        """Return the best fit under a pull to ``reach`` standard deviations beside the number, started near by."""
        best = self.fitted.best
        target = log(self.law(best.chain)) + reach * self.sd
        pull = Pull(lambda chain: log(self.law(chain)), target, self.sd)
        found = fit(near.chain, self.fitted.observations, self.fitted.centre, self.fitted.fixed, pull=pull)
        rise = max(_misfit(found) - _misfit(best), 0.0)
        return _Point(reach, log(self.law(found.chain)), sqrt(rise), found.chain)


def _misfit(found: Fit) -> float:
    """Return the cost less the prior's share: an interval ends where the data end it."""
    prior = sum((float(t) / c.prior_sd) ** 2 for c, t in zip(found.coordinates, found.theta, strict=True))
    return found.cost - prior
