"""How does the answer of a chain change with every searched number, where a residual counts?

The plain chain runs its derivatives beside its signals (tangents). Any other chain is run once more for every
number moved a little; it shares with the unmoved one every stage before the first that differs.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from identify.chain import Chain, advance, grid_of, local_name, running, samples_at_once
from identify.colour import whitening
from identify.derivatives import lane_kernels
from identify.derivatives.lanes import WIDTH
from identify.derivatives.tangents import Scales, Tangents, tangents
from identify.discretise import Matrix
from identify.observe import Observation
from identify.stage import Block, Grid, Run
from identify.trace import Array, Mask

DIFFERENCE = 1e-5  # step of the differences, in search coordinates


@dataclass(frozen=True)
class Sensitivities:
    """Residuals and slopes of one run in units of the noise, chunk by chunk.

    ``chunks`` yields the residual (n,) of the samples that count, and rows (n, m) that are overwritten by the next
    chunk's; ``columns`` says where in a row the slopes of the answer by the searched numbers stand, in their order.
    """

    columns: tuple[int, ...]
    chunks: Iterator[tuple[Array, Matrix]]

    def normal(self) -> tuple[Matrix, Array]:
        """Return J'J and J'r, shapes (p, p) and (p,)."""
        products, right = np.zeros((0, 0)), np.zeros(0)
        for residual, rows in self.chunks:
            if not right.size:
                products, right = np.zeros((rows.shape[1], rows.shape[1])), np.zeros(rows.shape[1])
            if rows.flags.c_contiguous and rows.shape[1] % WIDTH == 0:
                lane_kernels.add_products(rows, products)
            else:
                products += rows.T @ rows
            right += residual @ rows
        full = np.triu(products) + np.triu(products, 1).T
        at = np.array(self.columns, dtype=np.intp)
        return full[np.ix_(at, at)], right[at]

    def slopes(self) -> Matrix:
        """Return the slopes of all samples that count, shape (p, count)."""
        return np.concatenate([rows[:, self.columns].T for _, rows in self.chunks], axis=1)


def sensitivities(
    chain: Chain, scales: Scales, observation: Observation, slopes_on: Observation | None = None
) -> Sensitivities:
    """Return how a run's answer changes with the named values, each taken in steps of its scale.

    What has to be run once more for every value may be run on a coarser grid than the answer: that of ``slopes_on``,
    the same run. Raises ValueError where the chain cannot be simulated.
    """
    followers = {follower: scales[leader] for follower, leader in chain.tied if leader in scales}
    per_noise = {name: scale / observation.noise_v for name, scale in {**scales, **followers}.items()}
    exact = tangents(chain, per_noise, grid_of(observation.trace, observation.substeps))
    if exact is not None:
        at = dict(zip(per_noise, exact.columns, strict=True))
        joined = tuple((at[leader], at[follower]) for follower, leader in chain.tied if follower in followers)
        return Sensitivities(exact.columns[: len(scales)], _from_tangents(exact, observation, joined))
    return Sensitivities(
        tuple(range(len(scales))), _from_differences(chain, scales, observation, slopes_on or observation)
    )


def _from_tangents(
    exact: Tangents, observation: Observation, joined: tuple[tuple[int, int], ...]
) -> Iterator[tuple[Array, Matrix]]:
    """Yield residuals and rows of a chain that runs its derivatives beside its signals.

    ``joined`` are columns of values that others follow, and those of the followers: the derivatives add up.
    """
    white = _whitening(observation)
    for piece in observation.pieces(exact.samples):
        answer, rows = exact.run(piece.entering)
        for leader, follower in joined:
            rows[:, leader] += rows[:, follower]
        yield white((piece.y - answer) / observation.noise_v, rows, piece.use)


def _whitening(observation: Observation) -> Callable[[Array, Matrix, Mask], tuple[Array, Matrix]]:
    """Return what makes residual and rows those of white noise, and leaves out samples that do not count."""
    if observation.colour.white:
        return lambda residual, rows, use: (residual, rows) if use.all() else (residual[use], rows[use])
    of_residual, of_rows = whitening(observation.colour), whitening(observation.colour)
    return lambda residual, rows, use: (of_residual(residual, use), of_rows(rows, use))


def _from_differences(
    chain: Chain, scales: Scales, observation: Observation, slopes_on: Observation
) -> Iterator[tuple[Array, Matrix]]:
    """Yield residuals and rows from one-sided differences, these on the grid of ``slopes_on``."""
    grid = grid_of(observation.trace, slopes_on.substeps)
    base = chain.begin(grid)
    here = {n: chain.values.get(n, chain.values[n.partition("[")[0]]) for n in scales}  # of one run: as of all
    others = [_moved(chain, {name: here[name] + DIFFERENCE * scales[name]}, grid) for name in scales]
    finer = slopes_on.substeps != observation.substeps
    run = running(chain, grid_of(observation.trace, observation.substeps)) if finer else None
    white, every, size = _whitening(observation), grid.substeps, samples_at_once(observation.substeps)
    lines, steps = np.zeros((len(others), 0)), 1.0 / (DIFFERENCE * observation.noise_v)
    for piece, rough in zip(observation.pieces(size), slopes_on.pieces(size), strict=True):
        passed: list[Block] = [rough.entering]
        for stage in base:
            passed.append(advance(stage, passed[-1]))
        answer = passed[-1].signal[::every]
        if lines.shape[1] < answer.size:  # of one number after the other: written and multiplied in long stretches
            lines = np.zeros((len(others), answer.size))
        for line, other in zip(lines[:, : answer.size], others, strict=True):
            np.multiply(other.answer(passed)[::every] - answer, steps, out=line)
        left = piece.y - (run(piece.entering)[:: observation.substeps] if run else answer)
        yield white(left / observation.noise_v, lines[:, : answer.size].T, piece.use)


@dataclass(frozen=True)
class _Moved:
    """A chain of which one number is moved, at work from its ``first`` stage that differs on.

    Of a ``sum`` of weighted shapes that stage runs with what its weights are moved by alone: no other shape is needed.
    """

    first: int
    runs: tuple[Run, ...]
    sum: bool

    def answer(self, passed: Sequence[Block]) -> Array:
        """Return its answer, where the unmoved chain's stages were passed by a block and left others."""
        block, runs = passed[self.first], self.runs
        if self.sum:
            block = block.holding(passed[self.first + 1].signal + (runs[0](block) - block.signal))
            runs = runs[1:]
        for stage in runs:
            block = advance(stage, block)
        return block.signal


def _moved(chain: Chain, values: dict[str, float], grid: Grid) -> _Moved:
    """Return a chain with some values of one stage moved."""
    other = chain.with_values(values)
    first = chain.first_difference(other, grid.run)
    if first == len(chain.stages) or not chain.stages[first].sums:
        return _Moved(first, tuple(other.begin(grid, first)), False)
    stage = chain.stages[first]
    pairs = zip(stage.parameters(), other.of(stage, grid.run), chain.of(stage, grid.run), strict=True)
    moves = {local_name(p.name, grid.run) if p.local else p.name: there - here for p, there, here in pairs}
    return _Moved(first, tuple(chain.with_values(moves).begin(grid, first)), True)
