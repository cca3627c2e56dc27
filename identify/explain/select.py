"""Which set of effects explains the residual, with no more in it than the data ask for?

Forward selection, then backward deletion. Each round screens every effect by what it would leave to first order, fits
the most promising ones jointly with the plain parameters, and takes the best if it pays for its parameters.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from scipy.stats import chi2 as chi2_distribution

from identify.chain import Chain
from identify.effects.effect import Effect
from identify.evidence import Candidate, Evidence, candidates
from identify.explain.hypothesis import NOISE_KNOWN, Hypothesis, is_discovery
from identify.explain.promise import Promise, promised
from identify.fit import VISIBLE, chi_squared, fit
from identify.observe import Observation, refined
from identify.phases import scanned
from identify.thinning import thinned

MOST_EFFECTS = 4
LOOKED_AT = 16  # candidates whose own parameters are fitted to first order
HOPEFUL = 0.03  # share of the best promise at its start below which a candidate is not looked at
DOUBTFUL = 0.05  # probability of a start's gain by chance above which nothing speaks for an effect
FITTED_A_ROUND = 8
PROMISING = 0.2  # share of the best promise below which a candidate is not fitted
COMPARED = 60.0  # of twice the log of odds: what is further behind is as good as excluded
SLACK = 30.0  # times the probability at which chance is excluded, up to which a candidate is fitted
NEXT = 2e-4  # share of what is explained already that one more effect must explain: a rig file is not exact either
SPRINT = 4  # iterations in which candidates are fitted side by side
LAPS = 9
NEAR, FAR = 200.0, 0.3  # of chi-squared, and share of the best fall: a fit further behind the best is not continued
STEPPED = 5  # rivals that are fitted again on a finer grid
EXCHANGED = 4  # rivals that an effect chosen early is exchanged for
HOPELESS = -1000.0  # of the criterion: an effect this far behind when it was tried is not tried again
ITERATIONS = 40
TURNS = 4  # times phases are looked for anew once the rest has moved

__all__ = ["NOISE_KNOWN", "Bench", "Hypothesis", "Round", "promising", "selected"]

Note = Callable[[str, float], None]


@dataclass(frozen=True)
class Bench:
    """The data and the plain chain all hypotheses are built on."""

    plain: Chain
    observations: tuple[Observation, ...]
    fixed: tuple[str, ...]
    kinds: tuple[type[Effect], ...]
    known: dict[tuple[Effect, ...], Hypothesis] = field(default_factory=dict)

    def fitted(self, chain: Chain, effects: Sequence[Effect], iterations: int = ITERATIONS) -> Hypothesis:
        """Fit a chain from its own values, with the priors of the plain parameters at the rig file's."""
        found = fit(chain, self.observations, self.plain.values, self.fixed, iterations, valleys=False)
        chi2 = sum(chi_squared(found.chain, o) for o in self.observations)
        return Hypothesis(tuple(effects), found, chi2, sum(o.count for o in self.observations))

    def with_effects(self, effects: Sequence[Effect], values: Mapping[str, float]) -> Chain:
        """Return the plain chain with ``effects`` in it and every value that ``values`` knows by full name."""
        chain = self.plain
        for effect in effects:
            chain = effect.put_in(chain, {})
        known = {k: v for k, v in values.items() if k.partition("[")[0] in chain.values}
        return chain.with_values(known)

    def evidence(self, base: Hypothesis) -> Evidence:
        """Return what the residual of a hypothesis tells, of as few samples as tell all of it."""
        fewer = thinned(base.fit, self.observations)
        every = Evidence(base.fit, self.observations)
        return every if fewer == self.observations else Evidence(base.fit, fewer, every)

    def refined(self, chain: Chain) -> "Bench":
        """Return the bench with grids fine enough for ``chain``."""
        finer = tuple(refined(o, chain) for o in self.observations)
        return self if finer == self.observations else replace(self, observations=finer, known={})

    def round(self, base: Hypothesis) -> "Round":
        """Screen all effects on the residual of ``base`` and fit those that promise most."""
        evidence = self.evidence(base)
        screened = candidates(evidence, self.kinds)
        runs = len(self.observations)
        hopes = [promised(evidence, c) for c in hopeful(screened, runs)]
        tried = self.raced(base, promising(hopes, len(screened), runs))
        return Round(base, tuple(screened), ranked(base, [*tried, *self.fuller(base, tried)]))

    def raced(self, base: Hypothesis, promises: Sequence[Promise]) -> list[Hypothesis]:
        """Fit candidates side by side, a few iterations at a time; one that falls far behind is not fitted further."""
        found = [self.extended(base, promise) for promise in promises]
        for _ in range(LAPS):
            best = min(found, key=lambda h: h.chi2, default=base)
            done = best.misfit < NOISE_KNOWN  # nothing can be much better than the noise
            reach = best.chi2 + max(NEAR, 0.0 if done else FAR * (base.chi2 - best.chi2))
            lap = [h if h.fit.converged or h.chi2 > reach else self.continued(h) for h in found]
            if all(new.chi2 > old.chi2 - VISIBLE for new, old in zip(lap, found, strict=True)):
                return lap
            found = lap
        return found

    def fuller(self, base: Hypothesis, tried: Sequence[Hypothesis]) -> list[Hypothesis]:
        """Fit forms with one parameter more of what came near the best, where the best leaves more than noise."""
        best = min(tried, key=lambda h: h.chi2, default=base)
        if best.misfit < NOISE_KNOWN:
            return []
        reach = best.chi2 + FAR * (base.chi2 - best.chi2)
        known, found = {h.effects[-1] for h in tried}, []
        for h in (h for h in tried if h.chi2 < reach):
            for more in type(h.effects[-1]).variants():
                if more not in known and more.contains(h.effects[-1]):
                    known.add(more)
                    effects = (*base.effects, more)
                    found.append(self.fitted(self.with_effects(effects, h.fit.chain.values), effects))
        return found

    def continued(self, hypothesis: Hypothesis, iterations: int = SPRINT) -> Hypothesis:
        """Fit a hypothesis further from where it is."""
        return self.fitted(hypothesis.fit.chain, hypothesis.effects, iterations)

    def decided(self, this: "Round") -> tuple["Bench", "Round"]:
        """Compare what came close again, on grids fine enough for all of it; return the bench on these grids, too."""
        finer = self
        close = this.close[:STEPPED]
        for rival in close:
            finer = finer.refined(rival.fit.chain)
        if finer is self:
            return self, this
        tried = [finer.fitted(rival.fit.chain, rival.effects) for rival in close]
        base = finer.fitted(this.base.fit.chain, this.base.effects)
        return finer, replace(this, base=base, tried=(*ranked(base, tried), *this.tried[len(tried) :]))

    def extended(self, base: Hypothesis, promise: Promise) -> Hypothesis:
        """Fit ``base`` with one more effect for a few iterations, and its angles until they stay."""
        effect = promise.candidate.effect
        apart = promise.chain.with_values(base.fit.chain.values)
        start = min((promise.chain, apart), key=lambda c: sum(chi_squared(c, o) for o in self.observations))
        effects = (*base.effects, effect)
        found = self.fitted(scanned(start, self.observations), effects, SPRINT)
        for _ in range(TURNS):
            turned = scanned(effect.upright(found.fit.chain), self.observations)
            if turned is found.fit.chain:
                break
            found = self.fitted(turned, effects)
        return found

    def pruned(self, hypothesis: Hypothesis) -> Hypothesis:
        """Drop effects that no longer pay for themselves beside the others, the weakest first."""
        while len(hypothesis.effects) > 1:
            without = [self.without(hypothesis, effect) for effect in hypothesis.effects]
            best = max(without, key=lambda h: h.advantage(hypothesis))
            if best.advantage(hypothesis) < 0.0:
                break
            hypothesis = best
        return self.simplified(hypothesis)

    def simplified(self, hypothesis: Hypothesis) -> Hypothesis:
        """Take simpler forms of effects, with fewer parameters, where the others do not pay."""
        for effect in hypothesis.effects:
            for simpler in type(effect).variants():
                if effect.contains(simpler):
                    effects = tuple(simpler if e is effect else e for e in hypothesis.effects)
                    found = self.fitted(self.with_effects(effects, hypothesis.fit.chain.values), effects)
                    hypothesis = found if found.advantage(hypothesis) > 0.0 else hypothesis
        return hypothesis

    def without(self, hypothesis: Hypothesis, effect: Effect) -> Hypothesis:
        """Fit ``hypothesis`` less one effect; what was fitted before on these data is remembered."""
        rest = tuple(e for e in hypothesis.effects if e is not effect)
        if rest not in self.known:
            self.known[rest] = self.fitted(self.with_effects(rest, hypothesis.fit.chain.values), rest)
        return self.known[rest]

    def swapped(self, hypothesis: Hypothesis, effect: Effect, rival: Hypothesis) -> Hypothesis:
        """Fit ``hypothesis`` with one effect replaced by the last one of a rival."""
        effects = tuple(rival.effects[-1] if e is effect else e for e in hypothesis.effects)
        values = {**hypothesis.fit.chain.values, **rival.fit.chain.values}
        return self.fitted(self.with_effects(effects, values), effects)

    def settled(self, hypothesis: Hypothesis, rounds: Sequence["Round"]) -> Hypothesis:
        """Exchange single effects for what came close when they were chosen, where that pays.

        An effect chosen first also had to cover for those found after it; beside them another law may do better.
        """
        for number, effect in enumerate(hypothesis.effects[:-1]):
            rest = {e.id for e in hypothesis.effects if e is not effect}
            rivals = [r for r in rounds[number].close if r.effects[-1].id not in rest][:EXCHANGED]
            options = [self.swapped(hypothesis, effect, r) for r in rivals if r.effects[-1] != effect]
            hypothesis = max([hypothesis, *options], key=lambda h: h.advantage(hypothesis))
        return hypothesis


