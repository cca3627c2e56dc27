"""Which memoryless law at a place would explain a residual, judged without simulating a single one?

What follows a place passes on the sum of what it is given, to first order; so the answer to any small law there is a
sum of the answers to hat functions of the level. They are simulated once. What a law would gain is then algebra.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.chain import Chain, advance, grid_of, signals
from identify.observe import Observation
from identify.stage import Block, Place
from identify.trace import Array

AT_ENDS = np.concatenate(([0.0], np.geomspace(3e-4, 0.1, 12)))  # of the range: a limit may only just be met
BETWEEN = np.linspace(0.1, 0.9, 17)[1:-1]
TOO_LARGE = 0.1  # best size of a change over its own, below which its shape says nothing of a smaller one
SMALL = 1e-3  # of the range of the level: the height at which hats are passed on
ROUNDED = 1e-9  # of a level: by less than that rounding alone may change it

Law = Callable[[Array, Mapping[str, float]], Array]
"""What becomes of a level, V, at values by short name."""


@dataclass(frozen=True)
class Levels:
    """Levels at which a law is known, straight between, and chi-squared as a quadratic form of its changes there."""

    knots: Array
    matrix: NDArray[np.float64]
    right: Array

    def gain(self, change: Array) -> float:
        """Return the fall of chi-squared when the level changes by ``change`` (V) at the knots."""
        return float(change @ (2.0 * self.right - self.matrix @ change))

    def best(self, law: Law, options: Sequence[Mapping[str, float]]) -> dict[str, float]:
        """Return the option whose law has most merit; empty when none has any."""
        if not options:
            return {}
        changes = np.array([law(self.knots, values) - self.knots for values in options])
        along, energy = changes @ self.right, np.einsum("ij,ij->i", changes @ self.matrix, changes)
        merits = [merit(2.0 * a - e, a, e) for a, e in zip(along.tolist(), energy.tolist(), strict=True)]
        best = int(np.argmax(merits))
        return {name: float(value) for name, value in options[best].items()} if merits[best] > 0.0 else {}


def merit(gain: float, along: float, energy: float) -> float:
    """Return the mean of a change's gain, where it is one, and of the gain at its best size, where it points forward.

    ``along`` and ``energy`` are its products with the residual and with itself. A start need not have the right size:
    that is the first thing a fit finds.
    """
    if not (0.0 < energy < float("inf") and along > TOO_LARGE * energy):
        return 0.0
    return 0.5 * (max(gain, 0.0) + along * along / energy)


def knots_between(low: float, high: float) -> Array:
    """Return levels from low to high, closer and closer to one another at the ends."""
    return np.asarray(low + (high - low) * np.concatenate((AT_ENDS, BETWEEN, 1.0 - AT_ENDS[::-1])))


def hats(chain: Chain, place: Place, knots: Array, observation: Observation) -> NDArray[np.float64]:
    """Return the answers to hat functions of the level behind ``place``, V/V, where samples count, shape (K, n).

    A law of a level that never changes, as behind a gap that is stuck, is an offset: none of them is answered.
    """
    coarse = replace(observation, substeps=1, left_out=None)
    at = chain.index(place)
    level = signals(chain, coarse.trace)[at - 1]
    height = SMALL * float(knots[-1] - knots[0])
    if height <= SMALL * ROUNDED * float(np.max(np.abs(knots))):
        return np.zeros((knots.size, np.count_nonzero(coarse.use)))
    rest = _passed_on(chain, at, level, coarse)
    return np.array([
        (_passed_on(chain, at, level + height * np.interp(level, knots, hat), coarse) - rest)[coarse.use] / height
        for hat in np.eye(knots.size)
    ])  # fmt: skip


def _passed_on(chain: Chain, first: int, signal: Array, observation: Observation) -> Array:
    """Return the answer of the stages from ``first`` on to a signal at the sample instants."""
    grid = grid_of(observation.trace)
    block = Block(signal, observation.source[0 : signal.size], 0, grid)
    for run in chain.begin(grid, first):
        block = advance(run, block)
    return block.signal
