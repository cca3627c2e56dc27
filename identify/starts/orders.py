"""Which rig do the recordings suggest where the rig file gives orders and no values?

Rigs are drawn at random, from time constants of a few samples to those of the longest dwell, and tried on thinned data;
the best are varied, the best of those fitted. What comes out is a start: the fit that follows takes it for a rig file's
values. G1(0) is one where the file does not give it, and so is the size of G2(0): F carries the scale.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.chain import Chain, model_of, plain_chain
from identify.fit import Fit, fit
from identify.identification import StairPoint
from identify.model import Backlash, Model, Rational
from identify.noise import good
from identify.observe import Observation
from identify.sections import product
from identify.staircase import borders, staircase
from identify.starts.search import around, freed, scaled
from identify.starts.thinning import TRIED, thinned
from identify.trace import Array, Intersample, Mask, Trace, intersample_of

DRAWN = 400  # rigs tried in a round
VARIED = (0.5, 0.35, 0.2)  # by what share the best are varied, generation after generation
ELITE = 12  # of a generation, those that are varied
OFFSPRING = 8  # variations of each
FITTED = 6  # of the last generation, those fitted for a few iterations
FEW, MANY = 10, 40  # iterations
FINALISTS = 3
ROUNDS = 3
GOOD = 0.03  # residual over the readings' own rms at which the search ends
ROUGH = 0.01  # noise assumed while searching, over the readings' rms: no residual before a fit tells it


@dataclass(frozen=True)
class _Search:
    """What is known before anything is fitted: the data, and the times between which a rig's own must lie, s."""

    model: Model
    data: tuple[Observation, ...]
    shortest_s: float
    longest_s: float
    steps: tuple[dict[str, float], ...]

    def is_unknown(self, name: str) -> bool:
        """Return whether the rig file leaves a thing open."""
        return name in self.model.unknown


def valued(model: Model, traces: Sequence[Trace]) -> Model:
    """Return the model with a value for everything its file leaves open; one that leaves nothing open as it is.

    Raises ValueError when the recordings cannot be fitted together.
    """
    if not model.unknown:
        return model
    search = _search(model, [trace.until(TRIED) for trace in traces])
    best: Fit | None = None
    for round_number in range(ROUNDS):
        found = _best(search, np.random.default_rng(round_number), intersample_of(traces))
        if found is not None and (best is None or found.cost < best.cost):
            best = found
        if best is not None and best.cost < (GOOD / ROUGH) ** 2 * sum(o.count for o in search.data):
            break
    if best is None:
        raise ValueError("no rig of these orders answers at all like the recordings; give values to start from")
    return replace(model_of(best.chain, model), unknown=())


def _search(model: Model, traces: Sequence[Trace]) -> _Search:
    """Return the data as they are searched, and the bounds of time they give."""
    size_v = max(float(np.std(trace.y[:][good(trace)])) for trace in traces)
    whole = [Observation(t, good(t) & _late_enough(t), ROUGH * max(size_v, 1e-12)) for t in traces]
    data = thinned([o for o in whole if o.count])
    longest_s = max(_longest_s(o.trace) for o in data)
    return _Search(model, data, 1.0 / max(t.rate_hz for t in traces), longest_s, _from_stairs(model, whole))


