"""What is each physics that the data cannot exclude worth, fitted in the place of the one that was named?"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import log

from identify.candidates import evidence_starts
from identify.chain import Chain
from identify.effects import catalogue
from identify.effects.effect import Effect
from identify.evidence import Evidence
from identify.explain.explanation import Explanation, Finding
from identify.fit import Fit, fit, total_chi_squared
from identify.observe import Observation, refined
from identify.phases import angles_of, scanned
from identify.unnamed.correction import UNNAMED

ITERATIONS = 40

Grids = tuple[Observation, ...]


@dataclass(frozen=True)
class Contender:
    """One physics of an undecided set, fitted to all the training data with everything else that was found.

    ``exact``: whatever is played, it gives the same data as the one that was named. ``chi2`` is that of the fit, on
    grids of ``substeps`` instants to a sample at most, the same for all members.
    """

    id: str
    stage: str
    probability: float
    effect: Effect | None = None
    fit: Fit | None = None
    chi2: float = float("inf")
    exact: bool = False
    substeps: int = 1

    @property
    def nameless(self) -> bool:
        """Return whether it is a law of free form: only near the truth, wherever it is."""
        return self.id == UNNAMED

    @property
    def label(self) -> str:
        """Return what it is called in sentences."""
        return f"{'an unnamed law' if self.nameless else self.id} in {self.stage}"

    def price(self, count: int) -> float:
        """Return Schwarz's criterion: chi-squared and the price of every number that was searched."""
        return self.chi2 + (len(self.fit.coordinates) if self.fit else 0) * log(count)


@dataclass(frozen=True, eq=False)
class Entry:
    """A member of a set before it is fitted, and what it was fitted as on less data, where it was."""

    id: str
    stage: str
    probability: float
    before: Contender | None = None


def contenders(told: Explanation, finding: Finding, earlier: Sequence[Contender] = ()) -> tuple[Contender, ...]:
    """Return the members of a finding's set, the named one first, with those that were in it on less data.

    Those that cannot be fitted, and those that are exactly equal to the named one, come without a fit. All others are
    fitted on the same grids, fine enough for what each was fitted as before.
    """
    named = named_effect(told, finding)
    same = {c.id for c in named.equals}
    entries = _entries(finding, earlier)
    open_to = [e for e in entries if e.id not in same]
    warm = {(e.id, e.stage): _again(told, named, e.before) for e in open_to if e.before is not None}
    own = _named_alone(told)
    grids = fine_enough(told.train, [own.chain, *(chain for chain in warm.values() if chain is not None)])
    base = fitted(told, without(told, named), grids)
    found: list[tuple[Effect | None, Fit | None]] = [(named, fitted(told, own.chain, grids))]
    none: tuple[Effect | None, Fit | None] = (None, None)
    found += [_best(told, base, grids, e, warm.get((e.id, e.stage))) if e in open_to else none for e in entries]
    final = fine_enough(grids, [f.chain for _, f in found if f is not None])
    members = [Entry(finding.id, finding.stage, finding.probability), *entries]
    return tuple(
        _contender(told, m, effect, f, m.id in same, final) for m, (effect, f) in zip(members, found, strict=True)
    )


def _contender(
    told: Explanation, member: Entry, effect: Effect | None, found: Fit | None, exact: bool, grids: Grids
) -> Contender:
    """Return a member on the grids that all members need in the end."""
    if found is None:
        return Contender(member.id, member.stage, member.probability, exact=exact)
    found = fitted(told, found.chain, grids)
    chi2, substeps = total_chi_squared(found.chain, grids), max(o.substeps for o in grids)
    return Contender(member.id, member.stage, member.probability, effect, found, chi2, exact, substeps)


def named_effect(told: Explanation, finding: Finding) -> Effect:
    """Return the effect of a finding in the improved model."""
    effects = (e for e in told.improved.chain.added if isinstance(e, Effect))
    return next(e for e in effects if (e.id, e.place.label) == (finding.id, finding.stage))


