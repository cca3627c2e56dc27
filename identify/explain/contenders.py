"""What is each physics that the data cannot exclude worth, fitted in the place of the one that was named?"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import exp, log

from identify.chain import Chain
from identify.effects import catalogue
from identify.effects.effect import Effect
from identify.evidence import Evidence, evidence_starts
from identify.explain.explanation import Alternative, Explanation, Finding
from identify.fit import Fit, chi_squared, fit
from identify.observe import Observation, refined
from identify.phases import scanned

ITERATIONS = 40
EXCLUDED = 0.01  # probability below which a member of a set is excluded


@dataclass(frozen=True)
class Contender:
    """One physics of an undecided set, fitted to all the training data with everything else that was found.

    ``exact``: whatever is played, it gives the same data as the one that was named. ``chi2`` is that of the fit, on
    grids of ``substeps`` instants to a sample at most, the same for all members.
    """

    id: str
    stage: str
    probability: float
    fit: Fit | None
    chi2: float = float("inf")
    exact: bool = False
    substeps: int = 1

    @property
    def label(self) -> str:
        """Return what it is called in sentences."""
        return f"{self.id} in {self.stage}"

    def price(self, count: int) -> float:
        """Return Schwarz's criterion: chi-squared and the price of every number that was searched."""
        return self.chi2 + (len(self.fit.coordinates) if self.fit else 0) * log(count)


def contenders(told: Explanation, finding: Finding, more: Sequence[tuple[str, str]] = ()) -> tuple[Contender, ...]:
    """Return the members of a finding's set, the named one first, with ``more`` (id, stage) that were in it before.

    Those that cannot be fitted, and those that are exactly equal to the named one, come without a fit.
    """
    named = next(e for e in told.improved.chain.added if e.name == finding.id)
    assert isinstance(named, Effect)
    same = {c.id for c in named.confused_with if c.exact and c.here in (None, named.place)}
    known = {(o.id, o.stage) for o in finding.could_also_be} | {(finding.id, finding.stage)}
    others = [*finding.could_also_be, *(Alternative(i, stage, 0.0) for i, stage in more if (i, stage) not in known)]
    base = _fit(told, _without(told, named), told.train)
    fits = [_named_alone(told), *(None if o.id in same else _fitted(told, base, o) for o in others)]
    members = [Alternative(finding.id, finding.stage, finding.probability), *others]
    grids, fitted = _on_one_grid(told, fits)
    substeps = max(o.substeps for o in grids)
    return tuple(
        Contender(m.id, m.stage, m.probability, found, chi2, m.id in same, substeps)
        for m, (found, chi2) in zip(members, fitted, strict=True)
    )


def remembered(told: Explanation, sets: Sequence[Sequence[tuple[str, str]]]) -> Explanation:
    """Return the explanation with every member of earlier sets kept that the data do not exclude.

    What was in doubt before is out of doubt only when it was fitted to all the data and lost: an explanation may have
    passed it over this time.
    """
    return replace(told, effects=tuple(_remembering(told, f, sets) for f in told.effects))


def _remembering(told: Explanation, finding: Finding, sets: Sequence[Sequence[tuple[str, str]]]) -> Finding:
    """Return a finding with the earlier rivals that were fitted again and are not excluded.

    Its own set is one it was in; where it is new, one of which no member is named any more.
    """
    named_now = {(f.id, f.stage) for f in told.effects}
    own = [members for members in sets if (finding.id, finding.stage) in members]
    own = own or [members for members in sets if not named_now & set(members)]
    before = [member for members in own for member in members]
    known = {(o.id, o.stage) for o in finding.could_also_be} | {(finding.id, finding.stage)}
    missing = [member for member in dict.fromkeys(before) if member not in known]
    if not missing:
        return finding
    named, *others = contenders(told, finding, missing)
    count = sum(o.count for o in told.train)
    odds = {
        (m.id, m.stage): exp(min(0.5 * (named.price(count) - m.price(count)), 3.0))
        for m in others if (m.id, m.stage) in missing and not m.exact
    }  # fmt: skip
    odds = {member: weight for member, weight in odds.items() if weight > EXCLUDED}
    total = 1.0 + sum(odds.values())
    added = [Alternative(i, stage, finding.probability * w / total) for (i, stage), w in odds.items()]
    kept = [replace(o, probability=o.probability / total) for o in finding.could_also_be]
    ranked = sorted([*kept, *added], key=lambda o: -o.probability)
    return replace(finding, probability=finding.probability / total, could_also_be=tuple(ranked))


def _named_alone(told: Explanation) -> Fit:
    """Return the fit of the improved model, less the unnamed part it may have: that would blur what names explain."""
    if all(isinstance(effect, Effect) for effect in told.improved.chain.added):
        return told.improved
    return _fit(told, _without(told, None), told.train)


def _without(told: Explanation, named: Effect | None) -> Chain:
    """Return the chain of the improved model less one effect, and less what has no name."""
    chain = told.plain.chain
    for effect in told.improved.chain.added:
        if isinstance(effect, Effect) and effect != named:
            chain = effect.put_in(chain, {})
    values = told.improved.chain.values
    return chain.with_values({k: v for k, v in values.items() if k.partition("[")[0] in chain.values})


def _fit(told: Explanation, chain: Chain, observations: Sequence[Observation]) -> Fit:
    """Fit a chain, the plain values held as weakly as in the explanation's own fits."""
    centre = {c.name: c.centre for c in told.plain.coordinates}
    return fit(chain, observations, centre, told.model.fixed, ITERATIONS, valleys=False)


def _fitted(told: Explanation, base: Fit, other: Alternative) -> Fit | None:
    """Return the fit of the best form of an alternative; None where the catalogue or these data know none."""
    kind = catalogue().get(other.id)
    variants = [e for e in kind.variants() if e.place.label == other.stage] if kind else []
    evidence = Evidence(base, told.train)
    usable = [e for e in variants if e.applicable(base.chain)]
    tried = [found for effect in usable for found in _from_starts(told, evidence, effect)]
    count = sum(o.count for o in told.train)
    return min(tried, key=lambda f: f.cost + len(f.coordinates) * log(count), default=None)


def _from_starts(told: Explanation, evidence: Evidence, effect: Effect) -> Sequence[Fit]:
    """Return the fit from the start of an effect that promises most; none where it has no start."""
    starts = evidence_starts(evidence, effect)
    if not starts:
        return ()
    best = max(starts, key=lambda values: evidence.gain(effect, values))
    chain = scanned(effect.put_in(evidence.chain, best), told.train)
    return (_fit(told, effect.upright(chain), told.train),)


def _on_one_grid(
    told: Explanation, fits: Sequence[Fit | None]
) -> tuple[tuple[Observation, ...], list[tuple[Fit | None, float]]]:
    """Return grids fine enough for all fits, and every fit on them with its chi-squared."""
    observations = told.train
    for found in fits:
        if found is not None:
            observations = tuple(refined(o, found.chain) for o in observations)
    finer = any(a is not b for a, b in zip(observations, told.train, strict=True))
    again = [_fit(told, f.chain, observations) if f is not None and finer else f for f in fits]
    return observations, [(f, sum(chi_squared(f.chain, o) for o in observations) if f else float("inf")) for f in again]
