"""Is a line or a ripple that was fitted with an amplitude of its own in every run there in all of them alike?

What goes at one frequency, free of the stimulus, does not know which run is played. What is strong in some runs and
gone in others goes with these: with the harmonic of a stimulus that happens to have that frequency.
"""

import numpy as np

from identify.chain import local_name
from identify.explain.hypothesis import Hypothesis
from identify.trace import Array
from identify.unnamed.correction import Correction
from identify.unnamed.lines import OneLine

ALIKE = 0.3  # of the amplitude, by which that of a run may be another all the same
STEADY = 0.1  # share of what a line explains that one amplitude for all runs may cost, beside one a run for chance
AMPLITUDES = 200  # that are tried


def steady(base: Hypothesis, law: Correction, fitted: Hypothesis) -> bool:
    """Return whether a law is no line, or one that explains most of what it does with one amplitude for all runs."""
    if not isinstance(law, OneLine):
        return True
    return _cost(law, fitted) - len(fitted.data) < STEADY * (base.chi2 - fitted.chi2)


def _cost(law: OneLine, fitted: Hypothesis) -> float:
    """Return by how much chi-squared would rise, to second order, were the amplitude about the same in every run."""
    size, sd = _amplitudes(law, fitted)
    known = sd > 0.0
    size, sd = size[known], sd[known]
    one = np.linspace(0.0, float(np.max(size, initial=0.0)), AMPLITUDES)[:, None]
    off = np.maximum(np.abs(size - one) - ALIKE * one, 0.0)
    return float(np.min(np.sum(np.square(off / sd), axis=1)))


def _amplitudes(law: OneLine, fitted: Hypothesis) -> tuple[Array, Array]:
    """Return the amplitude in every run and its standard deviation, shape (runs,); 0 where it was not searched."""
    words, runs = [p.name for p in law.parameters()], [o.trace.name for o in fitted.data]
    names = [[local_name(word, run) for word in words] for run in runs]
    values = fitted.fit.chain.values
    parts = np.array([[values.get(name, 0.0) for name in pair] for pair in names])
    sds = np.array([[fitted.fit.sd(name) for name in pair] for pair in names])
    return np.linalg.norm(parts, axis=1), np.sqrt(np.mean(np.square(sds), axis=1))
