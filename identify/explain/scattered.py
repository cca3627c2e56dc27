"""Is contact made elsewhere every time, so that no law foretells where?

Noise in front of the gap carries w along while a border pushes it, too; where only the contact is another, w keeps
what it found there until the next one. Which of the two makes what repeats differ by likelier, is asked of
either with the numbers that do so most (identify.wandering).
"""

from collections.abc import Callable, Sequence
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
from identify.wandering import scattered_of

SURELY = 20.0  # twice the log of a likelihood, by which that is likelier
STEP = log(SIZES[1] / SIZES[0])


def scattered(bench: Bench, plain: Hypothesis) -> bool:
    """Return whether what repeats differ by is likelier made by contacts, each elsewhere, than by noise before them.

    False where repeats differ by no more than chance lets them, or where readings are weighed beside something else.
    """
    laws, chain = in_question(bench, plain), plain.fit.chain
    if not laws:
        return False
    repeats = repeats_of(chain, bench.observations)
    least = min(_least(_cost(chain, repeats, at_turns), gap_v(chain)) for at_turns in (False, True))
    if not tells_much(repeats, least):
        return False
    begun = begun_at(laws[0], chain, repeats)
    if begun is None:
        return True
    among = [(law, law.put_in(chain, {})) for law in laws]
    if any(cost_of(law, there, repeats)(begun) < least for law, there in among):
        return False
    return all(least + SURELY < likeliest(law, there, repeats, begun)[1] for law, there in among)


def _cost(chain: Chain, repeats: Sequence[Repeats], at_turns: bool) -> Callable[[float], float]:
    """Return the cost of differences between repeats over the log of the sd of contacts; infinity where there is none.
    """

    def cost(log_sd: float) -> float:
        try:
            wanders = [scattered_of(chain, r.observation, exp(log_sd), at_turns) for r in repeats]
            return sum(r.cost(Colour(wander=wander)) for r, wander in zip(repeats, wanders, strict=True))
        except (ValueError, ArithmeticError, LinAlgError):
            return inf

    return cost


def _least(cost: Callable[[float], float], gap: float) -> float:
    """Return the least cost near the best of some sizes, shares of the gap."""
    at = min(np.log(SIZES * gap).tolist(), key=cost)
    found = minimize_scalar(cost, bounds=(at - STEP, at + STEP), method="bounded", options={"xatol": 0.05})
    return float(found.fun)
