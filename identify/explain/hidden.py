"""What is wrong with the readings that physics had hidden, or that was none once physics is known?

What a hypothesis leaves of all recordings is looked at, with the values that all of them tell.
"""

from collections.abc import Sequence
from dataclasses import replace

from identify.chain import Chain
from identify.explain.bench import Bench
from identify.explain.hypothesis import Hypothesis
from identify.explain.knowing import knows_f
from identify.explain.left_open import told_by_all
from identify.explain.readings import Readings, as_recorded, coloured, held_against, less, lost
from identify.explain.wander import MOSTLY, unrepeated
from identify.noise import good
from identify.observe import pooled_rms
from identify.readings.coloured_noise import ColouredNoise, against_repeats, in_repeats
from identify.readings.mend import mended
from identify.readings.noise_left import noise_left
from identify.readings.spectra import spectra

TOLD = 0.1  # of what the plain model leaves beyond the noise, that a law may leave for losses to be asked for again


def suspected(readings: Readings, leave_out: Sequence[str]) -> float:
    """Return what speaks for coloured noise in what the plain model leaves, twice a log-likelihood.

    Zero where the repeats rule that out, or where they told of it already. What they cannot tell is for physics to
    explain better: noise has no answer to the stimulus.
    """
    if ColouredNoise.id in leave_out or coloured(readings.found):
        return 0.0
    chain = told_by_all(readings.bench, readings.plain, readings.data.test)
    noise = noise_left(*less(chain, as_recorded(readings), readings.data.noise.rms_v))
    if noise is None or against_repeats(noise, spectra(readings.traces, readings.settle_s)):
        return 0.0
    return 0.0 if knows_f(chain, readings.bench.observations) else noise.told


def hides_noise(readings: Readings, bench: Bench, hypothesis: Hypothesis, leave_out: Sequence[str]) -> bool:
    """Return whether what a hypothesis leaves is coloured noise that repeats alone did not tell, or told wrongly."""
    if ColouredNoise.id in leave_out:
        return False
    chain = told_by_all(bench, hypothesis, readings.data.test)
    noise = noise_left(*less(chain, as_recorded(readings), readings.data.noise.rms_v))
    if noise is None or any(noise.blemish.weighs_as(b) for b in coloured(readings.found)):
        return False
    if knows_f(chain, bench.observations):
        return False
    if in_repeats(noise, spectra(readings.traces, readings.settle_s)):
        return True
    return unrepeated(hypothesis.fit.chain, bench.observations) > MOSTLY


def hides_blemishes(readings: Readings, bench: Bench, hypothesis: Hypothesis, leave_out: Sequence[str]) -> bool:
    """Return whether all that a hypothesis leaves are blemishes of the readings that waited for it, or were hidden.

    Undone, they leave no more than noise: what is unexplained looks like blemishes, too, and leaves more.
    """
    if not hypothesis.effects or bench.complete(hypothesis):
        return False
    noise_v = readings.data.noise.rms_v
    chain = held_against(bench, hypothesis, readings.data, as_recorded(readings), leave_out)
    seen = mended(chain, readings.traces, readings.hold_out, noise_v, leave_out)
    own = {blemish for effect in hypothesis.effects for blemish in effect.brings}
    if not {b.id for b in seen.found} - {b.id for b in readings.found} - own:
        return False
    fitted, _ = less(chain, replace(seen, proof=()), noise_v)  # held-out ones have values of their own, as phases
    return pooled_rms([trace.y[:][good(trace)] for trace in fitted]) ** 2 < (1.0 + bench.noise_known) * noise_v**2


def loses(readings: Readings, chain: Chain, leave_out: Sequence[str], rough: bool = False) -> bool:
    """Return whether a close look against a chain, or a rough one, finds readings that are lost."""
    noise_v = readings.data.noise.rms_v
    return bool(lost(mended(chain, readings.traces, readings.hold_out, noise_v, leave_out, rough).found))


def loses_roughly(readings: Readings, chain: Chain, leave_out: Sequence[str]) -> bool:
    """Return whether a rough look against a chain finds readings that are lost, where none are known to be."""
    known = lost(readings.found) or coloured(readings.found)
    return not known and loses(readings, chain, leave_out, rough=True)


def lost_no_more(readings: Readings, hypothesis: Hypothesis, leave_out: Sequence[str]) -> bool:
    """Return whether losses that the plain model showed are none beside a law that tells most of what it left.

    Readings that were put back where none is lost are off, which asks for laws that are not there.
    """
    if all(blemish.alone for blemish in lost(readings.found)):
        return False
    most = hypothesis.effects and hypothesis.chi2 - hypothesis.count < TOLD * (readings.plain.chi2 - hypothesis.count)
    return bool(most) and not loses(readings, hypothesis.fit.chain, leave_out)


def counts_another(before: Readings, after: Readings) -> bool:
    """Return whether as many readings as had been put back were not what was lost."""
    counts = [{b.where: b.values["count"].value for b in lost(readings.found)} for readings in (before, after)]
    return counts[0] != counts[1]
