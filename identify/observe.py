"""What a fit looks at: a trace, which of its samples count, how noisy they are, and how finely to simulate it."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identify.between import source_of
from identify.chain import Chain, answered, chunks, grid_of, running, samples_at_once, simulate
from identify.colour import WHITE, Colour, whitening
from identify.stage import Block
from identify.trace import Array, Mask, Samples, Trace, blocks, regrouped

FINEST = 32  # instants to a sample, at most
FINER = 8  # instants to one: an error that falls with the step, or its square, is that less an eighth at most
SEEN = 1.0  # standard deviations of a matched test that stepping may be wrong by where candidates are compared
LARGEST = 1 << 30  # instants of a run, at most: bounds time


@dataclass(frozen=True)
class Piece:
    """A stretch of whole samples: what enters the chain, the readings in V, and which of them count.

    What the grid leaves out of an answer is taken from the readings.
    """

    entering: Block
    y: Array
    use: Mask

    def used(self, signal: Array) -> Array:
        """Return the readings' instants that count of a signal on the piece's grid."""
        return signal[:: self.entering.grid.substeps][self.use]

    def misfit(self, answer: Array) -> Array:
        """Return reading less answer where it counts, V, from the chain's answer at every instant."""
        return np.asarray((self.y - answer[:: self.entering.grid.substeps])[self.use])


