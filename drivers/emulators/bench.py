"""What stands behind every simulated device: DAC, the simulated rig, ADC?"""

import numpy as np
from numpy.typing import NDArray

from drivers.converter import Codes, adc, dac
from identify.simulate import Player
from rig.device import Capabilities
from rig.rigfile import RigFile


class Bench:
    """A rig between a DAC and an ADC: codes in, codes out, state kept from block to block."""

    def __init__(self, rig: RigFile, can: Capabilities) -> None:
        """Wire the rig, with what its file conceals, to converters of the device's resolution. Raises FileError."""
        self._model = rig.simulated()
        self.dac, self.adc = dac(can), adc(can)
        self._player: Player | None = None

    def reset(self, rate_hz: float, seed: int) -> None:
        """Put the rig at rest, as after a long pause, and set rate and noise for the next run."""
        self._player = Player(self._model, rate_hz, seed=seed)

    def play(self, codes: NDArray[np.integer]) -> Codes:
        """Return what the ADC reads while the DAC puts out ``codes`` (N,); y[k] is read before u[k] acts."""
        if self._player is None:
            raise RuntimeError("Bench.reset comes before Bench.play")
        return self.adc.codes(self._player.play(self.dac.volts(codes)))
