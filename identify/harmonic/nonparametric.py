"""Which points of G1 and G2 do the sines and multisines in the recordings give, whatever the form of the blocks?

Borders and the delay between the blocks come from the fit of all runs, as sure as the other steps alone make them: no
reading counts twice in an interval. Points are in the paper's scale, V_p = 1 and G2(0) = 1.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.chain import Chain
from identify.delay import delay_s
from identify.fit import Fit
from identify.harmonic.measured import Known, Measured, MeasuredPoint, frequencies_of, measured
from identify.harmonic.multisine import Given, from_multisine
from identify.harmonic.periods import Period, periods
from identify.harmonic.steady import frequency_response
from identify.holdout import settling_s
from identify.interval import Interval
from identify.model import Backlash, Model
from identify.observe import Observation
from identify.planning.information import Information
from identify.quadratic import inverse
from identify.trace import Array
from identify.uncertainty.normalised import BORDERS, Scale, peak_interval, rational_of
from identify.uncertainty.propagation import propagated

UNKNOWN = 0.1  # standard deviation of the borders, over their size, from which they are not known
NO_BORDERS = "the borders of the backlash are not known from anything but these steps; a staircase would tell them"


@dataclass(frozen=True, eq=False)
class Evidence:
    """The model as fitted, what each step told of it, and how much wider than the noise its misfit makes intervals."""

    model: Model
    fit: Fit
    told: Information
    wider: float

    @property
    def plain(self) -> Model:
        """Return the model with all dead time in G2."""
        late = replace(self.model.g2, dead_time_s=delay_s(self.fit.chain))
        return replace(self.model, g1=replace(self.model.g1, dead_time_s=0.0), g2=late)

    def without(self, steps: Sequence[Period]) -> Fit:
        """Return the fit with the covariance that all but some steps give it."""
        left_out = {period.name for period in steps}
        labelled = zip(self.told.labels, self.told.matrices, strict=True)
        kept = [matrix for label, matrix in labelled if label not in left_out]
        return replace(self.fit, covariance=inverse(sum(kept, self.told.prior)))


def nonparametric(evidence: Evidence, observations: Sequence[Observation], scale: Scale) -> Measured:
    """Return the points of G1 and G2; none for a rig whose F is no backlash with straight borders, or with physics."""
    if not isinstance(evidence.model.f, Backlash) or evidence.model.physics:
        return Measured()
    settle_s = settling_s(evidence.plain)
    seen = [p for o in observations for p in periods(replace(o.trace, valid=o.use), settle_s, o.noise_v)]
    sines = [p for p in seen if len(p.played) == 1]
    multisines = [p for p in seen if len(p.played) > 1]
    try:
        found = _harmonics(evidence, sines)
        lines = [point for p in multisines for point in _multisine(evidence, p)]
    except ValueError:  # borders that cross: no play has them
        return Measured()
    g1 = sorted((*found.g1, *lines), key=lambda p: p.frequency_hz)
    v_p, one = peak_interval(evidence.fit, scale, evidence.wider), Interval(*(scale.g2_gain,) * 3)
    return replace(found, g1=tuple(scaled(p, v_p) for p in g1), g2=tuple(scaled(p, one) for p in found.g2))


def _harmonics(evidence: Evidence, sines: Sequence[Period]) -> Measured:
    """Return what the sines tell."""
    if not sines:
        return Measured()
    others, at = evidence.without(sines), frequencies_of(sines)

    def law(chain: Chain) -> Array:
        borders = [chain.values[f"F.{name}"] for name in BORDERS]
        return np.concatenate((borders, np.angle(frequency_response(rational_of(chain, "G1"), at))))

    known = propagated(others, law)
    if not _borders_known(known.value, known.covariance):
        return Measured(tuple(MeasuredPoint(f, None, None, "harmonics", NO_BORDERS) for f in at.tolist()))
    return measured(sines, Known(evidence.plain, at, known.covariance), evidence.wider)


def _borders_known(value: Array, covariance: NDArray[np.float64]) -> bool:
    """Return whether slopes and crossings are sure to a tenth of themselves, crossings to a tenth of the gap."""
    s_l, d_l, s_u, d_u = value[:4]
    sizes = np.array([s_l, d_l - d_u, s_u, d_l - d_u])
    return bool(np.all(np.sqrt(np.diag(covariance)[:4]) < UNKNOWN * np.abs(sizes)))


def _multisine(evidence: Evidence, period: Period) -> tuple[MeasuredPoint, ...]:
    """Return what a multisine tells of G1: borders and G2 move as far as the other steps leave them unsure."""
    others = evidence.without([period])
    moving = [i for i, c in enumerate(others.coordinates) if c.name.split(".")[0] != "G1"]
    covariance = others.covariance[np.ix_(moving, moving)]
    borders = propagated(others, lambda chain: np.array([chain.values[f"F.{name}"] for name in BORDERS]))
    if not _borders_known(borders.value, borders.covariance):
        at = (np.array(period.played) * period.base_hz).tolist()
        return tuple(MeasuredPoint(f, None, None, "multisine", NO_BORDERS) for f in at)
    roots = np.linalg.cholesky(covariance + np.diag(1e-12 * np.diag(covariance)))
    moved = tuple(_moved(evidence, dict(zip(moving, root, strict=True))) for root in roots.T)
    return from_multisine(period, Given(evidence.plain, moved), evidence.wider)


def _moved(evidence: Evidence, by: dict[int, float]) -> Model:
    """Return the model with some search coordinates moved."""
    fit = evidence.fit
    values = {fit.coordinates[i].name: fit.coordinates[i].value(float(fit.theta[i]) + step) for i, step in by.items()}
    chain = fit.chain.with_values(values)
    late = replace(rational_of(chain, "G2"), dead_time_s=delay_s(chain))
    return replace(evidence.plain, g2=late, f=Backlash(*(chain.values[f"F.{name}"] for name in BORDERS)))


def scaled(point: MeasuredPoint, one: Interval) -> MeasuredPoint:
    """Return a point with its gain over ``one``, whose doubt adds to its own; a negative one turns the phase round."""
    if point.gain is None or one.value == 0.0:
        return point
    value = point.gain.value / abs(one.value)
    doubts = (np.log(point.gain.high / point.gain.value), 0.5 * np.log(abs(one.high / one.low)))
    half = float(np.exp(np.hypot(*doubts)))
    phase = point.phase_rad
    if phase is not None and one.value < 0.0:
        turn = -np.pi if phase.value > 0.0 else np.pi
        phase = Interval(phase.value + turn, phase.low + turn, phase.high + turn)
    return replace(point, gain=Interval(value, value / half, value * half), phase_rad=phase)