@dataclass(frozen=True, eq=False)
class Observation:
    """One trace with ``use`` (N,) True where a residual counts, and the noise of one sample in V.

    ``left_out`` (N,) is what a fine grid adds to an answer on this one, in units of the noise (identify.stepping);
    None for nothing. ``colour`` says how the noise of a sample hangs together with that of those before. ``scatter`` is
    what noise leaves of a sample of this run on average, over ``noise_v`` squared.
    """

    trace: Trace
    use: Mask
    noise_v: float
    substeps: int = 1
    left_out: NDArray[np.float16 | np.float32] | None = None
    colour: Colour = WHITE
    scatter: float = 1.0

    @cached_property
    def source(self) -> Samples:
        """Return the source voltage just before each instant."""
        return source_of(self.trace, self.substeps)

    @cached_property
    def count(self) -> int:
        """Return how many samples count."""
        return int(np.count_nonzero(self.use))

    @property
    def expected(self) -> float:
        """Return what chi-squared is on average where nothing but noise is left."""
        return self.scatter * self.count

    def until(self, size: int) -> "Observation":
        """Return what there is up to sample ``size``; itself when that is all."""
        if size >= self.trace.size:
            return self
        left_out = None if self.left_out is None else self.left_out[:size]
        return replace(self, trace=self.trace.until(size), use=self.use[:size], left_out=left_out)

    def pieces(self, samples: int | None = None) -> Iterator[Piece]:
        """Yield the run from its beginning, a chunk of samples at a time: whoever walks it needs memory for one."""
        grid = grid_of(self.trace, self.substeps)
        for block in chunks(self.source, grid, samples):
            at = slice(block.first // grid.substeps, (block.first + block.signal.size) // grid.substeps)
            yield Piece(block, self._readings(at), self.use[at])

    def _readings(self, at: slice) -> Array:
        """Return the readings less what the grid leaves out of an answer, V."""
        if self.left_out is None:
            return self.trace.y[at]
        return np.asarray(self.trace.y[at] - self.noise_v * self.left_out[at].astype(np.float64))

    def misfits(self, chain: Chain) -> Iterator[Array]:
        """Yield the residual of the samples that count, V, chunk by chunk."""
        run = running(chain, grid_of(self.trace, self.substeps))
        return (piece.misfit(run(piece.entering)) for piece in self.pieces())

    def whitened(self, chain: Chain) -> Iterator[Array]:
        """Yield the residual of the samples that count as a fit weighs it: white, of rms one, chunk by chunk."""
        run, white = running(chain, grid_of(self.trace, self.substeps)), whitening(self.colour)
        for piece in self.pieces():
            answer = run(piece.entering)[:: piece.entering.grid.substeps]
            yield white((piece.y - answer) / self.noise_v, piece.use)

    def deviations(self) -> Iterator[Array]:
        """Yield by how much the readings that count differ from their mean, V, chunk by chunk."""
        used = [slice(*ab) for ab in blocks(0, self.trace.size)]
        mean = sum(float(np.sum(self.trace.y[at][self.use[at]])) for at in used) / self.count
        return (self.trace.y[at][self.use[at]] - mean for at in used)

    def residual(self, chain: Chain) -> Array:
        """Return y minus the chain's answer, V, shape (N,)."""
        return np.asarray(self._readings(slice(None)) - simulate(chain, self.trace, self.substeps))

    def masked_residual(self, chain: Chain) -> Array:
        """Return y minus the chain's answer, V, shape (N,), zero where a sample does not count."""
        return np.where(self.use, self.residual(chain), 0.0)

    def used_residual(self, chain: Chain) -> Array:
        """Return the residual of the samples that count, shape (count,)."""
        return self.residual(chain)[self.use]


def weighed(rows: NDArray[np.float64], observation: Observation) -> NDArray[np.float64]:
    """Return rows of the samples that count, V, shape (m, count), as a fit weighs them: per noise, made white."""
    white = whitening(observation.colour)
    if not observation.colour.of_one_run:
        return np.asarray(white(rows.T / observation.noise_v, np.ones(rows.shape[1], dtype=np.bool_)).T)
    whole = np.zeros((observation.use.size, rows.shape[0]))
    whole[observation.use] = rows.T / observation.noise_v
    return np.asarray(white(whole, observation.use).T)


def joined(observations: Iterable[Observation]) -> tuple[Observation, ...]:
    """Return one observation a run, of all samples that are used in any of its parts, on the finest of their grids."""
    whole: dict[str, Observation] = {}
    for part in observations:
        seen = whole.get(part.trace.name, part)
        finest = max(seen.substeps, part.substeps)
        whole[part.trace.name] = replace(seen, use=seen.use | part.use, substeps=finest)
    return tuple(whole.values())


def rms(values: Array) -> float:
    """Return the root mean square; 0 for no values."""
    return float(np.sqrt(np.mean(np.square(values)))) if values.size else 0.0


def pooled_rms(parts: Iterable[Array]) -> float:
    """Return the root mean square over all parts together; 0 for no values."""
    total, count = 0.0, 0
    for values in regrouped(parts):
        total, count = total + float(np.sum(np.square(values))), count + values.size
    return float(np.sqrt(total / count)) if count else 0.0


def over_noise(chain: Chain, observations: Sequence[Observation]) -> float:
    """Return the rms of what a chain leaves, as a fit weighs it, over what noise alone would leave; 0 of nothing."""
    left = sum(float(white @ white) for o in observations for white in o.whitened(chain))
    expected = sum(o.expected for o in observations)
    return float(np.sqrt(left / expected)) if expected else 0.0


def refined(observation: Observation, chain: Chain) -> Observation:
    """Return the observation on the coarsest grid whose stepping error cannot be seen in its noise.

    The difference to one so much finer that it shows nearly all of that error, summed over the run as a matched test
    would, stays below ``SEEN`` standard deviations.
    """
    finest = min(FINEST, 1 << max(int(np.log2(LARGEST / observation.trace.size)), 1))
    substeps = observation.substeps
    while substeps < finest and _is_seen(observation, chain, substeps, min(FINER * substeps, finest)):
        substeps *= 2
    if substeps == observation.substeps:
        return observation
    return replace(observation, substeps=substeps, left_out=None)


def _is_seen(observation: Observation, chain: Chain, substeps: int, finer: int) -> bool:
    """Return whether the error of stepping reaches SEEN standard deviations; the run is left where it does."""
    answers = (answered(chain, observation.trace, n, samples_at_once(finer)) for n in (substeps, finer))
    total, first, white = 0.0, 0, whitening(observation.colour)
    for coarse, fine in zip(*answers, strict=True):
        error = white((coarse - fine) / observation.noise_v, observation.use[first : first + coarse.size])
        total, first = total + float(error @ error), first + coarse.size
        if total >= SEEN**2:
            return True
    return False
