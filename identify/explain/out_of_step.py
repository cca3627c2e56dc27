"""Do the readings come before the rig could answer: are u and y of a recording out of step?

A trigger that starts one of two devices late, a column that was shifted, readings taken after the source has acted: the
lags of a model cannot be less than none, and what is left looks like physics. With the readings that much later,
nothing is missing.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identify.explain.bench import Bench
from identify.explain.confirm import UNFINISHED
from identify.explain.hypothesis import Hypothesis
from identify.natural_units import shown
from identify.observe import Observation

MOST, SHORTEST = 1 << 10, 20  # samples by which readings are looked for early, and the run over that, at most
FALLS = 0.99  # of what was left: a step that leaves more leads nowhere
SURE, MOSTLY = 100.0, 0.5  # of chi-squared, and of what is above the noise, that later readings explain at least


def told_early(bench: Bench, plain: Hypothesis) -> tuple[str, ...]:
    """Return that readings come early, and by how much, where with later ones the plain model leaves but noise.

    All are compared on the same readings: those that no step moves out of its run. The samples are doubled as
    long as less is left, and then sought between the last three.
    """
    most = min(MOST, *(o.trace.size // SHORTEST for o in bench.observations))
    tried: dict[int, Hypothesis] = {}

    def left(samples: int) -> float:
        if samples not in tried:
            tried[samples] = _fitted(bench, plain, samples, most)
        return 1.0 + tried[samples].misfit

    step, before = 1, _fitted(bench, plain, 0, most)
    tried[0] = before
    while step <= most and left(step) < FALLS * left(step // 2):
        step *= 2
    low, high = step // 4, min(step, most)
    while high - low > 2:
        third = max((high - low) // 3, 1)
        first, second = low + third, high - third
        low, high = (low, second) if left(first) < left(second) else (first, high)
    best = min(range(low, high + 1), key=left)
    fallen = before.chi2 - tried[best].chi2
    explains = left(best) <= UNFINISHED**2 and fallen > max(SURE, MOSTLY * (before.chi2 - before.count))
    return (_told(best, bench.observations[0].trace.rate_hz),) if explains else ()


def _told(samples: int, rate_hz: float) -> str:
    """Return what is said of readings that come so many samples early."""
    return (
        f"with the readings {samples} sample{'s' if samples > 1 else ''} ({shown(samples / rate_hz, 's', 3)}) later "
        "nothing would be missing: they come before the rig can answer, u and y of these recordings are out of step; "
        "look at how they were triggered or imported"
    )


def _fitted(bench: Bench, plain: Hypothesis, samples: int, most: int) -> Hypothesis:
    """Return the plain model fitted to readings that come so many samples later, the last ``most`` left out."""
    later = bench.on(_later(bench.observations, samples, most))
    return later.fitted(bench.plain if samples else plain.fit.chain, ())


def _later(observations: Sequence[Observation], samples: int, most: int) -> tuple[Observation, ...]:
    """Return observations of which every reading is that of some samples before; the last ``most`` do not count."""
    found = []
    for o in observations:
        y, use = np.full(o.trace.size, o.trace.y[:1][0]), np.zeros(o.trace.size, dtype=bool)
        there = slice(samples, o.trace.size - most + samples)
        y[there], use[there] = o.trace.y[: o.trace.size - most], o.use[: o.trace.size - most]
        found.append(replace(o, trace=replace(o.trace, y=y), use=use))
    return tuple(o for o in found if o.count)
