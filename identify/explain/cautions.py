"""What must the reader know beside the answer?"""

from collections.abc import Iterator, Sequence
from math import inf

from identify.delay import device_doubt_s
from identify.effects.effect import Effect
from identify.explain.bench import Bench
from identify.explain.confirm import CONVINCING, adapted, would_tell
from identify.explain.hypothesis import Hypothesis
from identify.explain.misread import told_misread
from identify.explain.out_of_step import told_early
from identify.explain.phrases import listed
from identify.explain.rivals import ordinary
from identify.held import told_held
from identify.holdout import Split
from identify.model import Model
from identify.natural_units import shown

MANY = 3  # laws together: of all sealed trials only one law of no catalogue was told as so many


def cautions(
    model: Model, bench: Bench, plain: Hypothesis, better: Hypothesis, dropped: Sequence[Effect], data: Split,
    verdict: str,
) -> Iterator[str]:  # fmt: skip
    """Yield what weakens an answer, a sentence each: ``dropped`` are effects that held-out data did not confirm.

    Where not all is explained the readings may be out of step, or misread.
    """
    for effect in dropped:
        yield (f"{effect.id} at {effect.place.label} fits the training runs but is not confirmed by the held-out data: "
               "it is not reported; hold out runs that reach it")  # fmt: skip
    for effect in better.effects:
        if _untold(bench, better, effect, data):
            yield (f"{effect.id} at {effect.place.label} is told by the training runs alone: what is held out hardly "
                   "shows it")  # fmt: skip
    for effect in better.effects:
        if ordinary(bench, better, effect):
            yield (f"{effect.id} at {effect.place.label} has values with which much that is in no catalogue does the "
                   "same: it may be that as well")  # fmt: skip
    if len(better.effects) >= MANY:
        named = listed([e.id for e in better.effects])
        yield (f"{len(better.effects)} laws are named together, {named}: one that is in no catalogue may look like all "
               "of them; change one of them on the rig and see that the others stay")  # fmt: skip
    yield from _within_doubt(better, data)
    if not plain.fit.converged:
        yield f"the plain fit did not converge: {plain.fit.sentence}"
    if not better.fit.converged:
        yield f"the improved fit did not converge: {better.fit.sentence}"
    if verdict in ("unexplained", "partly_explained"):
        yield from told_early(bench, plain) or told_misread(model, plain)
    yield from told_held([o.trace for o in (*data.train, *data.test)], model, data.noise.rms_v)


def _within_doubt(better: Hypothesis, data: Split) -> Iterator[str]:
    """Yield that a dead time is no larger than what is not sure of the device's own delay, where that is so."""
    doubt_s = device_doubt_s([o.trace for o in data.train])
    found_s = better.fit.chain.values.get("dead_time.delay", inf)
    if found_s <= doubt_s:
        yield (f"the dead time of {shown(found_s, 's')} may be the device's: its own delay is known to "
               f"± {shown(doubt_s, 's', 2)} only")  # fmt: skip


def _untold(bench: Bench, better: Hypothesis, effect: Effect, data: Split) -> bool:
    """Return whether the held-out data could not tell an effect from none."""
    with_it, without = adapted(better.fit.chain, data.test), adapted(bench.without(better, effect).fit.chain, data.test)
    return would_tell(with_it, without, data.test) <= CONVINCING
