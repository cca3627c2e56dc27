"""Is a name earned: does the physics explain what it should, as well as a free-form correction in its place would?"""

from dataclasses import dataclass

from identify.explain.locate import Located, located
from identify.explain.select import Bench, Hypothesis, Round

NEGLIGIBLE = 0.05  # share of the plain model's misfit that may remain without casting doubt on the names
DOMINANT = 0.5  # share of the misfit a name must explain when something else remains
SAME_KIND = 0.4  # share of what a name leaves that a free-form correction of its own kind may explain


@dataclass(frozen=True)
class Warranted:
    """The hypothesis whose names are earned, and what a free-form search finds on top of it."""

    hypothesis: Hypothesis
    beyond: Located


def warranted(bench: Bench, plain: Hypothesis, final: Hypothesis, rounds: list[Round]) -> Warranted:
    """Return the effects that earn their names.

    When nothing remains beyond the noise, all do: a wrong set of names does not reproduce recordings of several kinds.
    Else the effects are taken in the order they were found, and the first one ends the list that explains less than
    half of what it was to explain, or that leaves more than a little of the whole misfit while a free-form correction
    at its place along its axis could take much of that away: then the place may be right, but the law is not.
    """
    beyond = located(bench, final)
    if not final.effects or not beyond.significant:
        return Warranted(final, beyond)
    earned, above = plain, None
    for step in rounds:
        winner = step.best
        if winner is None or winner.share(earned) < DOMINANT:
            break
        left = beyond if winner.effects == final.effects else located(bench, winner)
        effect = winner.effects[-1]
        if winner.misfit > NEGLIGIBLE * plain.misfit and left.share_at(effect.place, effect.axis) > SAME_KIND:
            break
        earned, above = winner, left
    return Warranted(earned, above or located(bench, plain))
