"""How are readings made white whose noise is that of the reading and of something that wanders in front of a block?

What wanders fades by a known factor in every step and is pushed by a known variance; a linear block passes it on. The
innovations, reading less what all readings before foretell, are then white (R. E. Kalman, J. Basic Eng. 82 (1960) 35).
By how much each corrects what is foretold does not depend on the readings: it is worked out once for a run.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identify import innovation_kernels as kernels
from identify.derivatives.lanes import WIDTH
from identify.discretise import Stepper
from identify.trace import Array, Mask

FEW = 3  # columns that take no longer one after the other
System = tuple[Array, Array, Array, Array, float]


@dataclass(frozen=True, eq=False)
class Wander:
    """What wanders in one run, in units of the noise of a reading, and which readings count: shapes (N,).

    In a step it fades by the factor ``keeps``, then gains the variance ``gains``; ``behind`` passes it on.
    """

    keeps: Array
    gains: Array
    behind: Stepper
    use: Mask

    @cached_property
    def system(self) -> System:
        """Return matrix, inputs, output and feed-through of what passes it on."""
        b = self.behind
        rows = np.array(b.rows, dtype=np.float64).reshape(b.order, b.order)
        return rows, np.array(b.g0), np.array(b.g1), np.array(b.c), float(b.d)

    @cached_property
    def corrections(self) -> tuple[NDArray[np.float64], Array]:
        """Return how much an innovation corrects every state, (N, m), and its sd in noises, (N,), 0 where none is."""
        pulls, sizes = np.zeros((self.use.size, self.behind.order + 1)), np.zeros(self.use.size)
        kernels.filtered(self.keeps, self.gains, *self.system, self.use, pulls, sizes)
        return pulls, sizes

    def of_means(self, m: int, use: Mask) -> "Wander":
        """Return what wanders at every ``m``-th instant, the first too, in units of the noise of a mean of m readings.

        ``use``, shape (1 + k,), are the means that count. Between these instants, what enters is taken as straight.
        """
        rows, g0, g1, *_ = self.system
        power, first, last = np.eye(g0.size), np.zeros(g0.size), np.zeros(g0.size)
        for j in range(m):
            first = rows @ first + (1.0 - j / m) * g0 + (1.0 - (j + 1) / m) * g1
            last = rows @ last + j / m * g0 + (j + 1) / m * g1
            power = rows @ power
        one = slice(1, 1 + (use.size - 1) * m)
        keeps, gains = (each[one].reshape(-1, m) for each in (self.keeps, self.gains))
        later = np.cumprod(keeps[:, ::-1], axis=1)[:, ::-1]  # of all steps from each on
        after = np.concatenate((later[:, 1:], np.ones((later.shape[0], 1))), axis=1)
        gained = m * np.sum(gains * np.square(after), axis=1)
        behind = replace(
            self.behind, rows=tuple(map(tuple, power.tolist())), g0=tuple(first.tolist()), g1=tuple(last.tolist())
        )
        kept = np.concatenate((self.keeps[:1], later[:, 0]))
        return Wander(kept, np.concatenate((m * self.gains[:1], gained)), behind, use)

    @cached_property
    def logs(self) -> Array:
        """Return what every reading adds to twice the negative log of a likelihood beside its square, (N,)."""
        sizes = self.corrections[1]
        return 2.0 * np.log(np.where(sizes > 0.0, sizes, 1.0))


def innovations(wander: Wander) -> Callable[[NDArray[np.float64], Mask], NDArray[np.float64]]:
    """Return the filter at work from the first reading on, chunk by chunk.

    Values (n, ...) per noise, and which of them are in use, become those in use, white.
    """
    (pulls, sizes), at, states = wander.corrections, 0, np.empty((0, 0, 0))

    def run(values: NDArray[np.float64], use: Mask) -> NDArray[np.float64]:
        nonlocal at, states
        wide = np.ascontiguousarray(values.reshape(values.shape[0], -1))
        (columns, order), abreast = (wide.shape[1], pulls.shape[1]), wide.shape[1] > FEW
        if abreast:
            wide = np.pad(wide, ((0, 0), (0, -columns % WIDTH)))
        shape: tuple[int, ...] = (wide.shape[1] // WIDTH, order, WIDTH) if abreast else (order, columns)
        if states.shape != shape:
            states = np.zeros(shape)
        here, white = slice(at, at + wide.shape[0]), np.empty_like(wide)
        follow: Callable[..., None] = kernels.followed_abreast if abreast else kernels.followed
        follow(wander.keeps[here], *wander.system, pulls[here], sizes[here], wide, states, white)
        at = here.stop
        return np.asarray(white[use, :columns].reshape(-1, *values.shape[1:]))

    return run
