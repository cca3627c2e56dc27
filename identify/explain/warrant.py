"""Is a name earned: does the physics explain what it should, and as well as a free-form correction in its place would?"""

from dataclasses import dataclass

from identify.effects.effect import Effect
from identify.explain.locate import Located, located
from identify.explain.select import Bench, Hypothesis, Round

NEGLIGIBLE = 0.01  # share of the plain model's misfit that may remain without casting doubt on the names
DOMINANT = 0.5  # share of the misfit a name must explain when something else remains
AS_GOOD = 3.0  # factor by which a free-form correction may leave less than the named physics


@dataclass(frozen=True)
class Warranted:
    """The hypothesis whose names are earned, and what a free-form search finds on top of it (None: not looked for)."""

    hypothesis: Hypothesis
    beyond: Located


def warranted(bench: Bench, plain: Hypothesis, final: Hypothesis, rounds: list[Round]) -> Warranted:
    """Return the effects that earn their names.

    When hardly anything remains, all do: a wrong set of names does not reproduce recordings of several kinds to the
    noise. Else the effects are taken in the order they were found, and the first that explains less than half of what
    it was to explain, or much less than a free-form correction at the same place along the same axis, ends the list.
    """
    beyond = located(bench, final)
    if not final.effects or not beyond.significant or final.misfit < NEGLIGIBLE * plain.misfit:
        return Warranted(final, beyond)
    earned, above = plain, located(bench, bench.fitted(plain.fit.chain, ()))
    for step in rounds:
        winner = step.best
        if winner is None or not _earned(winner, earned, above, winner.effects[-1]):
            break
        earned = winner
        above = beyond if winner.effects == final.effects else located(bench, winner)
    return Warranted(earned, above)


def _earned(winner: Hypothesis, base: Hypothesis, above: Located, effect: Effect) -> bool:
    """Return whether one effect explains most of what was there, nearly as well as anything in its place could."""
    free = above.at(effect.place, effect.axis)
    best = above.fitted[0][1].misfit if above.fitted else float("inf")
    return winner.share(base) > DOMINANT and winner.misfit <= AS_GOOD * max(min(free, best), 0.0) + 1e-2