def _late_enough(trace: Trace) -> Mask:
    """Return which samples are used: all after a start at rest, else those of the last two thirds."""
    return np.arange(trace.size) >= (0 if trace.from_rest else trace.size // 3)


def _longest_s(trace: Trace) -> float:
    """Return how slow a time constant can be for the run to show it: a share of its longest dwell or of its length."""
    u = trace.u[:]
    changed = np.flatnonzero(np.diff(u, prepend=np.nan, append=np.nan) != 0.0)
    dwell = float(np.max(np.diff(changed), initial=1)) / trace.rate_hz
    return dwell if changed.size < 0.05 * u.size else 0.1 * trace.size / trace.rate_hz


def _from_stairs(model: Model, observations: Sequence[Observation]) -> tuple[dict[str, float], ...]:
    """Return the borders that staircases give for either sign of G2, read off the second half of the dwells."""
    found = []
    for sign in (1.0, -1.0) if "G2.gain" in model.unknown else (1.0,):
        points: list[StairPoint] = []
        for o in observations:
            u = o.trace.u[:]
            changes = np.flatnonzero(np.diff(u) != 0.0)
            if 3 < changes.size < 0.05 * u.size:
                settle_s = 0.5 * float(np.median(np.diff(changes))) / o.trace.rate_hz
                points += staircase(o, settle_s, model.g1.dc_gain)
        values = borders(points, model.g1.dc_gain, sign * model.g2.dc_gain)
        if values:
            found.append({**values, "sign": sign})
    return tuple(found)


def _best(search: _Search, rng: np.random.Generator, intersample: Intersample) -> Fit | None:
    """Return the best fit of one round, None when no drawn rig can be simulated."""
    fixed = search.model.fixed
    drawn = [plain_chain(_drawn(search, rng), intersample) for _ in range(DRAWN)]
    elite = _elite(drawn, search)
    for share in VARIED:
        varied = [around(c, fixed, rng, share, borders=not search.steps) for c in elite for _ in range(OFFSPRING)]
        elite = _elite([*elite, *varied], search)
    fits = sorted((_fitted(freed(c, fixed), search, FEW) for c in elite[:FITTED]), key=lambda f: f.cost)
    fits = sorted((_fitted(freed(f.chain, fixed), search, MANY) for f in fits[:FINALISTS]), key=lambda f: f.cost)
    return fits[0] if fits and np.isfinite(fits[0].cost) else None


def _fitted(chain: Chain, search: _Search, iterations: int) -> Fit:
    return fit(chain, search.data, None, search.model.fixed, iterations)


def _elite(chains: Sequence[Chain], search: _Search) -> list[Chain]:
    """Return the chains that leave least, their slopes scaled to the readings."""
    scored = [scaled(chain, search.model.fixed, search.data) for chain in chains]
    return [chain for cost, chain in sorted(scored, key=lambda pair: pair[0])[:ELITE] if np.isfinite(cost)]


def _drawn(search: _Search, rng: np.random.Generator) -> Model:
    """Return the model with what is unknown drawn at random."""
    model, f = search.model, search.model.f
    stairs = search.steps[int(rng.integers(len(search.steps)))] if search.steps else {}
    sign = stairs.get("sign", float(rng.choice((1.0, -1.0)))) if search.is_unknown("G2.gain") else 1.0
    if search.is_unknown("F") and isinstance(f, Backlash):
        f = _play(stairs, search, rng)
    g1 = _block(model.g1, search, rng) if search.is_unknown("G1") else model.g1
    g2 = _block(model.g2, search, rng) if search.is_unknown("G2") else model.g2
    g2 = replace(g2, num=tuple(sign * b for b in g2.num))
    if search.is_unknown("G2.dead_time"):
        g2 = replace(g2, dead_time_s=_log_uniform(rng, search.shortest_s, search.longest_s))
    return replace(model, g1=g1, f=f, g2=g2, unknown=())


def _block(block: Rational, search: _Search, rng: np.random.Generator) -> Rational:
    """Return a block of the same orders and DC gain."""
    slowest_s = _log_uniform(rng, 2.0 * search.shortest_s, search.longest_s)
    order, zeros = len(block.den) - 1, len(block.num) - 1
    times = slowest_s / np.exp(np.concatenate(([0.0], rng.uniform(0.0, np.log(10.0), size=max(order - 1, 0)))))
    den = product(_section(times[i : i + 2], rng) for i in range(0, order, 2))
    num = np.ones(1)
    for _ in range(zeros):
        side = float(rng.choice((1.0, -1.0), p=(0.75, 0.25)))
        num = np.convolve(num, (side * slowest_s / float(np.exp(rng.uniform(0.0, np.log(10.0)))), 1.0))
    return replace(block, num=tuple((block.dc_gain * num).tolist()), den=den)


def _section(times_s: Array, rng: np.random.Generator) -> tuple[float, ...]:
    """Return a section with these time constants, or a ringing one of their size."""
    if times_s.size == 1:
        return (float(times_s[0]),)
    if rng.uniform() < 0.6:
        return (float(np.prod(times_s)), float(np.sum(times_s)))
    return (float(np.prod(times_s)), float(2.0 * rng.uniform(0.15, 1.0) * np.sqrt(np.prod(times_s))))


def _play(stairs: dict[str, float], search: _Search, rng: np.random.Generator) -> Backlash:
    """Return the borders of the staircase, or a gap of some share of the widest swing of u."""
    if stairs:
        return Backlash(*(stairs[f"F.{n}"] for n in ("S_L", "D_L", "S_U", "D_U")))
    swing_v = max(float(np.ptp(o.trace.u[:])) for o in search.data) * abs(search.model.g1.dc_gain)
    half_v = _log_uniform(rng, 0.01, 0.45) * swing_v
    middle_v = half_v * float(rng.uniform(-0.5, 0.5))
    return Backlash(1.0, middle_v + half_v, 1.0, middle_v - half_v)


def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(max(high, low)))))
