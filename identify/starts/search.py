"""From where does a fit lead down to the noise, when the first start does not?

The first fit begins at the rig file's values, with the borders that the staircase gives. Only where it ends above the
noise, on a bound, without a minimum or with a pattern in what it leaves are its blocks set free, and where that does
not help either, many rigs are drawn around what is known, tried on thinned data, the best of them fitted for a few
iterations, and the best of those to the end. The draws are the same every time.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from identify.blocks import LinearBlock, Play
from identify.chain import DELAY, Chain, answered, simulate
from identify.fit import Fit, fit
from identify.model import Backlash, Model
from identify.observe import Observation
from identify.planning.advice import FITS
from identify.stage import is_fixed
from identify.starts.pattern import FALSE_ALARMS, pattern
from identify.starts.thinning import COARSE, thinned

SURE = 5.0  # standard deviations by which the residual must exceed the noise before it counts as above it
AT_BOUND = 0.01  # distance to a bound, relative to it, at which a value counts as sitting on it
PRESSED = 4.0  # fall of chi-squared to expect behind the bounds, below which chance presses a value against them
PATIENCE = 100  # iterations of a fit whose start is not trusted
CLEARLY = 0.5  # share of chi-squared below which another minimum is preferred although it does not reach the noise
DRAWS = 150  # rigs tried in a round
ROUNDS = 4
FITTED = 6  # of the rigs tried, those fitted for a few iterations
FEW = 8  # iterations
FINALISTS = 2
VAGUE = 0.1  # sd of a logarithm from which a second minimum may lie near
UNSEEN = 0.7  # share of its prior's width above which a value is not told by the data at all
OPINIONS = 4  # fits from starts near a doubtful one
NEAR = 0.4  # by what share those starts differ
HOPELESS = 100.0  # of chi-squared on a coarse grid: a minimum as much higher there is not the best on a fine one
APART = 9.0  # squared distance of two answers, in the noise of a reading: three sd of what could tell them apart
MEETINGS = 2  # times that poles may meet and part as a pair
TOGETHER = 1.1  # ratio of two poles that counts as a meeting

Draw = Callable[[Chain, np.random.Generator], Chain]


@dataclass(frozen=True)
class Judge:
    """Whether a fit reached the noise of ``observations``, a size known as well as ``freedom`` readings tell it."""

    observations: tuple[Observation, ...]
    freedom: float = float("inf")

    def excess(self, fitted: Fit) -> float:
        """Return by how many standard deviations the residual's variance lies above the noise's."""
        count = sum(o.count for o in self.observations)
        doubt = np.sqrt(2.0 / max(count, 1) + 2.0 / self.freedom)
        return float((fitted.cost / max(count, 1) - 1.0) / doubt)

    def at_noise(self, fitted: Fit) -> bool:
        """Return whether the residual is not larger than chance makes it."""
        return self.excess(fitted) <= SURE

    def settled(self, fitted: Fit) -> bool:
        """Return whether a fit reached a minimum at the noise; a bound counts when the data press against it."""
        pressed = bool(on_bound(fitted)) and fitted.beyond > PRESSED
        return fitted.converged and not pressed and self.at_rest(fitted)

    def at_rest(self, fitted: Fit) -> bool:
        """Return whether a fit leaves noise alone: no more of it than chance makes, and no shape of the rig's own."""
        return self.at_noise(fitted) and pattern(fitted, self.observations) >= FALSE_ALARMS

    def preferred(self, one: Fit, other: Fit) -> Fit:
        """Return the better fit; ``other`` has to reach the noise, or to leave half as much."""
        if other.cost < one.cost and (self.at_noise(other) or other.cost < CLEARLY * one.cost):
            return other
        return one


def on_bound(fitted: Fit) -> tuple[str, ...]:
    """Return the names of the values that sit on a bound."""
    pairs = zip(fitted.coordinates, fitted.theta, strict=True)
    return tuple(c.name for c, theta in pairs if c.at_bound(float(theta), AT_BOUND))


def shortfall(fitted: Fit, observations: tuple[Observation, ...], freedom: float) -> tuple[str, ...]:
    """Return in words that a fit sits on a bound, or leaves a little more than the noise."""
    found = [f"{name} sits on the bound of its search: its interval does not count" for name in on_bound(fitted)]
    left = float(np.sqrt(fitted.cost / max(sum(o.count for o in observations), 1)))
    at_noise = Judge(observations, freedom).at_noise(fitted)
    if at_noise and (chance := pattern(fitted, observations)) < FALSE_ALARMS:
        found.append(
            f"the residual is no larger than the noise, but follows the rig's own signals (by chance: {chance:.1g}): "
            "the fit ended beside the best values, or a block has more poles or zeros than the rig file gives it"
        )
    if not at_noise and left <= FITS:
        found.append(
            f"the model leaves {left:.4g} times the noise, more than chance does: something small is missing, or "
            "the fit ended beside the best values"
        )
    return tuple(found)