@dataclass(frozen=True)
class Round:
    """One step of the selection: what was screened, what was fitted, best first."""

    base: Hypothesis
    screened: tuple[Candidate, ...]
    tried: tuple[Hypothesis, ...]
    settled: Hypothesis | None = None  # the winner, once the effects before it were looked at again beside it

    @property
    def information(self) -> float:
        """Return what the mismatch tells: by how much chi-squared falls at best."""
        return max((self.base.chi2 - h.chi2 for h in self.tried), default=0.0)

    def lead(self, hypothesis: Hypothesis) -> float:
        """Return how far a hypothesis is ahead of the winner of the fits, below zero when it is behind."""
        return hypothesis.advantage(self.tried[0], self.information)

    @property
    def close(self) -> tuple[Hypothesis, ...]:
        """Return what was not hopelessly behind the winner."""
        return tuple(h for h in self.tried if self.lead(h) > HOPELESS)

    @property
    def near(self) -> tuple[Hypothesis, ...]:
        """Return what the winner must be compared with closely."""
        return tuple(h for h in self.tried if self.lead(h) > -COMPARED)

    @property
    def best(self) -> Hypothesis | None:
        """Return the hypothesis that wins the round, None when chance may have made it or it is not worth a name."""
        winner = self.settled or (self.tried[0] if self.tried else None)
        if winner is None or not is_discovery(winner.p_value(self.base), len(self.screened)):
            return None
        return winner if winner.gains_enough(self.base) else None


