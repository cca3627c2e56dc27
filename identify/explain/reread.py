"""What is wrong with the readings once the rest is explained, and is what is left noise of theirs?"""

from collections.abc import Sequence
from dataclasses import replace
from math import log

from identify.chain import Chain
from identify.effects.effect import Effect
from identify.explain.bench import Bench
from identify.explain.carried import price
from identify.explain.hypothesis import Hypothesis
from identify.explain.readings import Readings, in_noise, less, losses, noises
from identify.explain.wander import MOSTLY, unrepeated
from identify.fit import chi_squared
from identify.noise import good
from identify.observe import pooled_rms
from identify.readings.blemish import Blemish
from identify.readings.coloured_noise import ColouredNoise, against_repeats, coloured_noise, in_repeats
from identify.readings.grid import adc_steps
from identify.readings.mend import Mended, mended
from identify.readings.noise_left import noise_left
from identify.readings.range_end import RangeEnd
from identify.readings.spectra import Spectrum, spectra
from identify.trace import Trace

ALL_OF_IT = 2.0  # times the energy of a noise as large as it may be, that is left at most where it is all that is left


def suspected(readings: Readings, leave_out: Sequence[str]) -> float:
    """Return what speaks for coloured noise in what the plain model leaves, twice a log-likelihood.

    Zero where the repeats rule that out, or where they told of it already. What they cannot tell is for physics to
    explain better: noise has no answer to the stimulus.
    """
    if ColouredNoise.id in leave_out or noises(readings.found):
        return 0.0
    noise = noise_left(*_left(readings, readings.plain.fit.chain))
    if noise is None or against_repeats(noise, _repeats(readings)):
        return 0.0
    return noise.told


def hides_noise(readings: Readings, bench: Bench, hypothesis: Hypothesis, leave_out: Sequence[str]) -> bool:
    """Return whether what a hypothesis leaves is coloured noise that repeats alone did not tell, or told wrongly."""
    if ColouredNoise.id in leave_out:
        return False
    noise = noise_left(*_left(readings, hypothesis.fit.chain))
    if noise is None or any(noise.blemish.weighs_as(b) for b in noises(readings.found)):
        return False
    if in_repeats(noise, _repeats(readings)):
        return True
    return unrepeated(hypothesis.fit.chain, bench.observations) > MOSTLY


def rather_noise(readings: Readings, beside: Bench, final: Hypothesis, leave_out: Sequence[str]) -> Chain | None:
    """Return the chain that leaves coloured noise, where that is likelier than the noise in front of the gap found.

    A level that wanders is nearly one that the gap lets wander. None where it is not, or where the readings say so.
    """
    rest = tuple(effect for effect in final.effects if not effect.by_chance)
    without = readings.bench.fitted(readings.bench.with_effects(rest, final.fit.chain.values), rest)
    noise = noise_left(*_left(readings, without.fit.chain))
    if noise is None or ColouredNoise.id in leave_out or against_repeats(noise, _repeats(readings)):
        return None
    seen = in_noise(readings.bench.observations, noise)
    told = replace(without, chi2=sum(chi_squared(without.fit.chain, o) for o in seen))
    numbers = len(noise.values) * log(told.count)
    likelier = price(replace(readings.bench, observations=seen), told) + numbers < price(beside, final)
    return without.fit.chain if likelier else None


def reread(
    readings: Readings, chain: Chain, explained: Sequence[Effect], leave_out: Sequence[str], settled: bool
) -> Readings:
    """Return the readings with the blemishes that are there against the chain that explains the rest, measured on it.

    The steps of the ADC are told here, where no effect tells of them; what an effect brings along is not told again.
    Where all is ``settled``, nothing left beyond the noise, a rough look is enough for a loss of readings.
    """
    own = {blemish for effect in explained for blemish in effect.brings}
    noise = tuple(b for b in noises(readings.found) if b.id not in own)
    if noise and not (_noisy(readings, chain) and _accounts(readings, chain, noise[0])):
        noise = ()  # it was physics that does not come back with the stimulus, explained by now or not
    recorded = (chain, readings.traces, readings.hold_out, readings.data.noise.rms_v, leave_out)
    found = mended(*recorded).found
    if settled and losses(readings.found) and not losses(found) and not noise:
        found = (*found, *losses(mended(*recorded, rough=True).found))
    found = (*(b for b in readings.found if b.id == RangeEnd.id), *found, *noise)
    if "adc_quantisation" not in (*(effect.id for effect in explained), *leave_out):
        found = (*found, *adc_steps([*readings.traces, *readings.hold_out], readings.data.noise.rms_v))
    return replace(readings, found=found)


def loses(readings: Readings, chain: Chain, leave_out: Sequence[str]) -> bool:
    """Return whether a close look against a chain finds readings that are lost."""
    noise_v = readings.data.noise.rms_v
    return bool(losses(mended(chain, readings.traces, readings.hold_out, noise_v, leave_out).found))


def counts_another(before: Readings, after: Readings) -> bool:
    """Return whether as many readings as had been put back were not what was lost."""
    counts = [{b.where: b.values["count"].value for b in losses(readings.found)} for readings in (before, after)]
    return counts[0] != counts[1]


def _noisy(readings: Readings, chain: Chain) -> bool:
    """Return whether the noise is coloured in what a chain leaves of the recordings, too."""
    train, test = _left(readings, chain)
    return coloured_noise(train, test, readings.settle_s) is not None or noise_left(train, test) is not None


def _accounts(readings: Readings, chain: Chain, noise: Blemish) -> bool:
    """Return whether a noise is as large as all that a chain leaves of the recordings, as far as chance allows.

    Physics that goes on from repeat to repeat leaves a little of itself in their differences, and more in the whole.
    """
    sd, rms_v = noise.values["sd"], readings.data.noise.rms_v
    left = [trace.y[:][good(trace)] for part in _left(readings, chain) for trace in part]
    return pooled_rms(left) ** 2 < ALL_OF_IT * (rms_v**2 - sd.value**2 + sd.high**2)


def _repeats(readings: Readings) -> list[Spectrum]:
    """Return the spectra of what differs between repeats."""
    return spectra(readings.traces, readings.settle_s)


def _left(readings: Readings, chain: Chain) -> tuple[list[Trace], list[Trace]]:
    """Return what a chain leaves of the recordings as nothing has mended them."""
    return less(chain, Mended(readings.traces, readings.hold_out, ()), readings.data.noise.rms_v)
