"""What do the outcomes of a study say together: how often right, how often wrong, and are the odds true?"""

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from tests.proof.outcome import TO_THE_NOISE, Claim, Outcome

CONFIDENT = 0.5  # a name that is more likely than not, by its own word


@dataclass(frozen=True)
class Share:
    """So many of so many."""

    count: int
    total: int

    def __str__(self) -> str:
        """Return the share in words; nothing of nothing is a dash."""
        return f"{self.count} of {self.total} ({100.0 * self.count / self.total:.0f} %)" if self.total else "-"

    @property
    def ratio(self) -> float:
        """Return the share as a number, one when nothing was counted."""
        return self.count / self.total if self.total else 1.0


def share(outcomes: Iterable[Outcome], right: Callable[[Outcome], bool]) -> Share:
    """Return how many outcomes are right in a sense; an answer that failed is not."""
    told = [not o.failed and right(o) for o in outcomes]
    return Share(sum(told), len(told))


def intervals(outcomes: Iterable[Outcome]) -> Share:
    """Return how many intervals of right names hold the truth."""
    held = [holds for o in outcomes for _, holds in o.intervals()]
    return Share(sum(held), len(held))


def proven(outcomes: Iterable[Outcome]) -> Share:
    """Return how many answers that say ``explained`` leave no more than 1.1 times the noise on held-out data."""
    return share((o for o in outcomes if o.verdict == "explained"), lambda o: o.held_out_ratio <= TO_THE_NOISE)


@dataclass(frozen=True)
class Tenth:
    """The claims whose probability lies in one tenth: how sure they were on average, how many were true."""

    low: float
    said: float
    true: Share


def reliability(claims: Sequence[Claim]) -> list[Tenth]:
    """Return the filled tenths of the reliability curve."""
    found = []
    for i in range(10):
        here = [c for c in claims if i == min(int(10.0 * c.probability), 9)]
        if here:
            mean = float(np.mean([c.probability for c in here]))
            found.append(Tenth(i / 10.0, mean, Share(sum(c.true for c in here), len(here))))
    return found


def brier(claims: Sequence[Claim]) -> float:
    """Return the mean squared difference of probability and truth (Brier, Mon. Weather Rev. 78 (1950) 1)."""
    return float(np.mean([(c.probability - c.true) ** 2 for c in claims])) if claims else float("nan")


def confusion(outcomes: Iterable[Outcome]) -> dict[str, Counter[str]]:
    """Return, for every physics concealed alone, what was named first; the verdict where nothing was."""
    table: dict[str, Counter[str]] = {}
    for o in outcomes:
        truth = o.ids[0] if o.ids else "nothing"
        table.setdefault(truth, Counter())[_likeliest(o)] += 1
    return dict(sorted(table.items()))


def _likeliest(outcome: Outcome) -> str:
    """Return the name given with the highest probability, or how there is none."""
    if outcome.findings:
        return str(max(outcome.findings, key=lambda finding: finding["probability"])["id"])
    return "failure" if outcome.failed else "nothing" if outcome.verdict == "consistent" else "unnamed"


def confident_and_wrong(outcome: Outcome) -> bool:
    """Return whether a name that is not true was called more likely than not."""
    return any(f["id"] in outcome.wrong and f["probability"] > CONFIDENT for f in outcome.findings)
