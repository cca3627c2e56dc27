"""In which directions can the model move without the recordings noticing?

The sensitivities of the recordings to every probe and to what was fitted are summed into one normal matrix. A probe
whose column lies in the span of others is a direction nothing tells; among what was fitted, a principal direction of
the covariance wider than is needed is one the data hardly tell.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from identify.chain import grid_of
from identify.coordinate import Coordinate
from identify.derivatives.sensitivities import DIFFERENCE, sensitivities
from identify.fit import Fit
from identify.identifiability.probes import DELAYS, GAINS, OFFSETS, probes, with_probes
from identify.observe import Observation
from identify.stage import is_fixed
from identify.trace import Array
from identify.uncertainty.normalised import rational_of

SAME = 1e-3  # share of a probe's effect, rms, below which what is left of it is the error of a one-sided difference
NEEDED_LOG = 0.5  # sd of a logarithm from which a 95 % interval spans a factor of e either way: not a value
NEEDED_LINEAR = 1.5  # the same in units of a linear coordinate's scale, which is 0.3 of its natural size
NEEDED_GAIN = 0.1  # sd of a probed gain; parts are known that well unmeasured
FLAT = 1e-12  # relative curvature that is nothing but rounding
MEMBER = 0.3  # share of a unit direction from which a coordinate is named as part of it


@dataclass(frozen=True)
class Mimic:
    """A probe that the data cannot tell from other things: by which of them, most first."""

    probe: str
    by: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Likeness:
    """The normal matrix of every probe and of what was fitted beside it, J'J in units of the noise; names in order."""

    names: tuple[str, ...]
    matrix: NDArray[np.float64]

    def mimic(self, probe: str, others: Sequence[str], needed: float) -> Mimic | None:
        """Return what takes the place of ``probe`` among ``others``; None when the data tell it apart.

        Told apart is what leaves more than rounding when the others are taken out of it, and is then known to better
        than ``needed`` (in its unit, one standard deviation).
        """
        at, rest = self.names.index(probe), [self.names.index(name) for name in others]
        size = float(self.matrix[at, at])
        if size <= 0.0:
            return Mimic(probe, ())
        scale = 1.0 / np.sqrt(np.maximum(np.diag(self.matrix)[rest], np.finfo(float).tiny))
        pull = self.matrix[rest, at] * scale / np.sqrt(size)
        amounts = _solved(self.matrix[np.ix_(rest, rest)] * np.outer(scale, scale), pull)
        left = max(1.0 - float(pull @ amounts), 0.0)
        if left > SAME**2 and left * size > needed**-2.0:
            return None
        order = np.argsort(-np.abs(amounts))
        strongest = float(np.max(np.abs(amounts), initial=0.0))
        return Mimic(probe, tuple(others[i] for i in order if abs(amounts[i]) > MEMBER * strongest > 0.0))


def _solved(matrix: NDArray[np.float64], right: Array) -> Array:
    """Return the smallest solution of a singular system, its flat directions left alone."""
    if right.size == 0:
        return right
    curvatures, axes = eigh(matrix)
    steep = curvatures > FLAT * max(float(np.max(curvatures)), np.finfo(float).tiny)
    return np.asarray(axes[:, steep] @ ((axes[:, steep].T @ right) / curvatures[steep]))


def likeness(fit: Fit, observations: Sequence[Observation]) -> Likeness:
    """Return what the observations tell of every probe, and of what was fitted and could stand in for one.

    The dynamics of G1 and G2 cannot: they change no constant and no factor, and a delay only nearly. One instant to a
    sample is enough to see which columns lie in the span of others.
    """
    chain = with_probes(fit.chain)
    tried = [probe.name for probe in probes(fit.chain)]
    pairs = zip(fit.coordinates, fit.theta, strict=True)
    fitted = {c.name: c.slope(float(t)) for c, t in pairs if not is_fixed(c.name, ("G1", "G2"))}
    # A level that rests on a corner of F has another slope on either side: offsets are moved as far as borders are, and
    # the other way, so that both see the same side.
    border_v = fitted.get("F.D_L", 1.0) / rational_of(fit.chain, "G1").dc_gain
    small = {name: -border_v if name in OFFSETS else 1.0 for name in tried}
    names = (*fitted, *tried)
    matrix = np.zeros((len(names), len(names)))
    for observation in (replace(o, substeps=1) for o in observations):
        step_s = grid_of(observation.trace).step_s
        steps = [step_s if name in DELAYS else DIFFERENCE * small[name] for name in tried]
        units = np.array([1.0] * len(fitted) + [DIFFERENCE / step for step in steps])
        part, _ = sensitivities(chain, {**fitted, **small}, observation).normal()
        matrix += part * np.outer(units, units)
    return Likeness(names, matrix)


def mimics(found: Likeness, offset_needed_v: Mapping[str, float]) -> tuple[Mimic, ...]:
    """Return the probes that something else can stand in for: delays and gains among themselves, offsets for fits."""
    fitted = tuple(name for name in found.names if name not in (*GAINS, *DELAYS, *OFFSETS))
    groups = [(DELAYS[0], (*fitted, DELAYS[1]), 0.0)]
    groups += [(name, (*fitted, *(g for g in GAINS if g != name)), NEEDED_GAIN) for name in GAINS]
    groups += [(name, fitted, offset_needed_v[name]) for name in OFFSETS]
    told = (found.mimic(probe, others, needed or float("inf")) for probe, others, needed in groups)
    return tuple(mimic for mimic in told if mimic)


def needed_sd(coordinate: Coordinate) -> float:
    """Return the sd, in search coordinates, from which a value counts as not determined."""
    return NEEDED_LOG if coordinate.parameter.coordinate == "log" else NEEDED_LINEAR


def undetermined(fit: Fit) -> tuple[str, ...]:
    """Return the coordinates whose intervals say hardly more than the rig file did; those of single runs left out."""
    if not np.all(np.isfinite(fit.covariance)):  # there is no fit, and it says so elsewhere
        return ()
    sd = np.sqrt(np.diag(fit.covariance))
    return tuple(c.name for c, s in zip(fit.coordinates, sd, strict=True)
                 if s > needed_sd(c) and not c.parameter.local)  # fmt: skip


def together(fit: Fit, names: Sequence[str]) -> tuple[tuple[str, ...], ...]:
    """Return the undetermined directions that involve ``names``: which coordinates move together along each."""
    if not names:
        return ()
    needed = np.array([needed_sd(c) for c in fit.coordinates])
    widths, axes = eigh(fit.covariance / np.outer(needed, needed))
    wide = [
        tuple(c.name for c, share in zip(fit.coordinates, axis, strict=True) if abs(share) > MEMBER)
        for width, axis in zip(widths, axes.T, strict=True) if width > 1.0
    ]  # fmt: skip
    return tuple(members for members in wide if set(members) & set(names))
