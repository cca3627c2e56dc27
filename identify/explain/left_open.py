"""What do all runs tell together, those held out too: one set of values, of which those fitted leave some open?

A run that moves little tells little: what is fitted to it foretells a run that moves farther only as well as its values
are known. Where one set of values fits both, held-out runs that differ show how open these were, and nothing missing.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, isfinite, sqrt

from scipy.stats import chi2 as chi2_distribution

from identify.chain import Chain
from identify.explain.bench import Bench
from identify.explain.confirm import CERTAIN, UNFINISHED, adapted
from identify.explain.hypothesis import Hypothesis
from identify.explain.phrases import listed
from identify.fit import Fit, total_chi_squared
from identify.interval import Interval
from identify.natural_units import shown_interval
from identify.observe import Observation, joined, over_noise

UNLIKELY = 1e-3  # chance of values as far off, as what was fitted tells them, from which they are others
WIDER = 3.0  # times as wide as that of all runs is the interval of a value that is open
MOST = 3  # values that are named


@dataclass(frozen=True)
class Open:
    """A value that the runs that were fitted leave open: as they tell it, and as all runs do."""

    name: str
    unit: str
    fitted: Interval
    all_runs: Interval

    @property
    def moved(self) -> float:
        """Return by how many half intervals of all runs it was off."""
        return 2.0 * abs(self.fitted.value - self.all_runs.value) / (self.all_runs.high - self.all_runs.low)


def left_open(
    bench: Bench, found: Hypothesis, test: Sequence[Observation], freedom: float
) -> tuple[Open, ...] | None:
    """Return the values that are left open, the most so first, where one set of them fits all runs to the noise.

    None where no set does: then the runs in ``test`` show what no value can. None are open where it is chance alone
    that they leave more than noise. ``freedom`` is how many independent readings the noise is known from.
    """
    if _by_chance(bench, found):
        return None
    joint = together(bench, found, test)
    return _open(found.fit, joint.fit) if _agree(joint.fit, found.fit, bench.observations, test, freedom) else None


def told_by_all(bench: Bench, found: Hypothesis, test: Sequence[Observation]) -> Chain:
    """Return the chain of a hypothesis with the values of all runs, where those in ``test`` leave more than the others.

    What values that are open leave of a run that was not fitted is nothing that is wrong with its readings.
    """
    return together(bench, found, test).fit.chain if leaves_more(bench, found, test) else found.fit.chain


def leaves_more(bench: Bench, found: Hypothesis, test: Sequence[Observation]) -> bool:
    """Return whether a hypothesis leaves more of runs in ``test`` than of those it was fitted to, by no chance."""
    if not test or _by_chance(bench, found):
        return False
    left = over_noise(adapted(found.fit.chain, test), test) ** 2 - 1.0
    return left > max(found.misfit, 0.0) + sqrt(2.0 / max(sum(o.expected for o in test), 1.0))


def together(bench: Bench, found: Hypothesis, test: Sequence[Observation]) -> Hypothesis:
    """Return a hypothesis fitted to all runs; asked again of the same runs, it is remembered."""
    return bench.remembered(_Together(tuple(test)), found)


@dataclass(frozen=True)
class _Together:
    """What is a hypothesis fitted to all runs, those in ``test`` too?"""

    test: tuple[Observation, ...]

    def __call__(self, bench: Bench, found: Hypothesis) -> Hypothesis:
        """Return it fitted from what those fitted tell or, where that fails, from the rig file."""
        both = bench.on(joined((*bench.observations, *self.test)))
        fitted = both.fitted(adapted(found.fit.chain, self.test), found.effects)
        if fitted.misfit < UNFINISHED**2 - 1.0:
            return fitted
        begun = adapted(both.from_rig_file(found), self.test)
        anew = both.fitted(begun, found.effects), both.fitted_from_f(begun, found.effects)
        return min(fitted, *anew, key=lambda h: h.chi2)


def _by_chance(bench: Bench, found: Hypothesis) -> bool:
    """Return whether what a hypothesis leaves hangs together by chance: no sum over readings tells values then."""
    return bench.carried is not None or found.swell > 1.0


def told_open(values: Sequence[Open]) -> str:
    """Return what is said of values that are left open."""
    told = [f"{value.name} {shown_interval(value.fitted, value.unit)}, where all runs together say "
            f"{shown_interval(value.all_runs, value.unit)}" for value in values]  # fmt: skip
    return (
        "With one set of values all runs, those held out too, agree to the noise. Those that were fitted leave open: "
        f"{'; '.join(told)}. Fit the held-out runs, too, or runs that move as far and as fast."
    )


def named_open(values: Sequence[Open]) -> str:
    """Return the names of values that are left open."""
    return listed([value.name for value in values])


def _agree(
    joint: Fit, alone: Fit, train: Sequence[Observation], test: Sequence[Observation], freedom: float
) -> bool:
    """Return whether values leave noise of all runs, and are no others than the fitted runs may be told by chance."""
    count = sum(o.expected for o in test)
    chance = CERTAIN * sqrt(2.0 / max(count, 1.0) + 2.0 / freedom)
    left = over_noise(joint.chain, test) ** 2 - 1.0
    if not left <= max(UNFINISHED**2 - 1.0, chance):
        return False
    rise = total_chi_squared(joint.chain, train) - total_chi_squared(alone.chain, train)
    return rise <= float(chi2_distribution.isf(UNLIKELY, len(alone.coordinates)))


def _open(alone: Fit, joint: Fit) -> tuple[Open, ...]:
    """Return the values that all runs tell much better and elsewhere."""
    found = []
    for coordinate in (c for c in alone.coordinates if not c.parameter.local):
        name = coordinate.name
        fitted, better = (Interval(f.chain.values[name], *f.ci95(name)) for f in (alone, joint))
        value = Open(name.removeprefix("F."), coordinate.parameter.unit.removesuffix("^1"), fitted, better)
        if better.high > better.low and value.moved > 1.0 and _width(fitted) > WIDER * _width(better):
            found.append(value)
    return tuple(sorted(found, key=lambda value: -value.moved)[:MOST])


def _width(interval: Interval) -> float:
    return interval.high - interval.low if isfinite(interval.low) and isfinite(interval.high) else inf
