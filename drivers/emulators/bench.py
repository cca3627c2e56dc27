"""What stands behind every simulated device: DAC, the simulated rig, ADC?"""

import math

import numpy as np
from numpy.typing import NDArray

from drivers.converter import Codes, adc, dac
from identify.simulate import SUBSTEPS, Player
from rig.device import Capabilities
from rig.rigfile import RigFile

WIRED = ("y", "u_measured", "v", "w")
"""What the inputs of a simulated device are wired to: the answer, its own output, the signals before and behind F."""


class Bench:
    """A rig between a DAC and an ADC: codes in, codes out, state kept from block to block.

    Where the rig file has an amplifier, it stands between DAC and rig.
    """

    def __init__(self, rig: RigFile, can: Capabilities) -> None:
        """Wire the rig, with what its file conceals, to converters of the device's resolution. Raises FileError."""
        self._model, self._amplifier = rig.simulated(), rig.amplifier
        self.dac, self.adc, self._can = dac(can), adc(can), can
        self._player: Player | None = None

    def reset(self, rate_hz: float, seed: int, inputs: int = 1) -> None:
        """Put the rig at rest, as after a long pause, and set rate, noise and number of inputs for the next run."""
        probes, skews = ("G1", "F")[:max(0, inputs - 2)], self._can.skews(inputs)
        substeps = SUBSTEPS if not any(skews) else inputs * math.ceil(SUBSTEPS / inputs)
        lags = tuple(round(substeps * skew) for skew in (skews[0], *skews[2:]))
        self._player = Player(self._model, rate_hz, seed=seed, substeps=substeps, probes=probes, lags=lags)
        self._inputs, self._put_out_v = inputs, 0.0

    def play(self, codes: NDArray[np.integer]) -> Codes:
        """Return what the ADC reads (N, inputs) while the DAC puts out ``codes`` (N,); y[k] is read before u[k] acts.

        So are the other inputs, but for those of a multiplexer, which come later.
        """
        if self._player is None:
            raise RuntimeError("Bench.reset comes before Bench.play")
        v = self.dac.volts(codes)
        u = v if self._amplifier is None else self._amplifier.driven(v)
        read = self._player.probed(u)
        if self._inputs > 1:
            read = np.stack([read[0], self._read_back(u), *read[1:]])
        return np.ascontiguousarray(self.adc.codes(read).T)

    def _read_back(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the output's level, V, just before each of ``u`` acts, or while it is held where read later."""
        if self._can.multiplexed:
            return u
        before = np.concatenate([[self._put_out_v], u[:-1]]) if u.size else u
        self._put_out_v = float(u[-1]) if u.size else self._put_out_v
        return before
