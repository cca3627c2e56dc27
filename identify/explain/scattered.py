"""Is contact made elsewhere every time, or does w walk while it is held, so that no law foretells where?

Noise in front of the gap carries w along while a border pushes it, too; where only the contact is another, w keeps
what it found there until the next one, and where it walks in the gap, the next one ends that. Which of these makes
what repeats differ by likelier, is asked of each with the numbers that do so most (identify.wandering).
"""

from collections.abc import Callable, Sequence
from functools import partial
from math import exp, inf, log

import numpy as np
from scipy.linalg import LinAlgError
from scipy.optimize import minimize_scalar

from identify.chain import Chain
from identify.colour import Colour
from identify.effects.inside_play import gap_v
from identify.explain.bench import Bench
from identify.explain.carried import SIZES, Repeats, begun_at, cost_of, in_question, likeliest, repeats_of, tells_much
from identify.explain.hypothesis import Hypothesis
from identify.innovations import Wander
from identify.observe import Observation
from identify.wandering import gathered_of, scattered_of

SURELY = 20.0  # twice the log of a likelihood, by which that is likelier
STEP = log(SIZES[1] / SIZES[0])
Law = Callable[[Chain, Observation, float], Wander]
LAWS: tuple[Law, ...] = (  # contact made elsewhere, from the contact or from the turn before it on; what holds w walks
    partial(scattered_of, at_turns=False), partial(scattered_of, at_turns=True), gathered_of,
)


def scattered(bench: Bench, plain: Hypothesis) -> bool:
    """Return whether what repeats differ by is likelier made inside F, by one of its laws, than by noise before it.

    False where repeats differ by no more than chance lets them, or where readings are weighed beside something else.
    """
    laws, chain = in_question(bench, plain), plain.fit.chain
    if not laws:
        return False
    repeats = repeats_of(chain, bench.observations)
    least = min(_least(_cost(chain, repeats, law), gap_v(chain)) for law in LAWS)
    if not tells_much(repeats, least):
        return False
    begun = begun_at(laws[0], chain, repeats)
    if begun is None:
        return True
    among = [(law, law.put_in(chain, {})) for law in laws]
    if any(cost_of(law, there, repeats)(begun) < least for law, there in among):
        return False
    return all(least + SURELY < likeliest(law, there, repeats, begun)[1] for law, there in among)


def _cost(chain: Chain, repeats: Sequence[Repeats], law: Law) -> Callable[[float], float]:
    """Return the cost of differences between repeats over the log of a law's sd; infinity where there is none."""

    def cost(log_sd: float) -> float:
        try:
            wanders = [law(chain, r.observation, exp(log_sd)) for r in repeats]
            return sum(r.cost(Colour(wander=wander)) for r, wander in zip(repeats, wanders, strict=True))
        except (ValueError, ArithmeticError, LinAlgError):
            return inf

    return cost


def _least(cost: Callable[[float], float], gap: float) -> float:
    """Return the least cost near the best of some sizes, shares of the gap."""
    at = min(np.log(SIZES * gap).tolist(), key=cost)
    found = minimize_scalar(cost, bounds=(at - STEP, at + STEP), method="bounded", options={"xatol": 0.05})
    return float(found.fun)
