"""What is G1 at all frequencies of a multisine, once F and G2 are known (the paper's outlook)?

v is the sum of the played lines, each through an unknown complex gain; what lies between them (the images of a held
level) goes through G1 as the model has it. w is the settled play of one period, y follows from G2. Gauss-Newton on the
lines of the averaged period, which under white noise is the same as on its samples (Parseval). F and G2 take part as
far as they are unsure: their uncertainty widens the intervals, and what the multisine tells of them narrows it.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identify.harmonic.equations import HIGHEST
from identify.harmonic.measured import MeasuredPoint, point
from identify.harmonic.newton import least_squares, variances
from identify.harmonic.periods import Complex, Period
from identify.harmonic.steady import Settled, beside_v, frequency_response, lines_of, settled, signal_of
from identify.model import Backlash, Model
from identify.trace import Array

MOST = 64  # lines of u
FURTHEST = 20_000  # lines of y that are compared, at most


@dataclass(frozen=True, eq=False)
class Given:
    """A model, and how unsure it is: ``moved`` are models one standard deviation off, in independent directions.

    They move F and G2. What G1 is elsewhere than at the lines matters little and counts as known.
    """

    model: Model
    moved: tuple[Model, ...] = ()


def from_multisine(period: Period, given: Given, wider: float = 1.0) -> tuple[MeasuredPoint, ...]:
    """Return G1 at every line of a multisine with 95 % intervals, stretched by ``wider``."""
    task, count = _Task(period, given), len(period.played)
    frequencies = (np.array(period.played) * period.base_hz).tolist()
    if because := _untold(task):
        return tuple(MeasuredPoint(f, None, None, "multisine", because) for f in frequencies)
    x, left = least_squares(task.missed, task.rows, task.start)
    rows = task.rows(x)
    freedom = left.size - x.size
    stretch = max(wider, float(np.sqrt(left @ left / freedom)) if freedom > 0 else 1.0)
    sd = np.sqrt(variances(rows.T @ rows))
    return tuple(
        point(f, (x[i], x[count + i]), (sd[i], sd[count + i]), "multisine", stretch) for i, f in enumerate(frequencies)
    )


def _untold(task: "_Task") -> str:
    """Return why a multisine tells nothing of G1, empty when it does."""
    period = task.period
    if len(period.played) > MOST or 8 * max(period.played) > min(task.beside_v.size, 4 * FURTHEST):
        return f"{period.name} has too many lines, or too high ones, to be taken apart: {MOST} lines are"
    if not task.play(task.v(task.start)).moves:
        return f"the gap is stuck during {period.name}: the output does not move"
    return ""


@dataclass(frozen=True, eq=False)
class _Task:
    """One averaged period and what is given.

    The unknowns are log|G1| and arg G1 at every line, then how far to go along every unsure direction.
    """

    period: Period
    given: Given

    @cached_property
    def played(self) -> NDArray[np.int64]:
        """Return the lines of u."""
        return np.array(self.period.played)

    @cached_property
    def used(self) -> NDArray[np.int64]:
        """Return the lines of y that are compared."""
        return np.arange(min(int(HIGHEST * self.period.u.size), FURTHEST, self.beside_v.size // 2 - 1) + 1)

    @cached_property
    def start(self) -> Array:
        """Return the unknowns as the model has them."""
        one = frequency_response(self.given.model.g1, self.played * self.period.base_hz)
        return np.concatenate((np.log(np.abs(one)), np.angle(one), np.zeros(len(self.given.moved))))

    @cached_property
    def beside_v(self) -> Array:
        """Return what of v does not come from the played lines."""
        return beside_v(self.period, self.given.model)

    def tones(self, x: Array) -> Complex:
        """Return the played lines of v, one a row, as a spectrum each."""
        count = self.played.size
        spectra = np.zeros((count, int(self.played[-1]) + 1), dtype=np.complex128)
        gains = np.exp(x[:count] + 1j * x[count : 2 * count])
        spectra[np.arange(count), self.played] = self.period.drive(self.period.played) * gains
        return spectra

    def v(self, x: Array) -> Array:
        """Return v over one period."""
        return self.beside_v + signal_of(self.tones(x).sum(axis=0), self.beside_v.size)

    def play(self, v: Array) -> Settled:
        """Return the settled play of the model as given."""
        return _played(v, self.given.model)

    def missed(self, x: Array) -> Array:
        """Return measured less expected lines in units of their noise, then the way gone along what is unsure."""
        v, far = self.v(x), x[2 * self.played.size :]
        expected = self.answer(v, self.given.model)
        lines = self.period.lines[self.used] - expected - self.unsure(v, expected) @ far
        return np.concatenate((self.weighed(lines), far))

    def rows(self, x: Array) -> NDArray[np.float64]:
        """Return d missed / d x."""
        v, tones = self.v(x), self.tones(x)
        play, two = self.play(v), self.g2(self.given.model)
        lines = np.empty((self.used.size, 2 * len(tones)), dtype=np.complex128)
        for i, tone in enumerate((*tones, *(1j * tones))):
            lines[:, i] = lines_of(play.moved(signal_of(tone, v.size)), self.used.size) * two
        unsure = self.unsure(v, self.answer(v, self.given.model))
        above = -self.weighed(np.concatenate((lines, unsure), axis=1))
        below = np.hstack((np.zeros((unsure.shape[1], 2 * self.played.size)), np.eye(unsure.shape[1])))
        return np.concatenate((above, below))

    def answer(self, v: Array, model: Model) -> Complex:
        """Return the lines of y that v makes."""
        return np.asarray(lines_of(_played(v, model).w, self.used.size) * self.g2(model))

    def g2(self, model: Model) -> Complex:
        """Return G2 at the lines of y."""
        return frequency_response(model.g2, self.used * self.period.base_hz)

    def unsure(self, v: Array, expected: Complex) -> Complex:
        """Return how the lines of y move one standard deviation along every unsure direction (lines, directions)."""
        columns = [self.answer(v, model) - expected for model in self.given.moved]
        return np.array(columns).T.reshape(self.used.size, len(columns))

    def weighed(self, lines: Complex) -> Array:
        """Return real and imaginary parts of lines (n, ...) in units of their noise; the mean has no imaginary one."""
        sd = self.period.sd_v[self.used].reshape(-1, *(1,) * (lines.ndim - 1))
        return np.concatenate((lines.real / sd, lines.imag[1:] / sd[1:]))


def _played(v: Array, model: Model) -> Settled:
    assert isinstance(model.f, Backlash)
    return settled(v, model.f)
