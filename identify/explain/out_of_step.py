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

MOST = 1 << 10  # samples by which readings are looked for early
FALLS = 0.99  # of what was left: a step that leaves more leads nowhere


def told_early(bench: Bench, plain: Hypothesis) -> tuple[str, ...]:
    """Return that readings come early, and by how much, where with later ones the plain model leaves but noise.

    The samples are doubled as long as less is left, and then sought between the last three.
    """
    tried = {0: plain.chi2}
    step = 1
    while step <= MOST and _left(bench, step, tried) < FALLS * tried[step // 2]:
        step *= 2
    low, high = step // 4, min(step, MOST)
    while high - low > 2:
        third = max((high - low) // 3, 1)
        first, second = low + third, high - third
        low, high = (low, second) if _left(bench, first, tried) < _left(bench, second, tried) else (first, high)
    best = min(range(low, high + 1), key=lambda n: _left(bench, n, tried))
    if not best or _left(bench, best, tried) > UNFINISHED**2 * plain.count:
        return ()
    early_s, samples = best / bench.observations[0].trace.rate_hz, f"{best} sample{'s' if best > 1 else ''}"
    return (
        f"with the readings {samples} ({shown(early_s, 's', 3)}) later nothing would be missing: they come before the "
        "rig can answer, u and y of these recordings are out of step; look at how they were triggered or imported",
    )


def _left(bench: Bench, samples: int, tried: dict[int, float]) -> float:
    """Return what the plain model leaves of readings that come so many samples later, chi-squared."""
    if samples not in tried:
        later = replace(bench, observations=_later(bench.observations, samples), known={}, asked={}, coarser=None)
        tried[samples] = later.fitted(bench.plain, ()).chi2
    return tried[samples]


def _later(observations: Sequence[Observation], samples: int) -> tuple[Observation, ...]:
    """Return observations of which every reading is that of some samples before; the first do not count."""
    found = []
    for o in observations:
        y = np.concatenate((np.full(samples, o.trace.y[:1][0]), o.trace.y[:]))[: o.trace.size]
        use = np.concatenate((np.zeros(samples, dtype=bool), o.use))[: o.trace.size]
        found.append(replace(o, trace=replace(o.trace, y=y), use=use))
    return tuple(found)
