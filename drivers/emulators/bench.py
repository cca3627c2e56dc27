"""What stands behind every simulated device: DAC, the simulated rig, ADC?"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.simulate import Player
from rig.device import Capabilities
from rig.rigfile import RigFile

Array = NDArray[np.float64]
Codes = NDArray[np.int32]


@dataclass(frozen=True)
class Converter:
    """A DAC or ADC with symmetric codes -(2^(bits-1) - 1) ... 2^(bits-1) - 1 over [low_v, high_v]; 0 is mid-range."""

    low_v: float
    high_v: float
    bits: int

    @property
    def top(self) -> int:
        """Return the largest code."""
        return int(2 ** (self.bits - 1)) - 1

    @property
    def lsb_v(self) -> float:
        """Return the step in V."""
        return (self.high_v - self.low_v) / (2 * self.top)

    @property
    def middle_v(self) -> float:
        """Return the voltage of code 0."""
        return 0.5 * (self.low_v + self.high_v)

    def codes(self, volts: Array) -> Codes:
        """Return the codes of ``volts``, those beyond the range at its ends."""
        return np.clip(np.rint((volts - self.middle_v) / self.lsb_v), -self.top, self.top).astype(np.int32)

    def volts(self, codes: NDArray[np.integer]) -> Array:
        """Return the voltages of ``codes``."""
        return np.asarray(codes * self.lsb_v + self.middle_v, dtype=np.float64)

    def clipped(self, codes: NDArray[np.integer]) -> bool:
        """Return whether any code is at an end of the range."""
        return bool(codes.size and np.abs(codes).max() >= self.top)


def dac(can: Capabilities) -> Converter:
    """Return the output converter a device with these capabilities has."""
    return Converter(can.output_low_v, can.output_high_v, can.output_bits)


def adc(can: Capabilities) -> Converter:
    """Return the input converter a device with these capabilities has."""
    return Converter(can.input_low_v, can.input_high_v, can.input_bits)


class Bench:
    """A rig between a DAC and an ADC: codes in, codes out, state kept from block to block."""

    def __init__(self, rig: RigFile, can: Capabilities) -> None:
        """Wire the rig, with the physics its file conceals, to converters of the device's resolution."""
        self._model = replace(rig.model, physics=(*rig.model.physics, *rig.concealed))
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
