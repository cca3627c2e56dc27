"""On what data and grids are sets of effects fitted and compared, and which further effect explains most?

A round screens effects by what they would leave to first order, and fits the most promising ones jointly with the plain
parameters. What was asked of a hypothesis once is remembered.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import inf, isfinite, log
from typing import Any, TypeVar

import numpy as np
from scipy.linalg import LinAlgError

from identify.chain import Chain
from identify.effects.effect import Effect
from identify.evidence import Evidence, evidence_of
from identify.explain.chance import scatters_more
from identify.explain.hypothesis import NOISE_KNOWN, Hypothesis
from identify.explain.round import Round, kind_of, richer
from identify.explain.screen import RoundOf
from identify.explain.searching import ENOUGH, Searching
from identify.explain.suspect import Suspect, explainable
from identify.explain.suspects import suspects
from identify.explain.wander import without_chance
from identify.explain.weights import Carried
from identify.fit import total_chi_squared
from identify.observe import Observation, refined
from identify.stage import Place
from identify.stepping import alike, coarsened

Told = TypeVar("Told")

ITERATIONS = 40
COARSER = 4  # instants of a grid to one of that on which a fit is searched
LATEST = "evidence", 0  # among what was asked
ROUNDS = 3  # of measuring what finer grids add, at most
RISEN = 3.0  # of chi-squared: coarse grids on which fits leave more each time lead to no optimum
MISLED = 2.0  # times what a fit left on coarse grids that it leaves in the end: they do not lead there


@dataclass(frozen=True)
class Bench:
    """The data, how well the variance of their noise is known, and the plain chain all hypotheses are built on.

    The data may be weighed beside what a law ``carried`` along by chance. A bench of other data or noise starts with
    nothing ``known`` or ``asked``.
    """

    plain: Chain
    observations: tuple[Observation, ...]
    fixed: tuple[str, ...]
    kinds: tuple[type[Effect], ...]
    known: dict[tuple[Effect, ...], Hypothesis] = field(default_factory=dict)
    noise_known: float = NOISE_KNOWN
    asked: dict[tuple[object, int], tuple[Hypothesis, Any]] = field(default_factory=dict)
    carried: Carried | None = None
    coarser: "Bench | None" = None  # the bench before its grids were refined

    @property
    def surprise(self) -> float:
        """Return the log of the odds, before any data, against one law being there: any of the catalogue might be."""
        return log(max(len(self.kinds), 1))

    @property
    def rough(self) -> float:
        """Return by how much chi-squared may fall because the data are weighed beside a law that is known roughly."""
        return self.carried.rough if self.carried else 0.0

    def fitted(
        self, chain: Chain, effects: Sequence[Effect], iterations: int = ITERATIONS, told: bool = True
    ) -> Hypothesis:
        """Fit a chain from its own values, with the priors of the plain parameters at the rig file's.

        The search goes on coarser grids; what those of the bench add to the answer is measured where it begins and
        where it ends, and again as long as that makes a difference; where they mislead, or what is left rises from one
        time to the next, those of the bench are taken.
        Where a fit is left to be continued, it need not be ``told`` how sure its values are.
        """
        seen = self._coarsened(chain)
        found = self._search.led(chain, effects, seen, iterations, told)
        believed, least, risen = found.cost, inf, False
        for _ in range(ROUNDS):
            before, seen = seen, self._coarsened(found.chain)
            if seen == before or alike(before, seen):
                break
            left = total_chi_squared(found.chain, seen)
            if risen := left > least + RISEN:
                break
            least = min(least, left)
            found = self._search.led(found.chain, effects, seen, iterations, told)
        if risen or found.cost > MISLED * believed:
            seen = self.observations
            found = self._search.searched(chain, effects, seen, iterations, told)
        left, swell = without_chance(found.chain, effects, seen, self.noise_known)
        count = round(sum(o.expected for o in self.observations))
        return Hypothesis(tuple(effects), found, left, count, self.noise_known, swell, self.observations)

    def fitted_from_f(self, chain: Chain, effects: Sequence[Effect]) -> Hypothesis:
        """Fit a chain from its own values, F and the effects first, while the lags stay where they are."""
        lags = [p.name for stage in self.plain.stages if stage.place != Place.F for p in stage.parameters()]
        first = replace(self, fixed=(*self.fixed, *lags)).fitted(chain, effects)
        return self.fitted(first.fit.chain, effects)

    def again(self, hypothesis: Hypothesis) -> Hypothesis:
        """Return a hypothesis fitted to these data on these grids: itself where it was."""
        return hypothesis if hypothesis.data is self.observations else self.remembered(_again, hypothesis)

    def finely(self, hypothesis: Hypothesis) -> Hypothesis:
        """Return a hypothesis fitted to its end on the grids of the bench: slopes there tell how sure values are."""
        chain, effects = hypothesis.fit.chain, hypothesis.effects
        found = self._search.searched(chain, effects, self.observations, ITERATIONS, enough=0.0)
        left, swell = without_chance(found.chain, effects, self.observations, self.noise_known)
        return replace(hypothesis, fit=found, chi2=left, swell=swell)

    @property
    def _search(self) -> Searching:
        """Return what fits a chain on grids that stay."""
        return Searching(self.plain.values, self.fixed, self.carried)

    def _coarsened(self, chain: Chain) -> tuple[Observation, ...]:
        """Return the data on coarser grids, with what their own add to an answer of ``chain``."""
        try:
            with np.errstate(over="ignore", invalid="ignore"):
                return tuple(coarsened(o, chain, COARSER) for o in self.observations)
        except (ValueError, ArithmeticError, LinAlgError):
            return self.observations

    def with_effects(self, effects: Sequence[Effect], values: Mapping[str, float]) -> Chain:
        """Return the plain chain with ``effects`` in it and every value that ``values`` knows by full name."""
        chain = self.plain
        for effect in effects:
            chain = effect.put_in(chain, {})
        known = {k: v for k, v in values.items() if k.partition("[")[0] in chain.values}
        return chain.with_values(known)

    def from_rig_file(self, hypothesis: Hypothesis) -> Chain:
        """Return the chain of a hypothesis with the plain values of the rig file, those of its effects as they are."""
        own = {k: v for k, v in hypothesis.fit.chain.values.items() if k not in self.plain.values}
        return self.with_effects(hypothesis.effects, {**self.plain.values, **own})

    def evidence(self, base: Hypothesis) -> Evidence:
        """Return what the residual of a hypothesis tells, of as few samples as tell all of it.

        That of the last one is kept: it is asked many things in a row, and each computes a part of it.
        """
        if self.asked.get(LATEST, (None,))[0] is not base:
            self.asked[LATEST] = base, evidence_of(base.fit, self.observations)
        latest: Evidence = self.asked[LATEST][1]
        return latest

    def suspects(self, base: Hypothesis) -> list[Suspect]:
        """Return what every correction of free form promises on top of a hypothesis; asked again, it is remembered.

        Beside a law whose chance the data are weighed beside, none that may be its.
        """
        return self.remembered(_suspects, base, ENOUGH)

    def suspects_near(self, base: Hypothesis, within: float) -> tuple[float, list[Suspect]]:
        """Return the same, or what it was on coarser grids, and the chi-squared that these corrections would lower."""
        before = None if (_suspects, id(base)) in self.asked else self.told_before(_suspects, base, within)
        return (before[0].chi2, before[1]) if before else (base.chi2, self.suspects(base))

    def remembered(
        self, question: "Callable[[Bench, Hypothesis], Told]", base: Hypothesis, within: float = 0.0
    ) -> Told:
        """Return what a question about a hypothesis was answered before on these data, or ask it.

        Or what it was answered on coarser grids, which made less of a difference than ``within``.
        """
        key = question, id(base)
        if key not in self.asked:
            before = self.told_before(question, base, within)
            self.asked[key] = base, before[1] if before else question(self, base)
        answer: Told = self.asked[key][1]
        return answer

    def told_before(
        self, question: "Callable[[Bench, Hypothesis], Told]", base: Hypothesis, within: float
    ) -> tuple[Hypothesis, Told] | None:
        """Return a hypothesis of the same effects on coarser grids, and what a question about it was answered.

        None where it was not asked, or the grids make more of a difference than ``within`` of chi-squared.
        """
        if self.coarser is None:
            return None
        for (asked, _), (known, answer) in self.coarser.asked.items():
            if asked == question and known.effects == base.effects and abs(known.chi2 - base.chi2) < within:
                return known, answer
        return self.coarser.told_before(question, base, within)

    def explainable(self, base: Hypothesis) -> float:
        """Return how much of chi-squared there is to explain: beyond the noise, or what free-form corrections find."""
        if base.misfit > base.noise_known or base.swell > 1.0:
            return base.chi2 - base.count
        return explainable(self.suspects(base))

    def complete(self, hypothesis: Hypothesis) -> bool:
        """Return whether what a hypothesis leaves may all be noise.

        It is less than what the noise's variance is known to, or less than twice that and no correction of free form
        finds anything in it.
        """
        if hypothesis.misfit < self.noise_known or hypothesis.proven or hypothesis.swell > 1.0:
            return hypothesis.misfit < self.noise_known
        return not explainable(self.suspects(hypothesis))

    def of_kinds(self, kinds: Iterable[type[Effect]]) -> "Bench":
        """Return the bench with other kinds: what is asked of either is remembered by both."""
        return replace(self, kinds=tuple(kinds))

    def refined(self, chain: Chain) -> "Bench":
        """Return the bench with grids fine enough for ``chain``."""
        finer = tuple(refined(o, chain) for o in self.observations)
        if finer == self.observations:
            return self
        return replace(self.on(finer), coarser=self)

    def on(self, observations: tuple[Observation, ...]) -> "Bench":
        """Return the bench with other data, of which nothing is known yet."""
        return replace(self, observations=observations, known={}, asked={}, coarser=None)

    def fine_enough(self, *hypotheses: Hypothesis) -> "Bench":
        """Return the bench with grids fine enough for all hypotheses; any are where one's chance swells the noise."""
        bench = self
        for hypothesis in hypotheses:
            bench = bench.refined(hypothesis.fit.chain) if hypothesis.swell == 1.0 else bench
        return bench

    def round(self, base: Hypothesis, least: float = 0.0, unwanted: Effect | None = None) -> Round:
        """Screen effects on the residual of ``base`` and fit those that promise most, ``least`` in chi-squared.

        One that is ``unwanted`` is left out at its place, and with it what acts by chance. Where no correction of free
        form finds even a hint of anything, those that may show to none are screened alone. Of what acts by chance that
        is not asked: first order foresees the mean of it alone.
        """
        return self.remembered(RoundOf(self.kinds, least, kind_of(unwanted) if unwanted else None), base)

    def possible(self, hypothesis: Hypothesis) -> bool:
        """Return whether its effects are there, parts could be so, and none implies more scatter than there is.

        How much a law scatters beside which the readings are weighed, repeats have told.
        """
        chain = hypothesis.fit.chain
        if not all(isfinite(chain.values[p.name]) for effect in hypothesis.effects for p in effect.parameters()):
            return False
        if not all(effect.plausible(chain, self.observations) for effect in hypothesis.effects):
            return False
        asked = [effect for effect in hypothesis.effects if not self.carried or effect != self.carried.law]
        return not any(scatters_more(chain, effect, self.observations) for effect in asked)

    def fuller(self, base: Hypothesis, tried: Sequence[Hypothesis]) -> list[Hypothesis]:
        """Fit forms with one parameter more of what such a one may bring ahead."""
        known, found = {h.effects[-1] for h in tried}, []
        for h in richer(base, tried):
            for more in (form for form in h.effects[-1].fuller() if form not in known):
                known.add(more)
                found.append(self.reformed(h, h.effects[-1], more))
        return found

    def reformed(
        self, hypothesis: Hypothesis, effect: Effect, form: Effect, iterations: int = ITERATIONS
    ) -> Hypothesis:
        """Fit ``hypothesis`` with another form of one of its effects, from the values it has."""
        effects = hypothesis.effects_with(form, effect)
        chain = self.with_effects(effects, hypothesis.fit.chain.values)
        return self.fitted(form.completed(chain, Evidence(hypothesis.fit, self.observations)), effects, iterations)

    def without(self, hypothesis: Hypothesis, effect: Effect) -> Hypothesis:
        """Fit ``hypothesis`` less one effect; what was fitted before on these data is remembered."""
        rest = tuple(e for e in hypothesis.effects if e is not effect)
        return self.once(rest, lambda: self.fitted(self.with_effects(rest, hypothesis.fit.chain.values), rest))

    def once(self, effects: tuple[Effect, ...], fitted: Callable[[], Hypothesis]) -> Hypothesis:
        """Return what was ``fitted`` with these effects before on these data, or fit it."""
        if effects not in self.known:
            self.known[effects] = fitted()
        return self.known[effects]


def _suspects(bench: Bench, base: Hypothesis) -> list[Suspect]:
    """Return what every correction of free form promises, but for what a law that is carried along may do."""
    return [s for s in suspects(bench.evidence(base)) if not bench.carried or bench.carried.leaves(s)]


def _again(bench: Bench, hypothesis: Hypothesis) -> Hypothesis:
    return bench.fitted(hypothesis.fit.chain, hypothesis.effects)
