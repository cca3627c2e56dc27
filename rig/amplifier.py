"""What is u where an amplifier stands between the device's output and the rig?

The rig file says ``amplifier: {gain: 10, range: 10 V}``. From then on u is the voltage behind the amplifier: in
protocols, limits, recordings and models. The address of a device carries its amplifier along, as in
``redpitaya:TCPIP::HOST::5000::SOCKET#amplifier=10,10``: whoever reaches the device, a guardian too, means volts at the
rig.
"""

from dataclasses import dataclass

import numpy as np

from rig.block import Array
from rig.errors import UsageError

MARK = "#amplifier="


@dataclass(frozen=True)
class Amplifier:
    """An amplifier of ``gain`` V/V, which may be negative; its output ends at plus and minus ``range_v``."""

    gain: float
    range_v: float

    def __post_init__(self) -> None:
        """Refuse what no amplifier is; raise ValueError."""
        if not (np.isfinite(self.gain) and self.gain != 0.0 and np.isfinite(self.range_v) and self.range_v > 0.0):
            raise ValueError("an amplifier has a gain other than 0 and a range above 0 V")

    def driven(self, v: Array) -> Array:
        """Return the voltage behind the amplifier, V, that ``v`` before it makes."""
        return np.asarray(np.clip(self.gain * v, -self.range_v, self.range_v), dtype=np.float64)


def behind(address: str, amplifier: Amplifier | None) -> str:
    """Return the address of the same device with the amplifier that stands behind it; one it has already stays."""
    if amplifier is None or MARK in address:
        return address
    return f"{address}{MARK}{amplifier.gain!r},{amplifier.range_v!r}"


def parted(address: str) -> tuple[str, Amplifier | None]:
    """Return the address of the device itself, and its amplifier; raise UsageError for one that is none."""
    bare, mark, told = address.partition(MARK)
    if not mark:
        return address, None
    try:
        gain, range_v = (float(part) for part in told.split(","))
        return bare, Amplifier(gain, range_v)
    except ValueError as error:
        raise UsageError("not an amplifier", where=address, value=told, allowed="#amplifier=GAIN,RANGE in V/V and V",
                         do="write, say, #amplifier=10,10") from error
