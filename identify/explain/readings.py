"""What is wrong with the readings, before any physics of the chain is looked for?

Blemishes of the readings are found against the fitted plain model and undone; the model is fitted again without them,
and the recordings are looked at once more against that: what only a model led astray had shown is then gone.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

from identify.chain import Chain
from identify.effects.effect import short
from identify.explain.bench import Bench
from identify.explain.explanation import Finding, Location, Range
from identify.explain.hypothesis import Hypothesis
from identify.explain.rivals import OTHERWISE
from identify.holdout import Split, settling_s, split
from identify.model import Model
from identify.natural_units import shown_interval
from identify.observe import Observation
from identify.readings.blemish import Blemish
from identify.readings.coloured_noise import Coloured, ColouredNoise, coloured_noise
from identify.readings.mend import Mended, answer, mended
from identify.readings.missing_samples import MissingSamples
from identify.readings.noise_left import noise_left
from identify.readings.range_end import RangeEnd, range_ends
from identify.stage import Place
from identify.trace import Trace

DOUBTED = 0.9  # share of the misfit that may be left where a loss that only a rough look shows is worth a second try
LOOKS = 8  # at most: each look mends more of a loss that had moved the plain model
WORTH = 0.5  # share of the plain model's misfit that may be left for its blemishes to count before it is explained
Prepared = Callable[[Split], tuple[Bench, Hypothesis]]


@dataclass(frozen=True)
class Readings:
    """The data as recorded and with their blemishes undone, the blemishes, and the plain model fitted to either."""

    traces: tuple[Trace, ...]
    hold_out: tuple[Trace, ...]
    raw: Split
    before: Hypothesis
    data: Split
    bench: Bench
    plain: Hypothesis
    found: tuple[Blemish, ...]
    settle_s: float
    doubtful: tuple[Blemish, ...] = ()  # losses of readings of which only a rough look told


@dataclass(frozen=True)
class Look:
    """How recordings are looked at: without ids that are ``leave_out``, ``against`` a chain (None: the plain one).

    Losses of which only a rough look tells are ``held`` until the largest physics beside them is known.
    """

    leave_out: tuple[str, ...] = ()
    against: Chain | None = None
    held: bool = False


def read(
    model: Model, traces: Sequence[Trace], hold_out: Sequence[Trace], prepared: Prepared, look: Look
) -> Readings:
    """Return the recordings as they are to be explained; ``prepared`` fits the plain model.

    A rough look, a fit without what it shows, a close look: until the close one confirms the rough one, or is all
    there is. What is seen while the plain model leaves much more than the readings' blemishes, and than noise may make,
    waits for a chain that explains the rest; given one, they are looked at against it alone. A loss of which only a
    rough look tells counts where nothing is left without it, or where it is to be held.
    """
    raw = split(model, traces, hold_out)
    bench, before = prepared(raw)
    recorded, ends = _within(traces, hold_out, raw.noise.rms_v, look.leave_out)

    def undone(seen: Mended) -> Readings:
        data = split(model, seen.training, seen.proof) if seen.found or ends else raw
        data, noise = _whitened(data, seen, settling_s(model), look)
        mine, plain = (bench, before) if data is raw else prepared(data)
        told = {blemish.id for blemish in ends}  # what the readings alone tell is not fitted once more
        again = replace(mine, kinds=tuple(kind for kind in mine.kinds if kind.id not in told)), plain
        found = (*ends, *seen.found, *noise)
        return Readings(recorded.training, recorded.proof, raw, before, data, *again, found, settling_s(model))

    if look.against is not None:
        return undone(mended(look.against, recorded.training, recorded.proof, raw.noise.rms_v, look.leave_out))
    fitted = partial(_fitted, model, prepared)
    close, rough = _looked(before.fit.chain, recorded, raw.noise.rms_v, look.leave_out, fitted)
    found = undone(close)
    if close.found:
        return undone(recorded) if found.plain.proven and found.plain.misfit > WORTH * before.misfit else found
    if not losses(rough.found) or noises(found.found):
        return found  # noise that hangs together looks like a loss to a rough look
    mended_roughly = undone(rough)
    left = mended_roughly.plain.misfit
    if look.held or left < 2.0 * bench.noise_known:
        return mended_roughly
    return replace(found, doubtful=losses(rough.found)) if left < DOUBTED * before.misfit else found


def _within(
    traces: Sequence[Trace], hold_out: Sequence[Trace], noise_v: float, leave_out: Sequence[str]
) -> tuple[Mended, tuple[RangeEnd, ...]]:
    """Return the recordings as far as the range of the ADC shows them, and its ends: readings alone tell of these."""
    if RangeEnd.id in leave_out:
        return Mended(tuple(traces), tuple(hold_out), ()), ()
    seen, ends = range_ends([*traces, *hold_out], noise_v)
    return Mended(seen[: len(traces)], seen[len(traces) :], ()), ends


def _fitted(model: Model, prepared: Prepared, seen: Mended) -> Chain:
    """Return the plain chain fitted to recordings whose blemishes are undone."""
    return prepared(split(model, seen.training, seen.proof))[1].fit.chain


def _looked(
    chain: Chain, recorded: Mended, noise_v: float, leave_out: Sequence[str], fitted: Callable[[Mended], Chain]
) -> tuple[Mended, Mended]:
    """Return what close looks show beside a chain ``fitted`` again without what rough ones show, and what those do."""
    runs, seen = (recorded.training, recorded.proof), recorded
    rough = mended(chain, *runs, noise_v, leave_out, rough=True)
    for _ in range(LOOKS):
        if not rough.found or seen.found:
            break
        chain, last = fitted(rough.in_time()), rough
        seen = mended(chain, *runs, noise_v, leave_out)
        rough = mended(chain, *runs, noise_v, leave_out, rough=True)
        if rough.found == last.found:
            break
    return seen, rough


def _whitened(
    data: Split, seen: Mended, settle_s: float, look: Look
) -> tuple[Split, tuple[ColouredNoise, ...]]:
    """Return the data weighed as their noise is coloured, and what tells of that; as they are where it is white."""
    noise = None
    if ColouredNoise.id not in look.leave_out:
        left = noise_left(*less(look.against, seen, data.noise.rms_v)) if look.against is not None else None
        noise = left or coloured_noise(seen.training, seen.proof, settle_s)  # repeats are few, what is left is all
    if noise is None:
        return data, ()
    train, test = (in_noise(part, noise) for part in (data.train, data.test))
    return replace(data, train=train, test=test, noise=replace(data.noise, rms_v=noise.rms_v)), (noise.blemish,)


def in_noise(observations: Sequence[Observation], noise: Coloured) -> tuple[Observation, ...]:
    """Return observations weighed as their noise is coloured."""
    return tuple(replace(o, noise_v=noise.rms_v, colour=noise.colour(o.trace)) for o in observations)


def losses(found: Sequence[Blemish]) -> tuple[Blemish, ...]:
    """Return the losses of readings among blemishes."""
    return tuple(blemish for blemish in found if blemish.id == MissingSamples.id)


def noises(found: Sequence[Blemish]) -> tuple[Blemish, ...]:
    """Return the coloured noise among blemishes."""
    return tuple(blemish for blemish in found if blemish.id == ColouredNoise.id)


def less(chain: Chain, seen: Mended, noise_v: float) -> tuple[list[Trace], list[Trace]]:
    """Return recordings less what a chain answers."""
    train, test = (
        [replace(trace, y=trace.y[:] - answer(chain, trace, noise_v)) for trace in traces]
        for traces in (seen.training, seen.proof)
    )
    return train, test


def finding(blemish: Blemish) -> Finding:
    """Return what is said of one blemish."""
    named = ((short(p.name), p.unit) for p in blemish.declared)
    parameters = {name: (blemish.values[name], unit) for name, unit in named if name in blemish.values}
    told = [f"{name} {shown_interval(interval, unit)}" for name, (interval, unit) in parameters.items()]
    words = ", ".join(told) + (f" ({blemish.where})" if blemish.where else "")
    others = blemish.confused_with
    return Finding(
        blemish.id, Place.SENSE.label, "", (1.0 - OTHERWISE) * (1.0 - blemish.p_value), parameters, blemish.equation,
        blemish.sentence.format(words), (), others[0].would_separate if others else None,
    )  # fmt: skip


def location(blemishes: Sequence[Blemish], data: Split) -> Location:
    """Return where blemishes are, when nothing else differs."""
    traces = [o.trace for o in data.train]
    end_s = max(trace.start_s + trace.size / trace.rate_hz for trace in traces)
    everywhere = Range("clock time", min(trace.start_s for trace in traces), end_s, "s", 1.0)
    ranges = tuple(_stretch(blemish) or everywhere for blemish in blemishes)
    what = " and ".join(blemish.title for blemish in blemishes)
    return Location(Place.SENSE.label, ranges, f"The mismatch is in the readings themselves: {what}.")


def _stretch(blemish: Blemish) -> Range | None:
    """Return the moment of a blemish that has one."""
    position = blemish.values.get("position")
    return Range("clock time", position.low, position.high, "s", 1.0) if position else None
