"""Which of many corrections of free form leaves least, once all values may follow?

Where a mismatch is large the plain values stand in for it, and first order does not lead back from there: how much a
correction promises says little of what it explains. Many are fitted a few iterations, and the better half each time
further; where a mismatch is slow, to means of a few samples, on which a fit takes a fraction of the time.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from identify.chain import Chain
from identify.explain.bench import Bench
from identify.explain.hypothesis import Hypothesis
from identify.explain.suspect import Suspect, is_fine
from identify.fit import total_chi_squared
from identify.phases import turned_sines

ITERATIONS = 8  # a correction is nearly linear in its weights
SHOWN = 0.8  # of the square of what a quick correction changes, that means must keep; they may also make it larger
STRIDE, LAST = 3, 3  # iterations of a lap of the race, corrections that come to its end


@dataclass(frozen=True)
class _Track:
    """Data on which corrections race, and the hypothesis on top of which they are."""

    bench: Bench
    base: Hypothesis


@dataclass(frozen=True)
class _Runner:
    """A correction in the race, fitted so far."""

    suspect: Suspect
    track: _Track
    fitted: Hypothesis

    @property
    def left(self) -> float:
        """Return by how much less than the hypothesis it is on top of it leaves, below zero: on all data alike."""
        return self.fitted.chi2 - self.track.base.chi2

    def further(self) -> "_Runner":
        """Return it a lap on."""
        fitted = self.track.bench.fitted(self.fitted.fit.chain, self.track.base.effects, STRIDE, told=False)
        return replace(self, fitted=fitted)

    def ended(self, whole: _Track) -> "_Runner":
        """Return it a lap on, on all samples, with how sure its values are."""
        fitted = whole.bench.fitted(self.fitted.fit.chain, whole.base.effects, STRIDE)
        return _Runner(self.suspect, whole, fitted)


def raced(
    bench: Bench, base: Hypothesis, others: Sequence[Suspect], enough: float | None = None
) -> list[tuple[Suspect, Hypothesis]]:
    """Fit corrections side by side, a few iterations at a time, the better half each time further; return the last.

    As soon as one leaves no more than ``enough``, a misfit, all are as far as they are: that of noise, unless given.
    """
    whole, most = _Track(bench, base), (base.noise_known if enough is None else enough) * base.count
    running = list(_begun(whole, others))
    while len(running) > LAST and min(runner.fitted.chi2 - runner.fitted.count for runner in running) > most:
        ahead = sorted(running, key=lambda runner: runner.left)[: max(len(running) // 2, LAST)]
        running = [runner.further() for runner in ahead]
    last = sorted(running, key=lambda runner: runner.left)[:LAST]
    ended = sorted((runner.ended(whole) for runner in last), key=lambda runner: runner.left)
    return [(runner.suspect, runner.fitted) for runner in ended]


def _begun(whole: _Track, others: Sequence[Suspect]) -> Iterator[_Runner]:
    """Yield the first lap of every correction, on means of samples where these show what it does."""
    fewer = _fewer(whole)
    for s in others:
        track = fewer if fewer is not None and _is_shown(whole, s) else whole
        yield _Runner(s, track, fitted_from(track.bench, track.base, s, STRIDE, told=False))


def _fewer(whole: _Track) -> _Track | None:
    """Return the means of samples that tell as much of a mismatch; None where no fewer do."""
    evidence = whole.bench.evidence(whole.base)
    if evidence.fine is evidence:
        return None
    bench = whole.bench.on(evidence.observations)
    return _Track(bench, bench.fitted(whole.base.fit.chain, whole.base.effects, 0))


def _is_shown(whole: _Track, found: Suspect) -> bool:
    """Return whether means of samples keep what a correction changes where it is promised to be."""
    if not found.correction.quick:
        return True
    evidence = whole.bench.evidence(whole.base)
    chain = found.correction.put_in(evidence.chain, found.values)
    before, after = (float(change @ change) for change in (evidence.fine.change(chain), evidence.change(chain)))
    return SHOWN * before < after < before / SHOWN


def fitted_from(
    bench: Bench, base: Hypothesis, found: Suspect, iterations: int = ITERATIONS, told: bool = True
) -> Hypothesis:
    """Fit a correction on top of a hypothesis, from what solves the linear problem where that helps."""
    still = found.correction.put_in(base.fit.chain)
    solved = still.with_values(found.values)
    if is_fine(found.correction):
        return as_it_is(bench, base, solved)
    helps = total_chi_squared(solved, bench.observations) < base.chi2
    fitted = bench.fitted(solved if helps else still, base.effects, iterations, told)
    if not found.correction.searched:
        return fitted
    turned = turned_sines(fitted.fit.chain, bench.observations, [p.name for p in found.correction.parameters()])
    return fitted if turned is fitted.fit.chain else min(
        (fitted, bench.fitted(turned, base.effects, iterations, told)), key=lambda h: h.chi2
    )  # fmt: skip


def as_it_is(bench: Bench, base: Hypothesis, chain: Chain) -> Hypothesis:
    """Return a table as fine as the data on top of a hypothesis: it holds the answer already."""
    return replace(base, fit=replace(base.fit, chain=chain), chi2=total_chi_squared(chain, bench.observations))
