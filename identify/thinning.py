"""How few samples tell the same about a mismatch, once a chain is fitted?

Recordings are often sampled far faster than anything in them moves. What is screened for missing physics is then the
mean residual of every few samples, of an answer simulated on as many fewer instants. Where the mismatch itself is
faster, these still show where the search for slow physics may begin, but judge nothing.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identify.chain import Chain, simulate
from identify.colour import WHITE, Colour
from identify.derivatives.sensitivities import sensitivities
from identify.fit import Fit
from identify.observe import Observation
from identify.trace import Array, Mask, Trace

Matrix = NDArray[np.float64]
FACTORS = (5, 3)  # odd: the mean of as many samples belongs to the instant of the middle one
KEPT = 0.95  # share of the square of a slope, and of the mismatch, that means must keep
TOLD = 4.0  # standard deviations by which power above white noise is no chance
LINE = 12.0  # over the log of how many there are: an ordinate of a periodogram so high is no chance
LEAST = 20_000  # means: with fewer nothing is slow


@dataclass(frozen=True)
class Thinned:
    """Runs of fewer samples with the same residual of a fit, or the runs themselves where that loses the answer.

    The means hold what the samples do of every fitted parameter's slope; ``whole`` says whether of the mismatch, too.
    """

    observations: tuple[Observation, ...]
    whole: bool = True


def thinned(fit: Fit, observations: Sequence[Observation]) -> Thinned:
    """Return as few samples as tell the same, or as show at least what is slow."""
    factors = _factors(observations)
    if not factors or any(o.colour.sizes is not None for o in observations):
        return Thinned(tuple(observations))
    runs = [_Run(o, o.residual(fit.chain), _slopes(fit, o)) for o in observations]
    factors = [m for m in factors if _slopes_are_kept(runs, m)]
    if not factors:
        return Thinned(tuple(observations))
    white = all(o.colour.white or o.colour.wander is not None for o in observations)
    whole = next((m for m in factors if white and _mismatch_is_kept(runs, m)), None)
    few = (_of_means(fit.chain, run.observation, run.residual, whole or factors[0]) for run in runs)
    return Thinned(tuple(few), whole is not None)


def fewest(chain: Chain, observations: Sequence[Observation]) -> tuple[Observation, ...] | None:
    """Return means of as many samples as may be, whatever they keep; what a chain leaves is the mean of what it left.

    None where there are too few, or where their noise hangs together by taps or is told sample by sample. Raises
    ValueError where the chain cannot be simulated.
    """
    factors = _factors(observations)
    if not factors or any(o.colour.taps or o.colour.sizes is not None for o in observations):
        return None
    return tuple(_of_means(chain, o, o.residual(chain), factors[0]) for o in observations)


def _factors(observations: Sequence[Observation]) -> list[int]:
    """Return of how many samples means may be made."""
    if any(o.trace.intersample == "bandlimited" for o in observations):
        return []
    count = sum(o.count for o in observations)
    return [m for m in FACTORS if count >= m * LEAST]


def _slopes(fit: Fit, observation: Observation) -> Matrix:
    """Return the change of the answer per search coordinate in units of the noise, zero where no sample counts."""
    scales = {c.name: c.slope(float(t)) for c, t in zip(fit.coordinates, fit.theta, strict=True)}
    rows = np.zeros((len(scales), observation.trace.size))
    if scales:
        bare = replace(observation, substeps=1, colour=WHITE)
        rows[:, observation.use] = sensitivities(fit.chain, scales, bare).slopes()
    return rows


@dataclass(frozen=True, eq=False)
class _Run:
    """A run with the residual of a fit, V, shape (N,), and the slopes of the answer, per noise, shape (p, N)."""

    observation: Observation
    residual: Array
    slopes: Matrix

    def squares(self, m: int) -> Matrix:
        """Return the squares of the slopes of samples and of their means, shape (2, p)."""
        whole = _whole(self.observation.use, m)
        each = np.zeros(self.residual.size, dtype=np.bool_)
        each[m - m // 2 : m - m // 2 + m * whole.size] = np.repeat(whole, m)
        kept = m * np.sum(np.square(_means(self.slopes, m)), axis=1, where=whole)
        return np.array([np.sum(np.square(self.slopes), axis=1, where=each), kept])

    @cached_property
    def power(self) -> Array:
        """Return the periodogram of the residual in units of the noise's variance, from 0 to half the sample rate."""
        residual = np.where(self.observation.use, self.residual, 0.0) / self.observation.noise_v
        return np.asarray(np.square(np.abs(np.fft.rfft(residual))) / self.observation.count)

    def beyond(self, m: int) -> tuple[float, float, float, int]:
        """Return the power above white noise at all frequencies, at those that means lose and in a line among these.

        White noise is what lies at most of the frequencies that are lost; their number comes last.
        """
        lost = self.power[self.power.size // m :]
        white = float(np.median(lost)) / float(np.log(2.0))
        highest = float(np.max(lost))
        line = highest if highest > white * (np.log(lost.size) + LINE) else 0.0
        return float(np.sum(self.power - white)), float(np.sum(lost - white)), line, lost.size


def _means(rows: Matrix, m: int) -> Matrix:
    """Return the means of ``m`` samples around every instant m, 2m ..., shape (..., groups)."""
    groups = (rows.shape[-1] - 1 - m // 2) // m
    first = m - m // 2
    return np.asarray(rows[..., first : first + groups * m].reshape(*rows.shape[:-1], groups, m).mean(axis=-1))


def _whole(use: Mask, m: int) -> Mask:
    """Return the means of whose samples all count."""
    return np.asarray(_means(use.astype(np.float64), m) == 1.0)


def _of_means(chain: Chain, observation: Observation, residual: Array, m: int) -> Observation:
    """Return the run at every m-th instant, its readings the answer there and the mean residual around it."""
    o, colour = observation, observation.colour
    trace = _fewer(o.trace, m, _source(o.trace, m))
    use = np.concatenate((np.zeros(1, np.bool_), _whole(o.use, m)))
    trace = replace(trace, y=simulate(chain, trace) + np.concatenate((np.zeros(1), _means(residual, m))))
    if colour.ladder:
        return Observation(trace, use, o.noise_v, colour=colour.of_means(m))
    hanging = WHITE if colour.wander is None else Colour(wander=colour.wander.of_means(m, use))
    return Observation(trace, use, o.noise_v * colour.slow / float(np.sqrt(m)), colour=hanging)


def _slopes_are_kept(runs: Sequence[_Run], m: int) -> bool:
    """Return whether means of ``m`` samples keep the squares of all slopes."""
    before, after = np.sum([run.squares(m) for run in runs], axis=0)
    return any(_whole(run.observation.use, m).any() for run in runs) and not np.any(after < KEPT * before)


def _mismatch_is_kept(runs: Sequence[_Run], m: int) -> bool:
    """Return whether means of ``m`` samples keep the power of the residual beyond white noise, and every line of it."""
    every, lost, lines, counts = (sum(part) for part in zip(*(run.beyond(m) for run in runs), strict=True))
    enough = (1.0 - KEPT) * max(every, 0.0)
    return bool(lines <= enough and lost <= enough + TOLD * np.sqrt(counts))


def _source(trace: Trace, m: int) -> Array:
    """Return what the source gives between every m-th instant and the next, V: held the mean of it, else at it."""
    u, groups = trace.u[:], 1 + (trace.size - 1 - m // 2) // m
    if trace.intersample != "held":
        return np.asarray(u[: groups * m : m])
    held = np.concatenate((u, np.full(m, u[-1])))[: groups * m].reshape(groups, m)
    return np.asarray(np.where(np.ptp(held, axis=1) == 0.0, held[:, 0], held.mean(axis=1)))


def _fewer(trace: Trace, m: int, u: Array) -> Trace:
    """Return a run at every m-th instant; what was read is another's to say."""
    steps = tuple(replace(s, start=-(-s.start // m), stop=-(-s.stop // m)) for s in trace.steps)
    return replace(trace, rate_hz=trace.rate_hz / m, u=u, y=np.zeros(u.size), steps=steps, valid=None)
