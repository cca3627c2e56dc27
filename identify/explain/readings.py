"""What is wrong with the readings, before any physics of the chain is looked for?

Blemishes of the readings are found against the fitted plain model and undone; the model is fitted again without them,
and the recordings are looked at once more against that: what only a model led astray had shown is then gone.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

from identify.chain import Chain
from identify.effects.adc_quantisation import LSB
from identify.effects.effect import Effect
from identify.explain.bench import Bench
from identify.explain.confirm import UNFINISHED, adapted
from identify.explain.evened import Prepared, as_stepped, evened, stepped, weighed
from identify.explain.hypothesis import Hypothesis
from identify.explain.knowing import knows_f
from identify.explain.left_open import leaves_more, together
from identify.explain.round import Round
from identify.holdout import Split, settling_s, split
from identify.model import Model
from identify.noise import good
from identify.observe import pooled_rms
from identify.readings.blemish import Blemish
from identify.readings.coloured_noise import ColouredNoise, coloured_noise
from identify.readings.grid import adc_steps
from identify.readings.mend import Mended, answer, mended
from identify.readings.missing_samples import MissingSamples
from identify.readings.noise_left import noise_left
from identify.readings.received import received
from identify.trace import Trace

ALL_OF_IT = 2.0  # times the energy of a noise as large as it may be, that is left at most where it is all that is left
DOUBTED = 0.9  # share of the misfit that may be left where a loss that only a rough look shows is worth a second try
LOOKS = 8  # at most: each look mends more of a loss that had moved the plain model
WORTH = 0.5  # share of the plain model's misfit that may be left for its blemishes to count before it is explained


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
    stepped: bool = False  # whether it counts where they stand in the steps of the ADC
    doubtful: tuple[Blemish, ...] = ()  # losses of readings of which only a rough look told

    @property
    def excess_v2(self) -> float:
        """Return the variance that the plain model leaves beyond the noise, V^2, 0 where that may be noise.

        Blemishes change what is taken for noise, too.
        """
        return self.plain.misfit * self.data.noise.rms_v**2 if self.plain.proven else 0.0


@dataclass(frozen=True)
class Look:
    """How recordings are looked at: without ids that are ``leave_out``, ``against`` a chain (None: the plain one).

    Losses of which only a rough look tells are ``held`` until the largest physics beside them is known. Against a chain
    that has all other physics such a ``rough`` look is enough.
    """

    leave_out: tuple[str, ...] = ()
    against: Chain | None = None
    held: bool = False
    rough: bool = False


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
    recorded, alone = received(traces, hold_out, raw.noise.rms_v, look.leave_out)
    chain = look.against or held_against(bench, before, raw, recorded, look.leave_out)

    def undone(seen: Mended) -> Readings:
        data = split(model, seen.training, seen.proof) if seen.found or alone else raw
        data, noise = _whitened(data, seen, settling_s(model), look, chain)
        mine, plain = (bench, before) if data is raw else prepared(data)
        data, mine, plain, steps = as_stepped(data, mine, plain, prepared, look.against)
        told = {blemish.id for blemish in alone}  # what the readings alone tell is not fitted once more
        ready, found = mine.of_kinds(k for k in mine.kinds if k.id not in told), (*alone, *seen.found, *noise)
        return Readings(*recorded.runs, raw, before, data, ready, plain, found, settling_s(model), steps)

    if look.against is not None:
        return undone(mended(chain, *recorded.runs, raw.noise.rms_v, look.leave_out, look.rough))
    fitted = partial(_fitted, model, prepared, recorded, look.leave_out)
    close, rough = _looked(chain, recorded, raw.noise.rms_v, look.leave_out, fitted)
    found = undone(close)
    if close.found:
        return undone(recorded) if _waits(found) else found
    if not lost(rough.found) or coloured(found.found):
        return found  # noise that hangs together looks like a loss to a rough look
    roughly = undone(rough)
    if look.held or roughly.plain.misfit < 2.0 * bench.noise_known:
        return roughly
    return replace(found, doubtful=lost(rough.found)) if roughly.plain.misfit < DOUBTED * before.misfit else found


def _waits(found: Readings) -> bool:
    """Return whether much of what is left beyond the noise without blemishes, which repeats may have, is physics."""
    all_v2 = (1.0 + found.before.misfit) * found.raw.noise.rms_v**2 - found.data.noise.rms_v**2
    return found.excess_v2 > WORTH * all_v2


def _fitted(model: Model, prepared: Prepared, recorded: Mended, leave_out: Sequence[str], seen: Mended) -> Chain:
    """Return the plain chain fitted to recordings whose blemishes are undone; they may end where readings were lost."""
    data = split(model, seen.training, seen.proof, beginnings=True)
    return held_against(*prepared(data), data, recorded, leave_out)


def held_against(
    bench: Bench, found: Hypothesis, data: Split, recorded: Mended, leave_out: Sequence[str]
) -> Chain:
    """Return the chain of a hypothesis that recordings are held against: with the values that all runs tell.

    With those of the fitted runs where held-out ones leave no more, or nothing but blemishes.
    """
    chain, noise_v = adapted(found.fit.chain, data.test), data.noise.rms_v
    if not leaves_more(bench, found, data.test):
        return found.fit.chain
    seen = mended(chain, *recorded.runs, noise_v, leave_out)
    left_v = pooled_rms([trace.y[:][good(trace)] for trace in less(chain, seen, noise_v)[1]])
    all_of_it = bool(seen.found) and left_v < UNFINISHED * noise_v
    return chain if all_of_it else together(bench, found, data.test).fit.chain


def _looked(
    chain: Chain, recorded: Mended, noise_v: float, leave_out: Sequence[str], fitted: Callable[[Mended], Chain]
) -> tuple[Mended, Mended]:
    """Return what close looks show beside a chain ``fitted`` again without what rough ones show, and what those do."""
    runs = recorded.runs
    rough = mended(chain, *runs, noise_v, leave_out, rough=True)
    seen = replace(recorded, noise=rough.noise)
    for _ in range(LOOKS):
        if not rough.found or seen.found:
            break
        chain, last = fitted(rough.in_time()), rough
        seen = mended(chain, *runs, noise_v, leave_out)
        rough = mended(chain, *runs, noise_v, leave_out, rough=True)
        if [blemish.undone for blemish in rough.found] == [blemish.undone for blemish in last.found]:
            break
    return seen, rough


def _whitened(
    data: Split, seen: Mended, settle_s: float, look: Look, chain: Chain
) -> tuple[Split, tuple[Blemish, ...]]:
    """Return the data weighed as their noise is coloured or uneven, and what tells of that; as they are where neither.

    Beside a ``chain`` what knows where F stands is no noise of the reading.
    """
    noise = None
    if ColouredNoise.id not in look.leave_out:
        left = noise_left(*less(look.against, seen, data.noise.rms_v)) if look.against is not None else None
        noise = left or coloured_noise(seen.training, seen.proof, settle_s)  # repeats are few, what is left is all
    if noise is None or knows_f(chain, data.train):
        return (evened(data, seen.noise), (seen.noise.blemish,)) if seen.noise else (data, ())
    return weighed(data, noise.rms_v, noise.rms_v, noise.colour), (noise.blemish,)


def stepped_anew(
    readings: Readings, bench: Bench, final: Hypothesis, rounds: list[Round]
) -> tuple[Readings, Bench, Hypothesis, list[Round]]:
    """Return what was selected, with what noise leaves of coarse readings, where that was not known before."""
    known = abs(final.misfit) < bench.noise_known
    if not readings.stepped or known or LSB.name not in final.fit.chain.values:
        return readings, bench, final, rounds
    data, bench, final = stepped(readings.data, bench, final)
    return replace(readings, data=data), bench, final, rounds


def reread(
    readings: Readings, chain: Chain, explained: Sequence[Effect], leave_out: Sequence[str], settled: bool
) -> Readings:
    """Return the readings with the blemishes that are there against the chain that explains the rest, measured on it.

    The steps of the ADC are told here, where no effect tells of them; what an effect brings along is not told again.
    Where all is ``settled``, nothing left beyond the noise, a rough look is enough for a loss of readings.
    """
    own = {blemish for effect in explained for blemish in effect.brings}
    noise = tuple(b for b in coloured(readings.found) if b.id not in own)
    if noise and not (_noisy(readings, chain) and _accounts(readings, chain, noise[0])):
        noise = ()  # it was physics that does not come back with the stimulus, explained by now or not
    recorded = (chain, readings.traces, readings.hold_out, readings.data.noise.rms_v, leave_out)
    seen = mended(*recorded)
    found = (*seen.found, *([seen.noise.blemish] if seen.noise else []))
    if settled and lost(readings.found) and not lost(found) and not noise:
        found = (*found, *lost(mended(*recorded, rough=True).found))
    found = (*(b for b in readings.found if b.alone), *found, *noise)
    if "adc_quantisation" not in (*(effect.id for effect in explained), *leave_out):
        found = (*found, *adc_steps([*readings.traces, *readings.hold_out], readings.data.noise.rms_v))
    return replace(readings, found=found)


def lost(found: Sequence[Blemish]) -> tuple[Blemish, ...]:
    """Return the losses of readings among blemishes."""
    return tuple(blemish for blemish in found if blemish.id == MissingSamples.id)


def coloured(found: Sequence[Blemish]) -> tuple[Blemish, ...]:
    """Return the coloured noise among blemishes."""
    return tuple(blemish for blemish in found if blemish.id == ColouredNoise.id)


def _noisy(readings: Readings, chain: Chain) -> bool:
    """Return whether the noise is coloured in what a chain leaves of the recordings, too."""
    train, test = less(chain, as_recorded(readings), readings.data.noise.rms_v)
    return coloured_noise(train, test, readings.settle_s) is not None or noise_left(train, test) is not None


def _accounts(readings: Readings, chain: Chain, noise: Blemish) -> bool:
    """Return whether a noise is as large as all that a chain leaves of the recordings, as far as chance allows.

    Physics that goes on from repeat to repeat leaves a little of itself in their differences, and more in the whole.
    """
    sd, rms_v = noise.values["sd"], readings.data.noise.rms_v
    left = [trace.y[:][good(trace)] for part in less(chain, as_recorded(readings), rms_v) for trace in part]
    return pooled_rms(left) ** 2 < ALL_OF_IT * (rms_v**2 - sd.value**2 + sd.high**2)


def as_recorded(readings: Readings) -> Mended:
    """Return the recordings as nothing has mended them."""
    return Mended(readings.traces, readings.hold_out, ())


def less(chain: Chain, seen: Mended, noise_v: float) -> tuple[list[Trace], list[Trace]]:
    """Return recordings less what a chain answers."""
    parts = seen.training, seen.proof
    train, test = ([replace(t, y=t.y[:] - answer(chain, t, noise_v)) for t in traces] for traces in parts)
    return train, test
