"""What would the recording be if the rig were exactly this model?"""

import numpy as np

from identify.between import source_voltage
from identify.chain import advance, running
from identify.effects import chain_of
from identify.model import Model
from identify.stage import Block, Grid, Place
from identify.trace import Array, Intersample

SUBSTEPS = 32  # of a simulated rig, whose samples are not known beforehand: with 8 the demo found the steps themselves


class Player:
    """A rig that is played block by block, from rest, with the noise of its model; equal seeds give equal noise.

    ``probes`` are places, as in a report (``G1``), behind which the signal can be had beside y, without noise; ``lags``
    are the substeps after which each of them is read, y the first: none where they are left out.
    """

    def __init__(
        self, model: Model, rate_hz: float, seed: int = 0, start_s: float = 0.0, substeps: int = SUBSTEPS,
        probes: tuple[str, ...] = (), lags: tuple[int, ...] = (), intersample: Intersample = "held",
    ) -> None:  # fmt: skip
        """Start the rig at rest at clock time ``start_s``, behind a DAC that holds its level.

        A u that is measured, no DAC's, is known at the samples alone: it takes one substep. Raises ValueError for
        physics the catalogue has not.
        """
        self._grid = Grid("played", 1.0 / (rate_hz * substeps), substeps, start_s)
        chain = chain_of(model, intersample)
        self._intersample = intersample
        self._runs = chain.begin(self._grid) if probes else [running(chain, self._grid)]
        self._behind = [chain.index(Place.of(place)) for place in probes]
        self._lags = lags or (0,) * (1 + len(probes))
        self._noise_v = model.noise_v or 0.0
        self._random = np.random.default_rng(seed)
        self._played, self._before = 0, 0.0

    def play(self, u: Array) -> Array:
        """Return y, V, shape (N,), for the next N samples of u, V; y[k] is read before u[k] acts."""
        y: Array = self.probed(u)[0]
        return y

    def probed(self, u: Array) -> Array:
        """Return y and the signal at every probe, V, shape (1 + probes, N), for the next N samples of u, V."""
        if u.size == 0:
            return np.empty((1 + len(self._behind), 0))
        substeps = self._grid.substeps
        source = source_voltage(np.asarray(u, dtype=np.float64), self._intersample, substeps, self._before)
        blocks = [Block(source, source, self._played * substeps, self._grid)]
        for run in self._runs:
            blocks.append(advance(run, blocks[-1]))
        self._played, self._before = self._played + u.size, float(u[-1])
        read = [blocks[behind].signal[lag::substeps]
                for behind, lag in zip((-1, *self._behind), self._lags, strict=True)]  # fmt: skip
        read[0] = read[0] + self._noise_v * self._random.standard_normal(u.size)
        return np.stack(read)
