"""How do codes and voltages correspond in a DAC or an ADC?"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.device import Capabilities, Samples
from rig.errors import RefusedError

Array = NDArray[np.float64]
Codes = NDArray[np.int32]


@dataclass(frozen=True)
class Converter:
    """A DAC or ADC with symmetric codes -(2^(bits-1) - 1) ... 2^(bits-1) - 1 over [low_v, high_v]; 0 is mid-range.

    An ADC ``saturates``. A DAC must not be asked for what it cannot make: this is the last look at what goes out.
    """

    low_v: float
    high_v: float
    bits: int
    saturates: bool

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
        """Return the codes of ``volts``, of an ADC those beyond the range at its ends; raise RefusedError of a DAC."""
        wanted = np.rint((volts - self.middle_v) / self.lsb_v)
        if not self.saturates and not np.all(np.abs(wanted) <= self.top):
            raise RefusedError("the output is out of the converter's range",
                               value=f"{np.min(volts):g} to {np.max(volts):g} V",
                               allowed=f"{self.low_v:g} to {self.high_v:g} V", do="report this: it was checked before")
        return np.clip(wanted, -self.top, self.top).astype(np.int32)

    def volts(self, codes: NDArray[np.integer]) -> Array:
        """Return the voltages of ``codes``."""
        return np.asarray(codes * self.lsb_v + self.middle_v, dtype=np.float64)

    def clipped(self, codes: NDArray[np.integer]) -> bool:
        """Return whether any code is at an end of the range."""
        return bool(codes.size and np.abs(codes).max() >= self.top)


@dataclass(frozen=True)
class Coded:
    """The codes of a long signal ``volts`` (N,), made where they are asked for."""

    volts: Samples
    converter: Converter

    @property
    def size(self) -> int:
        """Return N."""
        return int(self.volts.size)

    def __getitem__(self, at: slice) -> Codes:
        """Return the codes of a stretch."""
        return self.converter.codes(self.volts[at])


def dac(can: Capabilities) -> Converter:
    """Return the output converter of a device with these capabilities."""
    return Converter(can.output_low_v, can.output_high_v, can.output_bits, saturates=False)


def adc(can: Capabilities) -> Converter:
    """Return the input converter of a device with these capabilities."""
    return Converter(can.input_low_v, can.input_high_v, can.input_bits, saturates=True)
