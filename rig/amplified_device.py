"""How are a device and the amplifier behind its output one device, to which u is the voltage at the rig?"""

from dataclasses import replace
from typing import final

import numpy as np

from identify.trace import Samples
from rig.amplifier import MARK, Amplifier
from rig.block import Array, Block
from rig.capabilities import Capabilities, Identity
from rig.device import Device
from rig.errors import UsageError
from rig.signals import altered


@final
class AmplifiedDevice(Device):
    """A device and the amplifier behind its output, as one device."""

    def __init__(self, device: Device, amplifier: Amplifier) -> None:
        """Stand in front of ``device``, which is closed with this one."""
        super().__init__()
        self._device, self._amplifier = device, amplifier

    @classmethod
    def connect(cls, where: str) -> "AmplifiedDevice":
        """Refuse: an amplifier has no address of its own."""
        raise UsageError("an amplifier is no device by itself", value=where,
                         do=f"write the device's address and then {MARK}GAIN,RANGE")

    def _identity(self) -> Identity:
        return self._device.identity()

    def _capabilities(self) -> Capabilities:
        can, gain = self._device.capabilities(), self._amplifier.gain
        ends_v = self._amplifier.driven(np.array([can.output_low_v, can.output_high_v]))
        low_v, high_v = sorted(map(float, ends_v))
        return replace(can, output_low_v=low_v, output_high_v=high_v, output_step_v=abs(gain) * can.output_lsb_v)

    def _achievable_rate(self, rate_hz: float) -> float:
        return self._device.achievable_rate(rate_hz)

    def _quantise(self, u: Array) -> Array:
        """Return ``u`` rounded as the device before the amplifier rounds it; -0.0 is 0.0."""
        return np.asarray(self._device.quantise(u / self._amplifier.gain)[:] * self._amplifier.gain + 0.0)

    def _accept(self, u: Samples, rate_hz: float) -> None:
        self._device._accept(self._before(u), rate_hz)

    def _before(self, u: Samples) -> Samples:
        """Return what the device puts out for ``u`` behind the amplifier, V."""
        gain = self._amplifier.gain
        return altered(u, lambda levels: levels / gain)

    def _begin(self, u: Samples, rate_hz: float, safe_level_v: float, ramp_s: float) -> None:
        gain = self._amplifier.gain
        self._device._inputs = self._inputs
        self._device._begin(self._before(u), rate_hz, safe_level_v / gain, ramp_s)

    def _read(self, timeout_s: float) -> Block | None:
        return self._device._read(timeout_s)

    def _halt(self) -> None:
        self._device._halt()

    def _safe(self, level_v: float, ramp_s: float) -> None:
        self._device._safe(level_v / self._amplifier.gain, ramp_s)

    def _level_v(self) -> float | None:
        level_v = self._device.level_v()
        return None if level_v is None else self._amplifier.gain * level_v + 0.0

    def _played(self) -> int | None:
        return self._device.played()

    def _close(self) -> None:
        self._device.close()
