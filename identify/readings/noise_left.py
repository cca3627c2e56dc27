"""Is what a model leaves of whole recordings noise that hangs together over long times?

Repeats tell of such noise without any model (coloured_noise), but little where there are few of them. What a model
leaves tells far more; yet it may be physics that the model lacks. It passes for noise where one power law holds in
every run alike, whatever was played there, and where it is Gaussian once made white. That it does not come back when
the same is played again is for the caller to see.
"""

from collections.abc import Sequence

import numpy as np

from identify.colour import whitening
from identify.noise import good
from identify.readings.coloured_noise import Coloured, Told, misfit, straying, told_apart, told_by
from identify.readings.spectra import LEAST, Spectrum, spectrum
from identify.trace import Array, Trace

BY_CHANCE = 1.15  # deviance a band of the right law where a band is one ordinate, and no more elsewhere
SCATTER = 2.6  # its variance there
STRAYS = 4.0  # standard deviations by which a run may exceed it
UNLIKE = 1e-4  # probability of so much difference between runs below which they have no noise in common


def noise_left(training: Sequence[Trace], proof: Sequence[Trace]) -> Told | None:
    """Return the noise in what a model left, given as recordings of it; None where it is white or is not noise."""
    seen, kept = ([_spectrum(t) for t in traces if t.size >= LEAST] for traces in (training, proof))
    told = told_by(seen, kept, lambda noise: straying([_white(noise, t) for t in training]))
    every = (*seen, *kept)
    return told if told and all(_follows(run, told) for run in every) and told_apart(every, told) > UNLIKE else None


def _spectrum(trace: Trace) -> Spectrum:
    """Return the spectrum of all of a recording that counts, freed of its mean and trend."""
    use = good(trace)
    at = np.linspace(-1.0, 1.0, trace.size)
    line = np.polynomial.Polynomial.fit(at[use], trace.y[:][use], 1)
    return spectrum(trace, np.where(use, trace.y[:] - line(at), 0.0), use)


def _white(noise: Coloured, trace: Trace) -> Array:
    """Return the noise of a recording made white."""
    left = trace.y[:][good(trace)]
    return whitening(noise.colour(trace))(left - np.mean(left), np.ones(left.size, dtype=np.bool_))


def _follows(run: Spectrum, noise: Coloured) -> bool:
    """Return whether the law of all runs holds in one of them as far as chance allows."""
    return misfit([run], noise) < BY_CHANCE + STRAYS * float(np.sqrt(SCATTER / run.power.size))
