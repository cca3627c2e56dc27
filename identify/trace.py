"""What was played and what came back: the one form in which data enter identification."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Intersample = Literal["held", "linear", "bandlimited"]


def frozen_array(values: object, dtype: type = np.float64) -> NDArray[np.float64]:
    """Return a read-only one-dimensional copy-free view of ``values``; raise ValueError on another shape."""
    array: NDArray[np.float64] = np.asarray(values, dtype=dtype).view()
    if array.ndim != 1:
        raise ValueError(f"a signal has one dimension, this one has shape {array.shape}")
    array.flags.writeable = False
    return array


@dataclass(frozen=True)
class Step:
    """A stretch of samples [start, stop) with one stimulus; equal labels with different ``repeat`` are repeats."""

    label: str
    kind: str
    start: int
    stop: int
    repeat: int = 0


@dataclass(frozen=True)
class Trace:
    """One recording on a uniform time base.

    ``u`` and ``y`` are in V, shape (N,). y[k] is read at t[k] = start_s + k / rate_hz, just before u[k] acts.
    ``intersample`` says what u is between samples: held (a DAC), linear or bandlimited (a measured signal).
    ``valid`` is False where a sample was lost; None when every sample is there. ``from_rest`` is False when the rig
    was already in motion at the first sample, so that its state there is unknown.
    """

    name: str
    rate_hz: float
    u: Array
    y: Array
    intersample: Intersample = "held"
    start_s: float = 0.0
    steps: tuple[Step, ...] = ()
    valid: Mask | None = field(default=None)
    from_rest: bool = True

    def __post_init__(self) -> None:
        """Freeze the arrays and refuse what cannot be a recording (ValueError)."""
        object.__setattr__(self, "u", frozen_array(self.u))
        object.__setattr__(self, "y", frozen_array(self.y))
        if self.u.size != self.y.size or self.u.size == 0:
            raise ValueError(
                f"{self.name}: u has {self.u.size} samples and y has {self.y.size}; both must be equal and > 0"
            )
        if not self.rate_hz > 0:
            raise ValueError(f"{self.name}: sample rate is {self.rate_hz} Hz, it must be > 0")

    @property
    def size(self) -> int:
        """Return the number of samples."""
        return int(self.u.size)


def intersample_of(traces: Sequence[Trace]) -> Intersample:
    """Return what u is between samples; ValueError when recordings differ in it."""
    kinds = {trace.intersample for trace in traces}
    if len(kinds) > 1:
        raise ValueError(f"recordings with {' and '.join(sorted(kinds))} inputs cannot be fitted together")
    return next(iter(kinds))