def freed(chain: Chain, fixed: Sequence[str]) -> Chain:
    """Return the chain centred on its own values, blocks unbounded; poles that now lie close share a section."""
    for stage in chain.stages:
        values = tuple(chain.values[p.name] for p in stage.parameters())
        other: LinearBlock | Play
        if type(stage) is LinearBlock and not is_fixed(stage.name, fixed) and not is_fixed(f"{stage.name}.den", fixed):
            other = replace(stage, start=stage.rational(values), within=None)
            moved = other.coefficients()
        elif type(stage) is Play:
            other = Play(Backlash(*values))
            moved = other.parameters()
        else:
            continue
        named = zip([p.name for p in moved], other.start_values(), strict=True)
        chain = chain.with_replaced(stage, other, dict(named))
    return chain


def searched(model: Model, judge: Judge, first: Fit, start: Chain) -> Fit:
    """Return the first fit, or where it fails the one that another start leads to."""
    if judge.settled(first):
        return confirmed(model, judge, first, start)
    free = fit(freed(first.chain, model.fixed), judge.observations, None, model.fixed, PATIENCE)
    found = judge.preferred(first, free)
    if judge.at_rest(found):
        return confirmed(model, judge, found, start)
    thin, rng = thinned(judge.observations), np.random.default_rng(0)
    for _ in range(ROUNDS):
        for chain in finalists(model, start, thin, rng):
            found = judge.preferred(found, fit(chain, judge.observations, None, model.fixed, PATIENCE))
            if judge.settled(found):
                return confirmed(model, judge, found, start)
    return found


def confirmed(model: Model, judge: Judge, found: Fit, start: Chain) -> Fit:
    """Return the best of a fit and others that start near it, where its minimum is so flat that there may be two."""
    for _ in range(MEETINGS):
        if met(found.chain):
            again = fit(freed(found.chain, model.fixed), judge.observations, None, model.fixed, PATIENCE)
            found = _better(found, again)
    return _other_opinions(model, judge, found, start) if doubtful(found) else found


def _other_opinions(model: Model, judge: Judge, found: Fit, start: Chain) -> Fit:
    """Return the best of a fit and those that start near it.

    They are tried on a coarse grid; only what ends in another minimum there is fitted on the fine one.
    """
    rng, coarse = np.random.default_rng(1), tuple(_coarser(o) for o in judge.observations)
    known = [fit(freed(found.chain, model.fixed), coarse, None, model.fixed, PATIENCE)]
    for k in range(OPINIONS):
        chain = around(found.chain if k % 2 else _with_borders_of(found.chain, start), model.fixed, rng, NEAR)
        if DELAY in chain.values:
            chain = chain.with_values({DELAY: start.values[DELAY] * float(np.exp(NEAR * rng.standard_normal()))})
        tried = fit(freed(chain, model.fixed), coarse, None, model.fixed, PATIENCE)
        if all(_elsewhere(tried, other, coarse) for other in known):
            known.append(tried)
            again = fit(freed(tried.chain, model.fixed), judge.observations, None, model.fixed, PATIENCE)
            found = _better(found, again)
    return found


def _coarser(observation: Observation) -> Observation:
    """Return the observation on a coarse grid; what that leaves out is the same in all minima that lie near."""
    if observation.substeps <= COARSE:
        return observation
    return replace(observation, substeps=COARSE, left_out=None)


def _elsewhere(one: Fit, known: Fit, observations: Sequence[Observation]) -> bool:
    """Return whether a fit ended in another minimum than a known one of the same data, and not hopelessly above it.

    Minima are told by their answers: the same poles may be written in sections in several ways.
    """
    if not one.cost < known.cost + HOPELESS:
        return False
    apart = 0.0
    for o in observations:
        pairs = zip(*(answered(f.chain, o.trace, o.substeps) for f in (one, known)), strict=True)
        apart += sum(float(np.sum(np.square(a - b))) for a, b in pairs) / o.noise_v**2
    return apart > APART


def _with_borders_of(chain: Chain, start: Chain) -> Chain:
    """Return the start with the borders found: its blocks may lie in another minimum, zeros on the other side of 0."""
    return start.with_values({n: v for n, v in chain.values.items() if n.startswith("F.") and n in start.values})


def _better(one: Fit, other: Fit) -> Fit:
    """Return ``other`` where it is better by more than rounding and priors may be."""
    return other if other.cost < one.cost - 0.5 else one