def ranked(base: Hypothesis, tried: Sequence[Hypothesis]) -> tuple[Hypothesis, ...]:
    """Return hypotheses on the same base, the most probable first."""
    told = max((base.chi2 - h.chi2 for h in tried), default=0.0)
    return tuple(sorted(tried, key=lambda h: -h.advantage(base, told)))


def selected(bench: Bench, start: Hypothesis, note: Note) -> tuple[Bench, Hypothesis, list[Round]]:
    """Add effects one by one while each pays for itself, then drop those the others made superfluous.

    Returns the bench on the grids the winner needs, the winner, and what every round considered.
    """
    rounds: list[Round] = []
    best = start
    for number in range(MOST_EFFECTS):
        note(f"trying effects, round {number + 1}", 0.15 + 0.15 * number)
        bench, this = bench.decided(bench.round(best))
        if this.best is not None:
            this = replace(this, settled=bench.settled(this.best, [*rounds, this]))
        if this.best is not None and not _counts(start, this.base, this.best):
            this = replace(this, tried=(), settled=None)
        rounds.append(this)
        if this.best is None:
            break
        finer = bench.refined(this.best.fit.chain)
        best = this.best if finer is bench else finer.fitted(this.best.fit.chain, this.best.effects)
        bench = finer
    return bench, bench.pruned(best), rounds


def _counts(start: Hypothesis, base: Hypothesis, best: Hypothesis) -> bool:
    """Return whether a further effect explains more than what the right law of a large one leaves, taken roughly."""
    return base is start or base.chi2 - best.chi2 > NEXT * (start.chi2 - base.chi2)


def hopeful(screened: Sequence[Candidate], runs: int) -> list[Candidate]:
    """Return what is worth a closer look: the best forms of every effect at every place, those that promise most."""
    best = max((c.gain for c in screened), default=0.0)
    kept: list[Candidate] = []
    for candidate in screened:
        same = [c for c in kept if (c.effect.id, c.effect.place) == (candidate.effect.id, candidate.effect.place)]
        rival = all(candidate.gain > 0.6 * c.gain and c.effect.form != candidate.effect.form for c in same)
        told = candidate.gain > HOPEFUL * best and chance(candidate, candidate.gain, runs) < DOUBTFUL
        if told and len(same) < 2 and (not same or rival):
            kept.append(candidate)
    return kept[:LOOKED_AT]


def chance(candidate: Candidate, gain: float, runs: int) -> float:
    """Return how likely noise alone would make an effect, its parameters free, gain so much."""
    parameters = sum(runs if p.local else 1 for p in candidate.effect.parameters())
    return float(chi2_distribution.sf(max(gain, 0.0), parameters))


def promising(promises: Sequence[Promise], tried: int, runs: int) -> list[Promise]:
    """Return what is worth a fit: what chance has hardly made, and whose fit may come near that of the best."""
    told = [p for p in promises if is_discovery(chance(p.candidate, p.gain + p.slack, runs) / SLACK, tried)]
    most = sorted(told, key=lambda p: -p.gain)
    best, sure = max((p.gain for p in most), default=0.0), max((p.gain - p.slack for p in most), default=0.0)
    may_win = [p for p in most if p.gain > PROMISING * best and p.gain + p.slack > sure - COMPARED]
    return may_win[:FITTED_A_ROUND]
