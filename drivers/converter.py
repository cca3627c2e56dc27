"""How do codes and voltages correspond in a DAC or an ADC?"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.device import Capabilities

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
        return (1 << (self.bits - 1)) - 1

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
    """Return the output converter of a device with these capabilities."""
    return Converter(can.output_low_v, can.output_high_v, can.output_bits)


def adc(can: Capabilities) -> Converter:
    """Return the input converter of a device with these capabilities."""
    return Converter(can.input_low_v, can.input_high_v, can.input_bits)