def doubtful(fitted: Fit) -> bool:
    """Return whether there may be a second minimum near.

    That is so where the data tell a time constant or a delay only roughly, neither well nor not at all, and where a
    searched delay meets enough poles and zeros to trade it for.
    """
    names = [c.name for c in fitted.coordinates]
    if DELAY in names and any(".num." in name or ".section" in name for name in names):
        return True
    for i, c in enumerate(fitted.coordinates):
        if c.parameter.coordinate == "log" and VAGUE < float(np.sqrt(fitted.covariance[i, i])) < UNSEEN * c.prior_sd:
            return True
    return False


def met(chain: Chain) -> bool:
    """Return whether real poles of different sections have come together: they belong into one, to turn complex."""
    for stage in chain.stages:
        if type(stage) is LinearBlock and len(stage.start.den) > 3:
            values = tuple(chain.values[p.name] for p in stage.parameters())
            own = [np.roots((*part, 1.0)) for part in stage.parts(values)]
            real = [(float(-p.real), k) for k, poles in enumerate(own) for p in poles if abs(p.imag) < 1e-9 * abs(p)]
            ordered = sorted(real)
            if any(a[1] != b[1] and b[0] < TOGETHER * a[0] for a, b in pairwise(ordered)):
                return True
    return False


def finalists(model: Model, start: Chain, thin: Sequence[Observation], rng: np.random.Generator) -> list[Chain]:
    """Return the best of many draws after a few iterations on thinned data, each freed for the fit to come."""
    drawn = [start, *(around(start, model.fixed, rng) for _ in range(DRAWS))]
    scored = sorted(((scaled(chain, model.fixed, thin)) for chain in drawn), key=lambda pair: pair[0])
    fits = [fit(freed(c, model.fixed), thin, None, model.fixed, FEW) for _, c in scored[:FITTED]]
    best = sorted(fits, key=lambda f: f.cost)[:FINALISTS]
    return [freed(f.chain, model.fixed) for f in best]


def around(
    chain: Chain, fixed: Sequence[str], rng: np.random.Generator, share: float = 0.5, borders: bool = False
) -> Chain:
    """Return a chain of the same structure, its time constants, dampings and delays drawn around its values.

    ``share`` is by how much; with ``borders`` their crossings are drawn too.
    """
    values = {}
    swap = _swap(chain, fixed) if rng.uniform() < 0.3 else {}
    for parameter in chain.parameters():
        name, value = parameter.name, chain.values[parameter.name] * swap.get(parameter.name, 1.0)
        if is_fixed(name, fixed) or (name.startswith("F.") and not borders):
            continue
        if parameter.coordinate == "log":
            values[name] = value * float(np.exp(share * rng.standard_normal()))
        elif ".num." in name or name in ("F.D_L", "F.D_U"):
            values[name] = value * (1.0 + share * float(rng.standard_normal()))
    return chain.with_values(values)


def _swap(chain: Chain, fixed: Sequence[str]) -> dict[str, float]:
    """Return the factors on the values of G1 and G2 that exchange their speeds: which is the slow one is not known."""
    blocks = [s for s in chain.stages if type(s) is LinearBlock and not is_fixed(s.name, fixed)]
    if len(blocks) != 2:
        return {}
    times = [_time_s(chain, block) for block in blocks]
    ratio = times[1] / times[0]
    factors = {}
    for block, factor in zip(blocks, (ratio, 1.0 / ratio), strict=True):
        for parameter in block.coefficients():
            factors[parameter.name] = factor ** int(parameter.name[-1])
    return factors


def _time_s(chain: Chain, block: LinearBlock) -> float:
    """Return the geometric mean of a block's time constants."""
    den = block.fitted(chain.values).den
    return float(den[0] ** (1.0 / max(len(den) - 1, 1)))


def scaled(chain: Chain, fixed: Sequence[str], observations: Sequence[Observation]) -> tuple[float, Chain]:
    """Return chi-squared and the chain with the slopes of F scaled to make it smallest."""
    yy, yx, xx = 0.0, 0.0, 0.0
    try:
        with np.errstate(over="ignore", invalid="ignore"):
            for o in observations:
                x, y = simulate(chain, o.trace, o.substeps)[o.use] / o.noise_v, o.trace.y[:][o.use] / o.noise_v
                yy, yx, xx = yy + float(y @ y), yx + float(y @ x), xx + float(x @ x)
    except (ValueError, ArithmeticError):
        return float("inf"), chain
    slopes = [n for n in ("F.S_L", "F.S_U", "F.gain") if n in chain.values]
    if any(is_fixed(n, fixed) for n in slopes) or not np.isfinite(yx) or yx <= 0.0 or chain.stage_of(Play) is None:
        return (yy - 2.0 * yx + xx if np.isfinite(xx) else float("inf")), chain
    return yy - yx * yx / xx, chain.with_values({n: chain.values[n] * yx / xx for n in slopes})