def _entries(finding: Finding, earlier: Sequence[Contender]) -> list[Entry]:
    """Return the rivals of a finding: those that are in doubt now, and those that were."""
    fits = {(c.id, c.stage): c for c in earlier if c.fit is not None}
    now = [Entry(o.id, o.stage, o.probability, fits.get((o.id, o.stage))) for o in finding.could_also_be]
    known = {(e.id, e.stage) for e in now} | {(finding.id, finding.stage)}
    return [*now, *(Entry(c.id, c.stage, 0.0, c) for key, c in fits.items() if key not in known)]


def fine_enough(observations: Sequence[Observation], chains: Sequence[Chain]) -> Grids:
    """Return observations on grids fine enough for all chains."""
    found = tuple(observations)
    for chain in chains:
        found = tuple(refined(o, chain) for o in found)
    return found


def _named_alone(told: Explanation) -> Fit:
    """Return the fit of the improved model, less the unnamed part it may have: that would blur what names explain."""
    if all(isinstance(effect, Effect) for effect in told.improved.chain.added):
        return told.improved
    return fitted(told, without(told, None), told.train)


def without(told: Explanation, named: Effect | None) -> Chain:
    """Return the chain of the improved model less one effect, and less what has no name."""
    chain = told.plain.chain
    for effect in told.improved.chain.added:
        if isinstance(effect, Effect) and effect != named:
            chain = effect.put_in(chain, {})
    return _valued(chain, told.improved.chain)


def _valued(chain: Chain, like: Chain) -> Chain:
    """Return a chain with every value that another one knows by the same name."""
    return chain.with_values({k: v for k, v in like.values.items() if k.partition("[")[0] in chain.values})


def _again(told: Explanation, named: Effect, before: Contender | None) -> Chain | None:
    """Return the chain with an earlier contender in the place of the named effect, at the values it was fitted with."""
    base = without(told, named)
    if before is None or before.effect is None or before.fit is None or not before.effect.applicable(base):
        return None
    chain = _valued(before.effect.put_in(base, {}), before.fit.chain)
    return scanned(chain, told.train, angles_of(chain.parameters()))


def fitted(told: Explanation, chain: Chain, observations: Sequence[Observation]) -> Fit:
    """Fit a chain, the plain values held as weakly as in the explanation's own fits."""
    centre = {c.name: c.centre for c in told.plain.coordinates}
    return fit(chain, observations, centre, told.model.fixed, ITERATIONS, valleys=False)


def _best(
    told: Explanation, base: Fit, grids: Grids, entry: Entry, warm: Chain | None
) -> tuple[Effect | None, Fit | None]:
    """Return the best form of a rival and its fit; None where the catalogue or these data know none."""
    kind = catalogue().get(entry.id)
    variants = [e.told_apart(base.chain) for e in kind.variants() if e.place.label == entry.stage] if kind else []
    evidence = Evidence(base, grids)
    tried: list[tuple[Effect | None, Fit | None]] = []
    for effect in (e for e in variants if e.applicable(base.chain)):
        start = _start(evidence, effect)
        if start is not None:
            turned = scanned(start, grids, angles_of(effect.parameters()))
            tried.append((effect, fitted(told, turned, grids)))
    if warm is not None and entry.before is not None:
        tried.append((entry.before.effect, fitted(told, warm, grids)))
    count = sum(o.count for o in grids)
    return min(tried, key=lambda pair: _price(pair[1], count), default=(None, None))


def _price(found: Fit | None, count: int) -> float:
    return found.cost + len(found.coordinates) * log(count) if found is not None else float("inf")


def _start(evidence: Evidence, effect: Effect) -> Chain | None:
    """Return the chain at the start of an effect that promises most; None where it has no start."""
    starts = evidence_starts(evidence, effect)
    if not starts:
        return None
    return effect.put_in(evidence.chain, max(starts, key=lambda values: evidence.gain(effect, values)))
