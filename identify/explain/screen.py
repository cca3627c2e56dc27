"""Which further laws explain most on top of a hypothesis?

They are screened by what they would leave to first order, and those that promise most are fitted jointly with all
other values.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from identify.candidates import Candidate, candidates
from identify.chain import Chain
from identify.effects.effect import Effect
from identify.explain.chance import as_large
from identify.explain.hypothesis import Hypothesis
from identify.explain.promise import Promise, promised, together
from identify.explain.race import begun_anew, doubled, raced
from identify.explain.round import (
    LOOKED_AT,
    PAIRED,
    Kind,
    Round,
    hopeful,
    kind_of,
    lagging,
    outdone,
    passed_over,
    promising,
    ranked,
    unforeseen,
)
from identify.explain.suspect import hinted
from identify.explain.wander import MOSTLY, unrepeated

if TYPE_CHECKING:
    from identify.explain.bench import Bench


@dataclass(frozen=True)
class RoundOf:
    """Which laws of some kinds explain most, and more than ``least`` of chi-squared, one ``unwanted`` left out?

    Where one is, the law that is looked for has to do nearly all there is, and nothing is fitted that promises less.
    """

    kinds: tuple[type[Effect], ...]
    least: float
    unwanted: Kind | None = None

    def __call__(self, bench: "Bench", base: Hypothesis) -> Round:
        """Return what was screened and fitted on top of a hypothesis."""
        evidence = bench.evidence(base)
        screened = [c for c in candidates(evidence, _worth_a_look(bench, base)) if self.wants(c.effect)]
        looks = max(len(screened), sum(len(list(kind.variants())) for kind in self.kinds))
        runs = len(bench.observations)
        likely = hopeful(screened, runs)
        hopes = [promised(evidence, c) for c in likely[:LOOKED_AT]]
        scattered = base.proven > 0.0
        hopes = [p for p in hopes if p.gain + p.slack > self.least or (scattered and p.candidate.effect.by_chance)]
        worth = promising(hopes, looks, runs)
        if self.unwanted is not None and not worth:
            return Round(base, looks, ())
        tried = raced(bench, base, worth)
        late = outdone(hopes, worth, base.chi2 - min((h.chi2 for h in tried), default=base.chi2)) if tried else []
        worth, tried = [*worth, *late], doubled(bench, base, [*tried, *raced(bench, base, late, tried)], self.least)
        complete = bench.complete(min((base, *tried), key=lambda h: h.chi2))
        starts = self._unpromised(bench, base, screened, hopes, worth, tried, complete)
        tried = begun_anew(bench, base, [*tried, *raced(bench, base, starts, tried)])
        fitted = [h for h in (*tried, *bench.fuller(base, tried)) if bench.possible(h)]
        fitted = [h for h in fitted if base.chi2 - h.chi2 >= bench.rough] if bench.rough else fitted
        others = [Promise(c, c.effect.put_in(evidence.chain, c.values), c.gain) for c in likely[LOOKED_AT:PAIRED]]
        pairs = () if complete else together(evidence, [*hopes, *others])
        return Round(base, looks, ranked(base, fitted), None, passed_over(hopes, worth), pairs)

    def _unpromised(
        self, bench: "Bench", base: Hypothesis, screened: Sequence[Candidate], hopes: Sequence[Promise],
        worth: Sequence[Promise], tried: Sequence[Hypothesis], complete: bool,
    ) -> list[Promise]:  # fmt: skip
        """Return where fits begin of what first order does not promise: most where the best fit leaves much."""
        if complete and base.misfit >= bench.noise_known:
            beyond = base.chi2 - base.count
            lags = lagging(screened, tried, base, False, beyond) if beyond > self.least else []
            return [Promise(c, c.effect.put_in(base.fit.chain, c.values), c.gain) for c in lags]
        wanders = unrepeated(base.fit.chain, bench.observations)
        there = bench.explainable(base)
        unmet = [p.candidate for p in unforeseen(hopes, worth, tried, base, there)]
        lags = lagging(screened, tried, base, wanders > MOSTLY, there) if there > self.least else []
        left = [*unmet, *(c for c in lags if c not in unmet)]
        return [Promise(c, _begun(bench, base, c, wanders), c.gain) for c in left]

    def wants(self, effect: Effect) -> bool:
        """Return whether a law is looked at: where one is left out, so is what acts by chance."""
        return self.unwanted is None or not (effect.by_chance or kind_of(effect) == self.unwanted)


def _worth_a_look(bench: "Bench", base: Hypothesis) -> tuple[type[Effect], ...]:
    """Return the effects that may be there for all that corrections of free form find."""
    if base.proven or base.swell > 1.0 or bench.carried or hinted(bench.suspects(base)):
        return bench.kinds
    return tuple(kind for kind in bench.kinds if kind.shapeless)


def _begun(bench: "Bench", base: Hypothesis, candidate: Candidate, wanders: float) -> Chain:
    """Return where the fit of a candidate begins: what acts by chance as strong as makes all that wanders."""
    chain, effect = candidate.effect.put_in(base.fit.chain, candidate.values), candidate.effect
    changed = wanders * (base.chi2 - base.count)
    return as_large(chain, effect, bench.observations, changed) if effect.by_chance and changed > 0.0 else chain
