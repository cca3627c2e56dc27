"""Which law of a round is ahead on grids that are fine enough for all that came close?"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identify.explain.bench import Bench
from identify.explain.hypothesis import WORTH, Hypothesis
from identify.explain.race import NEAR, SPRINT, raced
from identify.explain.round import COMPARED, Round, ranked
from identify.fit import total_chi_squared

STEPPED = 5  # rivals that are fitted again on a finer grid


def decided(bench: Bench, this: Round) -> tuple[Bench, Round]:
    """Compare what came close again, on grids fine enough for all of it; return the bench on these grids, too.

    Where nothing comes near to explaining enough for a name, nothing has to be compared.
    """
    close = this.close[:STEPPED]
    if not any(rival.gains_enough(this.base, 0.5 * WORTH) for rival in close):
        return bench, this
    finer = bench.fine_enough(*close)
    if finer is bench:
        return bench, this
    more = catching_up(finer, this, close)
    finer, close = finer.fine_enough(*more), (*close, *more)
    tried = [finer.fitted(rival.fit.chain, rival.effects, SPRINT) for rival in close]
    reach = min(h.chi2 for h in tried) + NEAR
    tried = [h if h.fit.converged or h.chi2 > reach else finer.fitted(h.fit.chain, h.effects) for h in tried]
    base = finer.fitted(this.base.fit.chain, this.base.effects)
    late = overtaking(finer, this, min((h.chi2 for h in tried), default=base.chi2), base)
    behind = [h for h in this.tried if not any(h is rival for rival in close)]
    return finer, replace(this, base=base, tried=(*ranked(base, [*tried, *late]), *behind))


def catching_up(bench: Bench, this: Round, close: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Return what the coarser grid put behind a winner that leaves more than its lead, and this one puts near.

    Far above the noise the error of stepping is a misfit of its own, and what has a number more stands in for it.
    """
    others = [h for h in this.undecided if not any(h is rival for rival in close)]
    with np.errstate(over="ignore", invalid="ignore"):
        best = min(total_chi_squared(h.fit.chain, bench.observations) for h in close)
        return [h for h in others if total_chi_squared(h.fit.chain, bench.observations) < best + NEAR]


def overtaking(bench: Bench, this: Round, best: float, base: Hypothesis) -> list[Hypothesis]:
    """Fit what was passed over on the samples' grid and on this one comes near ``best`` before it is fitted."""
    with np.errstate(over="ignore", invalid="ignore"):
        left = [(p, total_chi_squared(p.chain, bench.observations)) for p in this.passed_over]
    near = [p for p, chi2 in left if chi2 - p.slack < best + COMPARED]
    return [h for h in raced(bench, base, near) if bench.possible(h)]
