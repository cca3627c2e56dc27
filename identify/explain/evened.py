"""By how much is every reading weighed, whose noise is coloured, goes with something, or stands on coarse steps?"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

from identify.chain import Chain
from identify.colour import Colour
from identify.effects.adc_quantisation import LSB, SMOOTH, AdcQuantisation
from identify.explain.bench import Bench
from identify.explain.hypothesis import Hypothesis
from identify.holdout import Split
from identify.noise import grid_step_v
from identify.observe import pooled_rms
from identify.readings.coarse import CoarseSteps
from identify.readings.uneven_noise import Uneven
from identify.trace import Trace

Prepared = Callable[[Split], tuple[Bench, Hypothesis]]


def weighed(data: Split, noise_v: float, told_v: float, colour: Callable[[Trace], Colour]) -> Split:
    """Return the data weighed by the colour of each recording, ``told_v`` the noise that an answer is held against."""
    train, test = (
        tuple(replace(o, noise_v=noise_v, colour=colour(o.trace)) for o in part) for part in (data.train, data.test)
    )
    return replace(data, train=train, test=test, noise=replace(data.noise, rms_v=told_v))


def evened(data: Split, noise: Uneven) -> Split:
    """Return the data weighed as every reading scatters, the noise that of those held out."""
    rms_v, held_out_v = (pooled_rms(noise.of(o.trace)[o.use] for o in part) for part in (data.train, data.test))
    return weighed(data, rms_v, held_out_v, partial(noise.colour, rms_v=rms_v))


def as_stepped(
    data: Split, bench: Bench, plain: Hypothesis, prepared: Prepared, against: Chain | None
) -> tuple[Split, Bench, Hypothesis, bool]:
    """Return data, bench and plain fit, and whether readings stand on steps so coarse that they scatter unlike.

    A chain with these in it says by how much, and all is ``prepared`` anew.
    """
    coarse = SMOOTH * grid_step_v([o.trace for o in data.train]) >= data.noise.rms_v
    if AdcQuantisation not in bench.kinds or not coarse or not all(o.colour.white for o in data.train):
        return data, bench, plain, False
    chain = against if against and LSB.name in against.values else _with_steps(bench, plain)
    steps = CoarseSteps(chain) if chain else None
    told = steps.told(data) if steps and steps.shows else None
    return (told, *prepared(told), True) if told else (data, bench, plain, False)


def _with_steps(bench: Bench, plain: Hypothesis) -> Chain | None:
    """Return the plain chain with steps of the ADC, fitted; None where the readings lie on no grid."""
    (law,) = AdcQuantisation.variants()
    starts = law.starts(bench.evidence(plain).fine)
    return bench.fitted(law.put_in(plain.fit.chain, starts[0]), (law,)).fit.chain if starts else None


def stepped(data: Split, bench: Bench, final: Hypothesis) -> tuple[Split, Bench, Hypothesis]:
    """Return data, bench and hypothesis with what noise leaves of readings in coarse steps, by the chain of the latter.

    A chain that has the steps alone takes what it is missing for noise ahead of the ADC.
    """
    told = CoarseSteps(final.fit.chain).told(data)
    if told is None:
        return data, bench, final
    pairs = zip(bench.observations, told.train, strict=True)
    seen = tuple(replace(o, noise_v=new.noise_v, scatter=new.scatter) for o, new in pairs)
    again = bench.on(seen)
    return told, again, again.again(final)
