"""Does a residual no larger than noise still follow what the rig does?

A second minimum of a rig with many poles leaves little: a few hundred units of chi-squared in a hundred thousand do not
show in the residual's size. They do show against the shapes that other dynamics before or after F would give it: Rao's
score test of a free-form filter at either place, beside the values that were fitted. Where the model is right and the
fit at its best minimum, the statistic is chi-squared with as many degrees of freedom as the filters have weights.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2

from identify.blocks import LinearBlock, run_linear
from identify.chain import Chain
from identify.derivatives.sensitivities import sensitivities
from identify.discretise import Matrix, stepper
from identify.fit import Fit
from identify.observe import Observation
from identify.quadratic import inverse
from identify.stage import Block, Grid, Held, Parameter, Place, Run, Shape, Stage, Values
from identify.starts.thinning import COARSE, TRIED
from identify.stepping import corrected
from identify.trace import Array

RATES = 5  # time scales of a filter
SPAN = 4.0  # factor by which they reach beyond the fitted poles, on either side
FALSE_ALARMS = 1e-4  # share of good fits that are called patterned
NEW = 1e-8  # share of a weight's own power below which what it does is what the fitted values do, and rounding
TINY = 1e-300


@dataclass(frozen=True)
class Lead(Stage):
    """The signal plus weighted high-passes s tau / (1 + s tau) of it."""

    name: str
    place: Place
    taus_s: tuple[float, ...]

    def parameters(self) -> tuple[Parameter, ...]:
        """Return one weight for every time scale."""
        return tuple(Parameter(f"{self.name}.{i}", "1") for i in range(len(self.taus_s)))

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the running sum; it is straight between instants where its input is, else held."""
        kind, fraction = ("held", shape.fraction) if isinstance(shape, Held) else ("ramp", 0.0)
        passes = [
            (weight, run_linear(stepper((tau, 0.0), (tau, 1.0), grid.step_s, kind, fraction)))
            for weight, tau in zip(values, self.taus_s, strict=True) if weight
        ]  # fmt: skip

        def run(block: Block) -> Array:
            out = block.signal
            for weight, passed in passes:
                out = out + weight * passed(block)
            return out

        return run, shape


def pattern(fitted: Fit, observations: Sequence[Observation]) -> float:
    """Return the probability that chance leaves as much of the rig's own shapes in the residual; 1 for no blocks.

    Only the beginnings of very long runs are looked at. The residual is that of the fit's own grid, the shapes are of a
    coarse one: what chance leaves of those is known as well.
    """
    seen = [_coarser(b, fitted.chain) for o in observations if (b := o.until(TRIED)).count]
    taus_s = _taus_s(fitted, seen) if seen and np.isfinite(fitted.cost) else ()
    if not taus_s:
        return 1.0
    probes = [Lead(f"lead.{place.label}", place, taus_s) for place in (Place.G1, Place.G2)]
    chain = fitted.chain
    for probe in probes:
        chain = chain.with_stage(probe, {p.name: 0.0 for p in probe.parameters()})
    weights = [p.name for probe in probes for p in probe.parameters()]
    gain, known = _gain(chain, fitted, weights, seen)
    return float(chi2.sf(gain, known)) if known else 1.0


def _coarser(observation: Observation, chain: Chain) -> Observation:
    """Return the observation on a coarse grid, less what that leaves out of the fitted answer."""
    if observation.substeps <= COARSE:
        return observation
    return corrected(replace(observation, substeps=COARSE, left_out=None), chain)


def _gain(chain: Chain, fitted: Fit, weights: Sequence[str], observations: Sequence[Observation]) -> tuple[float, int]:
    """Return by how much chi-squared would fall with the weights free beside the fitted values, and their number.

    Weights that do what the fitted values do already are not counted.
    """
    scales = {c.name: c.slope(float(t)) for c, t in zip(fitted.coordinates, fitted.theta, strict=True)}
    own, size = len(scales), len(scales) + len(weights)
    prior = np.array([c.prior_sd**-2.0 for c in fitted.coordinates])
    matrix, right = np.zeros((size, size)), np.zeros(size)
    matrix[range(own), range(own)], right[:own] = prior, -fitted.theta * prior
    for o in observations:
        curvature, gradient = sensitivities(chain, scales | dict.fromkeys(weights, 1.0), o).normal()
        matrix, right = matrix + curvature, right + gradient
    mixed = matrix[own:, :own] @ inverse(matrix[:own, :own])
    left, pull = matrix[own:, own:] - mixed @ matrix[:own, own:], right[own:] - mixed @ right[:own]
    return _told(left, pull, np.diag(matrix)[own:])


def _told(left: Matrix, pull: Array, own: Array) -> tuple[float, int]:
    """Return the fall of chi-squared along the directions that are left, and their number."""
    scale = 1.0 / np.sqrt(np.maximum(own, TINY))
    shares, axes = np.linalg.eigh(left * np.outer(scale, scale))
    seen = shares > NEW
    along = (axes.T @ (pull * scale))[seen]
    return float(np.sum(np.square(along) / shares[seen])), int(np.count_nonzero(seen))


def _taus_s(fitted: Fit, observations: Sequence[Observation]) -> tuple[float, ...]:
    """Return time scales about those of the blocks, none that the readings could not show."""
    poles = [
        np.abs(np.roots(stage.rational(fitted.chain.of(stage, "")).den))
        for stage in fitted.chain.stages if type(stage) is LinearBlock
    ]  # fmt: skip
    if not sum(p.size for p in poles):
        return ()
    every = 1.0 / np.concatenate(poles)
    shortest_s = 0.5 / max(o.trace.rate_hz for o in observations)
    low = max(float(np.min(every)) / SPAN, shortest_s)
    return tuple(np.geomspace(low, max(float(np.max(every)) * SPAN, 2.0 * low), RATES).tolist())
