"""At which frequency, lag, level, rate or moment does a law explain most, and how many knots do the data ask for?"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import exp, log

import numpy as np
from scipy.optimize import minimize_scalar

from identify.chain import Chain
from identify.evidence import Evidence
from identify.explain.corrections import sharpened
from identify.explain.suddenly import WINDOW_S
from identify.explain.suspect import Suspect, moved, suspect
from identify.trace import Array
from identify.unnamed.correction import Correction

BESIDE, CLOSER, TUNED = 0.5, 0.4, 1e-3  # of what the longest run resolves: steps in which a frequency is moved
AROUND = (0.2, 0.5, 1.0, 2.0, 5.0)  # times a knot: where it is sought once more
STRETCHED = 0.3  # of a knot, by which it is moved at once
KNOT = 3e-3  # of a lag, a threshold or a rate: how well one is sought
LEVELS, BEYOND = 24, 1.4  # at which something that switches is tried to do so, and times the last knot, up to which
LEVEL = 1e-4  # of a level at which something switches, to which it is sought: every sample that it misses counts
FAR, PARTS = 2.0, np.linspace(-1.0, 1.0, 9)  # windows within which a moment is sought, and where in them
SHARPER = 0.25  # of that, by which it is sought the next time
ROUGHLY = 50.0  # samples, to which it is sought before all values are fitted
Away = Callable[[Correction, float], Correction | None]  # a law with its knot so far away, None where it cannot be


def finer(evidence: Evidence, found: Suspect, noise: float) -> Suspect:
    """Return a suspect with as many knots as the data ask for, or at the frequency, lag, level or rate asked for."""
    if found.correction.searched:
        return tuned(evidence, found)
    if found.correction.single:
        return max(found, of_one_knot(evidence, found), key=lambda s: s.worth(noise)[0])
    sharper = [suspect(evidence, correction) for correction in sharpened(evidence, found.correction)]
    return max([found, *sharper], key=lambda s: s.worth(noise)[0])


def tuned(evidence: Evidence, found: Suspect) -> Suspect:
    """Return a suspect of one frequency at that at which it explains most, to a small part of what runs resolve.

    A line that is off by a tenth of that leaves a tenth of itself: far above the noise it would not be what it is.
    """
    step_hz = BESIDE / evidence.longest_s
    while step_hz > TUNED / evidence.longest_s:
        at_hz = found.correction.knots[0]
        sides = [suspect(evidence, replace(found.correction, knots=(at_hz + by,))) for by in (-step_hz, step_hz)]
        better = max(sides, key=lambda s: s.gain)
        if better.gain > found.gain:
            found = better
        else:
            step_hz *= CLOSER
    return found


def distinct(evidence: Evidence, found: Sequence[Suspect]) -> list[Suspect]:
    """Return suspects, of those of one law that came to the same frequency the one that promises most."""
    kept: list[Suspect] = []
    for one in sorted(found, key=lambda s: -s.gain):
        if not any(_is_the_same(evidence, one.correction, other.correction) for other in kept):
            kept.append(one)
    return [s for s in found if any(s is one for one in kept)]


def _is_the_same(evidence: Evidence, one: Correction, other: Correction) -> bool:
    """Return whether two are one law of one frequency, as far as the longest run tells."""
    if not one.searched or (one.form, one.place) != (other.form, other.place):
        return False
    return abs(one.knots[0] - other.knots[0]) < BESIDE / evidence.longest_s


def retuned(evidence: Evidence, base: Chain, law: Correction) -> tuple[Correction, dict[str, float]] | None:
    """Return a fitted law of one knot at a better one, and all values there; None where noise may ask for it.

    ``evidence`` is of the fit with the law in ``base``: what a gap makes of a line hangs on how large the line is, and
    the plain values have moved for a lag that is not the right one, so that where it explains most is told from there
    and not from where it is absent.
    """
    evidence = evidence.seen_by(law)
    by = TUNED / (evidence.longest_s * law.knots[0]) if law.searched else KNOT
    column = evidence.change(_times(law, 1.0 + by).put_in(base, evidence.chain.values)) / by
    along, energy = evidence.products(column)
    step = float(np.clip(along / energy, -STRETCHED, STRETCHED)) if 0.0 < energy < np.inf else 0.0
    if step * (2.0 * along - step * energy) < 1.0:
        return None
    return _times(law, 1.0 + step), moved(evidence, step * (evidence.slopes @ column))


def _times(law: Correction, factor: float) -> Correction:
    """Return a law with its one knot, or the same on either side of zero, elsewhere."""
    return replace(law, knots=tuple(knot * factor for knot in law.knots))


def of_one_knot(evidence: Evidence, found: Suspect) -> Suspect:
    """Return a suspect with one knot in the place of several, where it explains most; its price is in its looks.

    Or with one on either side of zero. Far above the noise fixed lags, thresholds and rates leave of a law of one what
    laws of other physics may not. Where something switches, what it explains may rise and fall from one level at which
    a recording rests to the next: it is looked for all the way.
    """
    knots = found.correction.knots

    def at(x: float) -> Suspect:
        return suspect(evidence, replace(found.correction, knots=(*([-exp(x)] if knots[0] < 0.0 else []), exp(x))))

    further = np.linspace(0.0, BEYOND * max(knots), LEVELS + 1)[1:] if found.correction.jumps else ()
    logs = np.log(np.union1d([knot for knot in knots if knot > 0.0], further))
    beyond = np.diff(logs)[[0, -1]] if logs.size > 1 else np.zeros(2)
    best = int(np.argmax([at(x).gain for x in logs]))
    ends = np.concatenate((logs[:1] - beyond[0], logs, logs[-1:] + beyond[1]))
    bounds = ends[best], ends[best + 2]
    one = at(float(minimize_scalar(lambda x: -at(x).gain, bounds=bounds, options={"xatol": KNOT}).x))
    return replace(one, looks=0.5 * log(max(one.gain, 1.0)))


def of_one(law: Correction) -> bool:
    """Return whether a correction has one knot, or the same on either side of zero, in the place of several."""
    return law.single and len({abs(knot) for knot in law.knots}) == 1


def one_again(evidence: Evidence, law: Correction) -> Suspect:
    """Return a correction of one knot with that sought once more around where it is, on other evidence.

    One of several has one sought in their place.
    """
    around = sorted(knot * factor for knot in law.knots for factor in AROUND) if of_one(law) else law.knots
    return of_one_knot(evidence, suspect(evidence, replace(law, knots=tuple(around))))


def at_its_moment(evidence: Evidence, law: Correction) -> Suspect:
    """Return a law that comes in at a moment, its last knot, with that to some samples; its price is in its looks."""
    evidence = evidence.fine
    best = _at_best(law, lambda one: suspect(evidence, one).gain, _later, FAR * WINDOW_S, ROUGHLY * evidence.sample_s)
    return replace(suspect(evidence, best), looks=log(sum(o.trace.size for o in evidence.observations)))


def retimed(evidence: Evidence, base: Chain, law: Correction) -> tuple[Correction, dict[str, float]] | None:
    """Return a fitted law that comes in at a moment at a better one, and all values there; None where there is none.

    ``evidence`` is of the fit with the law in ``base``: far above the noise another moment is best where it is absent.
    """
    return _elsewhere(evidence.seen_by(law), base, law, _later, FAR * WINDOW_S, evidence.sample_s)


def relevelled(evidence: Evidence, base: Chain, law: Correction) -> tuple[Correction, dict[str, float]] | None:
    """Return a fitted law that switches at a level at a better one, and all values there; None where there is none.

    It is sought by what it does there: what switches late leaves nothing behind the level at which it does, and all of
    what it misses before it, so that no slope says how far off it is, or on which side.
    """
    return _elsewhere(evidence.fine, base, law, _scaled, STRETCHED, LEVEL)


def _elsewhere(
    evidence: Evidence, base: Chain, law: Correction, away: Away, reach: float, least: float
) -> tuple[Correction, dict[str, float]] | None:
    """Return a fitted law with the knot at which it would leave least, and all values there; None if that is its own.
    """

    def change(one: Correction) -> Array:
        return evidence.change(one.put_in(base, evidence.chain.values))

    best = _at_best(law, lambda one: evidence.gained(change(one)), away, reach, least)
    if evidence.gained(change(best)) < 1.0:
        return None
    return best, moved(evidence, evidence.slopes @ change(best))


def _at_best(
    law: Correction, gain: Callable[[Correction], float], away: Away, reach: float, least: float
) -> Correction:  # fmt: skip
    """Return a law with the knot of most gain within ``reach`` of its own, to the ``least`` that is looked at."""
    best = gain(law), law
    while reach > least:
        sides = (away(best[1], float(part) * reach) for part in PARTS if part)
        tried = [(gain(one), one) for one in sides if one is not None]
        best, reach = max([best, *tried], key=lambda pair: pair[0]), SHARPER * reach
    return best[1]


def _later(law: Correction, by_s: float) -> Correction | None:
    """Return a law that comes in so much later; None before its lags, where knots would not rise."""
    moment_s = law.knots[-1] + by_s
    rises = moment_s > max((0.0, *law.knots[:-1]))
    return replace(law, knots=(*law.knots[:-1], moment_s)) if rises else None


def _scaled(law: Correction, by: float) -> Correction:
    """Return a law with its one knot larger by a part of it."""
    return _times(law, 1.0 + by)
