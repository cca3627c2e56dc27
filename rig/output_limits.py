"""Which samples may reach an output, when plan and device both set limits?"""

from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from identify.trace import Array, Samples, blocks, frozen
from rig.errors import RefusedError

if TYPE_CHECKING:
    from rig.plan import Limits


class OutputRange(Protocol):
    """The part of a device's capabilities that bounds its output."""

    @property
    def output_low_v(self) -> float: ...  # noqa: D102
    @property
    def output_high_v(self) -> float: ...  # noqa: D102
    @property
    def output_lsb_v(self) -> float: ...  # noqa: D102


def narrowest(limits: "Limits", device: OutputRange) -> tuple[float, float]:
    """Return the (low, high) in V that plan and device both allow; raise RefusedError when there is none."""
    low, high = max(limits.low_v, device.output_low_v), min(limits.high_v, device.output_high_v)
    if low > high:
        raise RefusedError(
            "no output level is allowed", value=f"limits {limits.levels}",
            allowed=f"{device.output_low_v:g} to {device.output_high_v:g} V on this device",
            do="change `limits` in the protocol or use another device")
    return low, high


def check_samples(signal: Samples, rate_hz: float, limits: "Limits", device: OutputRange) -> None:
    """Raise RefusedError at the first sample of a signal (N,), V, that is not finite, out of range or too fast.

    Half a step of the DAC is tolerated on a level and a whole one on a slope: quantisation may round either up. A
    signal is looked at by stretches, each together with the last sample before it.
    """
    try:
        signal = frozen(signal)
    except ValueError as error:
        raise RefusedError("nothing to output", value=str(error), allowed="(N,) with N > 0") from error
    if signal.size == 0:
        raise RefusedError("nothing to output", value="no samples", allowed="(N,) with N > 0")
    for start, stop in blocks(0, signal.size):
        first = max(start - 1, 0)
        _check_stretch(signal[first:stop], first, rate_hz, limits, device)


def _check_stretch(u: Array, first: int, rate_hz: float, limits: "Limits", device: OutputRange) -> None:
    """Raise RefusedError for one stretch of a signal, which begins at its sample ``first``."""
    _refuse(~np.isfinite(u), lambda k: f"sample {first + k} is {u[k]}", "finite levels", "correct the protocol")
    low, high = narrowest(limits, device)
    slack = 0.5 * device.output_lsb_v + 1e-12
    _refuse((u < low - slack) | (u > high + slack),
            lambda k: f"{u[k]:.6g} V at sample {first + k} ({(first + k) / rate_hz:.6g} s)",
            f"{low:g} to {high:g} V", "lower the level or widen `limits`, where the rig can take it")
    if limits.slew_v_per_s is not None:
        _check_slope(u, first, rate_hz, limits.slew_v_per_s, device.output_lsb_v, limits.slope)


def _check_slope(u: Array, first: int, rate_hz: float, slew_v_per_s: float, lsb_v: float, allowed: str) -> None:
    """Raise RefusedError where two neighbouring samples differ by more than the slew rate allows."""
    rise = np.abs(np.diff(u))
    too_fast = rise > slew_v_per_s / rate_hz * (1 + 1e-9) + lsb_v
    _refuse(too_fast,
            lambda k: f"{rise[k] * rate_hz:.6g} V/s at sample {first + k + 1} ({(first + k + 1) / rate_hz:.6g} s)",
            allowed, "slow the step down or raise `limits.slew`")


def check_level(level_v: float, limits: "Limits | None", device: OutputRange, *, name: str) -> None:
    """Raise RefusedError unless the constant level called ``name`` is within what plan and device allow."""
    low, high = (device.output_low_v, device.output_high_v) if limits is None else narrowest(limits, device)
    slack = 0.5 * device.output_lsb_v + 1e-12
    if not low - slack <= level_v <= high + slack:
        raise RefusedError(f"the {name} is out of range", value=f"{level_v:g} V", allowed=f"{low:g} to {high:g} V")


def _refuse(bad: NDArray[np.bool_], value: Callable[[int], str], allowed: str, do: str) -> None:
    """Raise RefusedError on the first True of ``bad``, with ``value(index)`` in the message."""
    if bad.any():
        raise RefusedError("the output is refused", value=value(int(np.argmax(bad))), allowed=allowed, do=do)
