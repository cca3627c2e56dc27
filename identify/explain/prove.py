"""Does unnamed physics hold on data used neither for fitting nor for choosing?"""

from collections.abc import Sequence
from dataclasses import dataclass

from identify.explain.bench import Bench
from identify.explain.confirm import CONVINCING, adapted, held_out_rms, improvement
from identify.explain.hypothesis import Hypothesis
from identify.explain.locate import Located, is_table
from identify.explain.suspect import is_fine
from identify.observe import Observation, refined
from identify.unnamed.correction import Correction


@dataclass(frozen=True)
class Proof:
    """A correction that makes held-out data fit better, the hypothesis with it in, and what that leaves there, V."""

    correction: Correction
    hypothesis: Hypothesis
    held_out_v: float


def foretells(beyond: Located) -> bool:
    """Return whether the best correction says anything of other runs.

    What goes with the clock or has a phase in every run does not, nor a table as fine as the data.
    """
    if not beyond.significant:
        return False
    best = beyond.best
    return not (is_table(best) or best.local or best.axis == "clock time")


def proven(bench: Bench, beyond: Located, test: Sequence[Observation]) -> Proof | None:
    """Return the best correction, fitted to the end, where it proves itself on held-out data.

    A table as fine as the data cannot: it says nothing of another time.
    """
    if not beyond.significant or is_fine(beyond.best):
        return None
    correction, fitted = beyond.fitted[0]
    fitted = bench.refined(fitted.fit.chain).fitted(fitted.fit.chain, fitted.effects)
    test = [refined(o, fitted.fit.chain) for o in test]
    with_it, without = adapted(fitted.fit.chain, test), adapted(beyond.base.fit.chain, test)
    if improvement(with_it, without, test) < CONVINCING:
        return None
    return Proof(correction, fitted, held_out_rms(with_it, test))
