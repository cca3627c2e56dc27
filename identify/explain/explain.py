"""Why do simulation and recording differ? Fit, locate, select, earn the names, confirm: the whole way in order."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import sqrt

from threadpoolctl import threadpool_limits

from identify.chain import Chain
from identify.effects.effect import Effect
from identify.excerpts.excerpts import excerpts_of
from identify.explain.answer import Answer
from identify.explain.bench import Bench
from identify.explain.beside import (
    comes_back,
    foretelling,
    foretells_all,
    selected_beside,
    selected_either,
    wanders,
)
from identify.explain.carried import alike_weighed, scatters_so
from identify.explain.confirm import CERTAIN_FALL, CONVINCING, adapted, improvement, unconfirmed, would_tell
from identify.explain.everywhere import everywhere
from identify.explain.explanation import Explanation
from identify.explain.hidden import (
    counts_another,
    hides_blemishes,
    hides_noise,
    loses,
    loses_roughly,
    lost_no_more,
    suspected,
)
from identify.explain.hypothesis import Hypothesis
from identify.explain.left_open import told_by_all
from identify.explain.locate import located
from identify.explain.neighbours import resettled, settled
from identify.explain.plain import prepared
from identify.explain.readings import Look, Readings, as_recorded, held_against, read, reread, stepped_anew
from identify.explain.scattered import scattered
from identify.explain.select import Selected, selected
from identify.explain.survey import surveyed
from identify.explain.suspect import is_fine
from identify.explain.warrant import Warranted, warranted
from identify.holdout import Split
from identify.model import Model
from identify.observe import Observation, refined
from identify.readings.missing_samples import MissingSamples
from identify.starts.orders import valued
from identify.starts.start import stabilised
from identify.trace import Trace

Note = Callable[[str, float], None]


def explain(
    model: Model,
    traces: Sequence[Trace],
    hold_out: Sequence[Trace] = (),
    progress: Note | None = None,
    leave_out: Sequence[str] = (),
) -> Explanation:
    """Return where simulation and recordings differ, what physics was left out, the better model, and the proof.

    ``leave_out`` lists ids of the catalogue that are not tried. Of recordings too long to be explained whole, excerpts
    are, and all of them are held against what these tell. Raises ValueError with one sentence when the recordings
    cannot be used.
    """
    model, _ = stabilised(valued(model, [*traces, *hold_out]))
    with threadpool_limits(1, "blas"):  # the matrices are small: threads only wait for each other
        excerpts = excerpts_of(model, traces, hold_out)
        if excerpts is None:
            return _explained(model, traces, hold_out, progress or _silent, Look(tuple(leave_out)))
        told = _explained(model, excerpts.training, excerpts.proof, progress or _silent, Look(tuple(leave_out)))
        return everywhere(told, model, excerpts)


def _explained(
    model: Model, traces: Sequence[Trace], hold_out: Sequence[Trace], note: Note, look: Look
) -> Explanation:
    """Go the whole way with a model that can be fitted; what is found at its end may have it gone once more."""
    note("fitting the plain model", 0.02)
    readings = read(model, traces, hold_out, lambda data: prepared(model, data, look.leave_out), look)
    held = _beside_losses(model, traces, hold_out, note, replace(look, held=True)) if readings.doubtful else None
    if held is not None:
        return held
    note("locating the mismatch", 0.1)
    seen = surveyed(readings.bench, readings.plain)
    found = _found(readings, note, look)
    if isinstance(found, Look):
        return _explained(model, traces, hold_out, note, found)
    readings, bench, final, rounds = stepped_anew(readings, *found)
    note("checking the names against free-form corrections", 0.75)
    plain = bench.again(rounds[0].base if rounds else readings.plain)
    earned = warranted(bench, plain, final, rounds)
    if no_chance := _no_chance(final, earned):
        return _explained(model, traces, hold_out, note, replace(look, leave_out=(*look.leave_out, *no_chance)))
    note("confirming on held-out data", 0.9)
    data = _to_prove(bench, final, earned, readings.data)
    kept, dropped = confirmed(bench, earned, data.test)
    reading, again = _looked_again(readings, bench, kept, data, look)
    other = _explained(model, traces, hold_out, note, again) if again is not None else None
    if other is not None and _sees_more(other, again, kept):
        return other
    note("done", 1.0)
    told = Answer(model, data, bench, plain, kept, rounds, dropped, reading, seen).explanation()
    return told if other is None or _is_rough(again) or told.verdict == "explained" else other  # it must not see less


def _to_prove(bench: Bench, final: Hypothesis, earned: Warranted, data: Split) -> Split:
    """Return the data with what is held out weighed as the rest is, on grids fine enough for what is to be proven."""
    test = alike_weighed(bench, final.fit.chain, data.test)
    return replace(data, test=tuple(refined(o, earned.hypothesis.fit.chain) for o in test))


def _no_chance(final: Hypothesis, earned: Warranted) -> tuple[str, ...]:
    """Return the ids of what acts by chance that did not earn its name where something else is left to be explained.

    A law may make all of it, which nobody looked for beside that chance.
    """
    if not earned.beyond.significant:
        return ()
    return tuple(effect.id for effect in final.effects if effect.by_chance and effect not in earned.hypothesis.effects)


def _found(readings: Readings, note: Note, look: Look) -> Selected | Look:
    """Select what is missing; or return how readings are to be looked at first.

    Against the chain where what that leaves is coloured noise, or blemishes; without losses where it has none.
    """
    bench, plain = readings.bench, readings.plain
    if comes_back(bench, plain) or foretells_all(bench, plain) or scattered(bench, plain):
        bench = foretelling(bench)
    at_once = wanders(bench, plain)
    beside = selected_beside(bench, plain, note) if at_once else None
    noisy = suspected(readings, look.leave_out) if look.against is None and beside is None else 0.0
    if noisy and selected(bench, plain, note, 1)[1].advantage(plain) < noisy:
        return replace(look, against=told_by_all(bench, plain, readings.data.test))
    bench, final, rounds = beside or selected_either(bench, plain, note, not at_once)
    final = resettled(bench, final)
    if look.against is not None or bench.carried:
        return bench, final, rounds
    hidden = any(hides(readings, bench, final, look.leave_out) for hides in (hides_noise, hides_blemishes))
    if hidden:
        return replace(look, against=told_by_all(bench, final, readings.data.test))
    if lost_no_more(readings, final, look.leave_out):
        return replace(look, leave_out=(*look.leave_out, MissingSamples.id))
    return bench, final, rounds


def _beside_losses(
    model: Model, traces: Sequence[Trace], hold_out: Sequence[Trace], note: Note, held: Look
) -> Explanation | None:
    """Explain recordings whose lost readings only a rough look tells, beside the largest physics that is there too.

    None where a close look beside that physics finds no loss, or where not all is explained: it was a guess.
    """
    readings = read(model, traces, hold_out, lambda data: prepared(model, data, held.leave_out), held)
    _, largest, _ = selected(readings.bench, readings.plain, note, 1)
    chain = largest.fit.chain
    if not loses(readings, chain, held.leave_out):
        return None
    told = _explained(model, traces, hold_out, note, replace(held, against=chain, held=False))
    return told if told.verdict == "explained" else None


def _looked_again(
    readings: Readings, bench: Bench, kept: Warranted, data: Split, look: Look
) -> tuple[Readings, Look | None]:
    """Return the readings as they are against the chain that explains the rest, and how to look at all of it once more.

    None where these are the readings that were explained.
    """
    effects = kept.hypothesis.effects
    improved = adapted(_best_told(readings, bench, kept, data, look), data.test)
    reading = reread(readings, improved, effects, look.leave_out, not kept.beyond.significant)
    own = {blemish for effect in effects for blemish in effect.brings}
    before, after = {b.id for b in readings.found} - own, {b.id for b in reading.found} - {"adc_quantisation"}
    if before - after:  # what only the plain model showed in the readings is none of theirs: it is not looked for
        return reading, replace(look, leave_out=(*look.leave_out, *(before - after)))
    left = kept.beyond.significant or kept.hypothesis.swell > 1.0
    if after - before and left:  # what is unexplained, or made by chance, looks like blemishes, too
        reading = replace(reading, found=tuple(b for b in reading.found if b.id not in after - before))
    elif look.against is None and (after - before or counts_another(readings, reading)):
        return reading, replace(look, against=improved)  # what the mismatch had hidden or shown wrongly
    if look.against is None and effects and left and loses_roughly(reading, improved, look.leave_out):
        return reading, replace(look, against=improved, rough=True)
    return reading, None


def _sees_more(other: Explanation, again: Look | None, kept: Warranted) -> bool:
    """Return whether a second look explains what the first one did, and where it was a rough one, all that was left."""
    if _is_rough(again):
        return other.verdict == "explained" and other.remaining.stage is None
    return other.verdict == "explained" or not kept.hypothesis.effects


def _is_rough(look: Look | None) -> bool:
    """Return whether there is a look, and a rough one."""
    return look is not None and look.rough


def _best_told(readings: Readings, bench: Bench, kept: Warranted, data: Split, look: Look) -> Chain:
    """Return the chain that tells most of what was played: with what is unnamed, too, or blemishes would be seen in it.

    What goes with the clock is left where it is: noise goes with that, too, and would be part of it.
    """
    beyond = kept.beyond
    if not beyond.significant or beyond.best.axis == "clock time" or is_fine(beyond.best):
        return held_against(bench, kept.hypothesis, data, as_recorded(readings), look.leave_out)
    return beyond.fitted[0][1].fit.chain


def _silent(sentence: str, share: float) -> None:
    """Show nothing."""


def confirmed(
    bench: Bench, earned: Warranted, test: Sequence[Observation]
) -> tuple[Warranted, tuple[Effect, ...]]:
    """Drop effects that do not make held-out data fit better, where these could tell; return the rest and those.

    What effects do by chance is noise to that, and held-out data that scatter so side with them; what is found beside
    chance, which may look like anything once, has to be seen there again where chance could have made it. Once one is
    dropped the others are asked without it. The values of the rest are settled.
    """
    hypothesis, dropped = earned.hypothesis, list[Effect]()
    while against := next((e for e in hypothesis.effects if _speaks_against(bench, hypothesis, e, test)), None):
        hypothesis = bench.without(hypothesis, against)
        dropped.append(against)
    beyond = located(bench, hypothesis) if dropped else earned.beyond
    best, elsewhere = settled(bench, hypothesis)
    return Warranted(best, beyond, elsewhere), tuple(dropped)


def _speaks_against(bench: Bench, hypothesis: Hypothesis, effect: Effect, test: Sequence[Observation]) -> bool:
    """Return whether held-out data that could tell an effect of a hypothesis do not side with it."""
    without = bench.without(hypothesis, effect)
    better, worse = adapted(hypothesis.fit.chain, test), adapted(without.fit.chain, test)
    told = would_tell(better, worse, test) / sqrt(hypothesis.swell)
    side, fallen = improvement(better, worse, test), hypothesis.fall(without)
    may_be_chance = hypothesis.swell > 1.0 and not effect.by_chance and fallen < CERTAIN_FALL
    unseen = may_be_chance and side < CONVINCING * sqrt(hypothesis.swell)
    against = unseen or unconfirmed(side, told, fallen)
    return against and not scatters_so(bench, effect, better, test)
