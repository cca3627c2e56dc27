"""How does the answer of a chain change with every searched number, where a residual counts?

The plain chain runs its derivatives beside its signals (tangents). Any other chain is run once more for every
number moved a little, from the stage that it belongs to on; several go together through what is behind it (moved).
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from identify.chain import Chain, advance, grid_of, local_name, running, samples_at_once
from identify.colour import whitening
from identify.derivatives import lane_kernels
from identify.derivatives.lanes import WIDTH
from identify.derivatives.moved import AT_ONCE, Abreast, Mover, mover, teams
from identify.derivatives.tangents import Scales, Tangents, tangents
from identify.discretise import Matrix
from identify.observe import Observation
from identify.stage import Block, Grid, Run, Shape
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
    return _from_differences(chain, scales, observation, slopes_on or observation)


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
) -> Sensitivities:
    """Return residuals and rows from one-sided differences, these on the grid of ``slopes_on``."""
    grid = grid_of(observation.trace, slopes_on.substeps)
    (base, shapes), movers = chain.begun(grid), dict[str, Mover]()
    owners = {name: i for i, stage in enumerate(chain.stages) for name in stage.names}
    for name, scale in scales.items():
        here = chain.values.get(name, chain.values[name.partition("[")[0]])  # of one run: as of all
        moved = _moved(chain, name, here + DIFFERENCE * scale, grid, shapes, owners)
        if moved is not None:
            movers[name] = moved
    order = sorted(movers, key=lambda name: movers[name].last)  # those that begin together go together
    at = {name: i for i, name in enumerate(order)}
    zero = [] if len(order) == len(scales) else [len(order)]  # one row, of all that changes nothing in this run
    together = list(teams(chain, grid, [movers[name] for name in order], shapes))
    rows = _differences(chain, base, observation, slopes_on, together, len(order) + len(zero))
    return Sensitivities(tuple(at.get(name, len(order)) for name in scales), rows)


def _differences(
    chain: Chain, base: Sequence[Run], observation: Observation, slopes_on: Observation,
    together: Sequence[tuple[slice, Abreast]], count: int,
) -> Iterator[tuple[Array, Matrix]]:  # fmt: skip
    """Yield residuals and rows: of ``count`` columns those that go together are differences, the others zero.

    ``base`` are the stages of the chain on the grid of ``slopes_on``.
    """
    finer = slopes_on.substeps != observation.substeps
    run = running(chain, grid_of(observation.trace, observation.substeps)) if finer else None
    white, every, size = _whitening(observation), slopes_on.substeps, samples_at_once(observation.substeps, AT_ONCE)
    rows, steps = np.zeros((count, 0)), 1.0 / (DIFFERENCE * observation.noise_v)
    for piece, rough in zip(observation.pieces(size), slopes_on.pieces(size), strict=True):
        passed: list[Block] = [rough.entering]
        for stage in base:
            passed.append(advance(stage, passed[-1]))
        answer = passed[-1].signal[::every]
        if rows.shape[1] < answer.size:
            rows = np.zeros((count, answer.size))  # of one number after the other: multiplied in long stretches
        for at, team in together:
            team.write_changes(passed, every, steps, rows[at, : answer.size])
        left = piece.y - (run(piece.entering)[:: observation.substeps] if run else answer)
        yield white(left / observation.noise_v, rows[:, : answer.size].T, piece.use)


def _moved(
    chain: Chain, name: str, value: float, grid: Grid, shapes: Sequence[Shape], owners: Mapping[str, int]
) -> Mover | None:
    """Return what does a stage of which a value is moved, and those of it that follow; None where this run has it not.
    """
    of_all, _, run = name.partition("[")
    of_run = local_name(of_all, grid.run)
    if (run and name != of_run) or (not run and of_run in chain.values):
        return None
    first = owners[of_all]
    stage = chain.stages[first]
    here, moved = chain.of(stage, grid.run), {of_all, *(one for one, leader in chain.tied if leader == of_all)}
    there = tuple(value if n in moved else old for n, old in zip(stage.names, here, strict=True))
    if there == here:
        return None
    if stage.sums:
        there = tuple(one - before for one, before in zip(there, here, strict=True))
    return mover(chain, first, there, stage.sums, grid, shapes)
