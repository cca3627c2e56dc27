"""How near to the recordings does the plain model come: G1, F and G2 as the rig file has them, with nothing beside?"""

from collections.abc import Sequence
from math import sqrt

from identify.blocks import Play
from identify.chain import Chain, as_promised
from identify.effects import catalogue, chain_of
from identify.explain.bench import Bench
from identify.explain.hypothesis import NOISE_KNOWN, Hypothesis
from identify.holdout import Split
from identify.model import Model
from identify.starts.search import scaled
from identify.starts.unmet import drawn_in
from identify.trace import intersample_of

MUCH = 0.1  # misfit of a plain fit from which it may be a wrong one
BY_CHANCE = 30.0  # of chi-squared: less may be what a border that is met for no reason makes of noise
ANOTHER_SIZE = 3.0  # times as steep or as flat: slopes that far from the rig file's are no tolerance
LITTLE = 0.1  # misfit up to which nothing may be missing: what coarse grids leave out of a fit would pass for physics


def prepared(model: Model, data: Split, leave_out: Sequence[str] = ()) -> tuple[Bench, Hypothesis]:
    """Return the bench of hypotheses and the fitted plain model, on grids fine enough for it."""
    chain = as_promised(chain_of(model, intersample_of([o.trace for o in data.train])), model)
    kinds = tuple(kind for name, kind in catalogue().items() if name not in leave_out)
    noise_known = max(NOISE_KNOWN, sqrt(2.0 / data.noise.freedom))
    bench = Bench(chain, data.train, model.fixed, kinds, noise_known=noise_known)
    coarse = _plain(bench)
    bench = bench.refined(coarse.fit.chain)
    found = bench.fitted(coarse.fit.chain, ())
    return bench, bench.finely(found) if found.misfit < LITTLE else found


def _plain(bench: Bench) -> Hypothesis:
    """Return the plain chain fitted; where that leaves much, from where F alone leads, if that is better.

    While F is off by more than the lags are, these stand in for it, and may come to rest on the other side of each
    other. Slopes of quite another size are scaled to the readings first: in which unit these are is soon mistaken. A
    border that w never meets says nothing of where it is: one that was drawn in may explain a good part.
    """
    found = bench.fitted(bench.plain, ())
    if found.misfit >= MUCH:
        starts = (bench.plain, *_of_another_size(bench))
        found = min(found, *(bench.fitted_from_f(start, ()) for start in starts), key=lambda h: h.chi2)
    within = (bench.fitted_from_f(chain, ()) for chain in drawn_in(found.fit.chain, bench.observations, bench.fixed))
    best = min(within, key=lambda h: h.chi2, default=found)
    return best if best.share(found) > LITTLE and best.fall(found) > BY_CHANCE else found


def _of_another_size(bench: Bench) -> tuple[Chain, ...]:
    """Return the plain chain with slopes scaled to the readings, where that makes them some times as large or small."""
    _, chain = scaled(bench.plain, bench.fixed, bench.observations)
    play = chain.stage_of(Play)
    size = chain.values["F.S_L"] / bench.plain.values["F.S_L"] if play and "F.S_L" in chain.values else 1.0
    return () if 1.0 / ANOTHER_SIZE < size < ANOTHER_SIZE else (chain,)
