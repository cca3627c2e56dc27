"""Between which lines does the answer of a model lie whose values are only so well known?"""

from collections.abc import Iterator

import numpy as np

from identify.chain import answered
from identify.effects import chain_of
from identify.model import Doubt, Model
from identify.trace import Array, Trace
from identify.uncertainty.coefficients import coefficients, with_coefficients
from identify.uncertainty.propagation import Z95

STEP = 0.03  # of the central differences, in standard deviations
NOTHING = 1e-12  # share of the largest variance that is rounding


def half_band(model: Model, doubt: Doubt, trace: Trace, substeps: int) -> Array:
    """Return half the width of the 95 % band around the model's answer at every sample, V, shape (N,)."""
    return Z95 * np.concatenate(list(answer_sd(model, doubt, trace, substeps)))


def answer_sd(model: Model, doubt: Doubt, trace: Trace, substeps: int) -> Iterator[Array]:
    """Yield the sd of the model's answer at every sample, V, chunk by chunk: the doubt of its values, no noise.

    The covariance is split into independent directions; the answer's slope along each is a central difference of two
    runs, and all runs go side by side. Raises ValueError where a model cannot be simulated.
    """
    chains = [chain_of(moved, trace.intersample) for moved in _either_side(model, doubt)]
    sides = [answered(chain, trace, substeps) for chain in chains]
    for answers in zip(*sides, strict=True):
        slopes = [(above - below) / (2.0 * STEP) for above, below in zip(answers[::2], answers[1::2], strict=True)]
        yield np.sqrt(sum(np.square(slope) for slope in slopes))


def _either_side(model: Model, doubt: Doubt) -> Iterator[Model]:
    """Yield the model a little above and a little below itself along every direction of its doubt."""
    values = coefficients(model)
    here = np.array([values[name] for name in doubt.names])
    for direction in _directions(np.array(doubt.matrix)):
        for moved in (here + STEP * direction, here - STEP * direction):
            yield with_coefficients(model, dict(zip(doubt.names, moved.tolist(), strict=True)))


def _directions(covariance: Array) -> Array:
    """Return independent directions, each one standard deviation long, as rows: covariance = rows' rows."""
    scale = np.sqrt(np.diag(covariance))
    variances, axes = np.linalg.eigh(covariance / np.outer(scale, scale))
    told = variances > NOTHING * np.max(variances)
    return np.asarray((axes[:, told] * np.sqrt(variances[told])).T * scale)
