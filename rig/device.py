"""What must every device do, and what is checked before anything reaches its output?

A driver subclasses ``Device`` and fills the underscore methods. The public methods are final: they own the checks, the
limits, the deadlines and the log, so that no driver can forget them. y[k] is read just before u[k] acts.
"""

import logging
import time
from abc import ABC, abstractmethod
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext, suppress
from types import TracebackType
from typing import TYPE_CHECKING, ClassVar, Self, final

import numpy as np

from identify.trace import Samples, frozen
from rig.block import Array, Block, Flag
from rig.capabilities import Capabilities, Identity
from rig.errors import DeviceError, RefusedError
from rig.output_limits import check_level, check_samples
from rig.ownership import Claim
from rig.plausible import impossible
from rig.signals import altered, extremes

if TYPE_CHECKING:
    from rig.guardian import Guardian
    from rig.plan import Limits

__all__ = ["Array", "Block", "Capabilities", "Device", "Flag", "Identity", "Samples"]

log = logging.getLogger(__name__)

POLL_S = 0.1
"""Longest time a stream keeps its caller waiting before it yields an empty block."""
STALL_S = 3.0
"""Silence after which a stream is given up, beyond two sample periods."""
RATE_TOLERANCE = 1e-9
"""Relative; a rate further from the achievable one is refused rather than silently replaced."""


class Device(ABC):
    """A DAQ with one analogue output and one or more analogue inputs on one clock.

    Connecting outputs nothing. Use as a context manager; leaving it closes the link and does not touch the output.
    ``held`` is let go of, last first, once the link is closed; ``claim`` is the lock on the port, where there is one.
    A ``guardian``, once posted (``rig/guardian.py``), watches over all that is output.
    """

    emulator: ClassVar[str] = ""  # module:function that offers such a device in front of a rig, rig.emulation.Serve
    hardware: ClassVar[bool] = True
    before_amplifier: ClassVar[bool] = True  # an amplifier of the rig is behind its output; a recording knows u there

    def __init__(self) -> None:
        """Prepare the bookkeeping; drivers call this first."""
        self._known: tuple[Identity, Capabilities] | None = None
        self._closed = False
        self.address = ""
        self.claim: Claim | None = None
        self.guardian: Guardian | None = None
        self.held = ExitStack()
        self._inputs = 1

    @classmethod
    @abstractmethod
    def connect(cls, where: str) -> "Device":
        """Return the device at ``where``, the address after ``scheme:``; raise DeviceError or UsageError."""

    @classmethod
    def port(cls, where: str) -> str | None:
        """Return the port at ``where`` in one spelling, None for a device that lives in this program.

        A port has one owner at a time, and its output stays on when this program dies: it gets a guardian.
        """
        return f"{cls.__module__}.{cls.__qualname__}:{where}"

    @classmethod  # noqa: B027
    def warm_up(cls) -> None:
        """Load what connecting needs and open nothing: a guardian has no time for that once it must act."""

    @classmethod
    def attached(cls) -> tuple[str, ...]:
        """Return the ``where`` of every such device that may be attached now, without opening any."""
        return ()

    @classmethod
    def simulated(cls, rig: str, speed: float = 1.0) -> AbstractContextManager[str]:
        """Give the ``where`` of such a device in front of the rig in the file ``rig``, simulated, while it is used."""
        from rig.emulation import offered

        return offered(cls.emulator, rig, speed)

    @final
    def identity(self) -> Identity:
        """Return who the device is, asked of the device."""
        return self._facts()[0]

    @final
    def capabilities(self) -> Capabilities:
        """Return what the device can do, asked of the device."""
        return self._facts()[1]

    @final
    def achievable_rate(self, rate_hz: float) -> float:
        """Return the rate in Hz nearest to ``rate_hz`` that the clock can make; raise RefusedError out of range."""
        can = self.capabilities()
        if not can.min_rate_hz <= rate_hz <= can.max_rate_hz:
            raise RefusedError("the device cannot sample at this rate", value=f"{rate_hz:g} Hz",
                               allowed=f"{can.min_rate_hz:g} to {can.max_rate_hz:g} Hz", do="change acquisition.rate")
        return self._achievable_rate(rate_hz)

    @final
    def quantise(self, u: Samples) -> Samples:
        """Return ``u`` (N,), V, as the DAC puts it out: rounded to its codes. Raise RefusedError out of its range."""
        u, can = frozen(u), self.capabilities()
        slack = 0.5 * can.output_lsb_v
        ends = extremes(u) if u.size else None
        if ends and not (ends.low_v >= can.output_low_v - slack and ends.high_v <= can.output_high_v + slack):
            raise RefusedError("the output is out of the device's range", value=f"{ends.low_v:g} to {ends.high_v:g} V",
                               allowed=f"{can.output_low_v:g} to {can.output_high_v:g} V")
        return altered(u, self._quantise)

    @final
    def check(self, u: Samples, rate_hz: float, limits: "Limits", safe_level_v: float = 0.0, inputs: int = 1,
              ) -> Samples:
        """Return ``u`` as it would be put out, or raise RefusedError; outputs nothing.

        Refused are: a sample or the safe level beyond what plan and device both allow, too steep a slope, a rate the
        clock cannot make, more ``inputs`` than there are, a run longer than the device's memory.
        """
        can = self.capabilities()
        check_samples(u, rate_hz, limits, can)
        check_level(safe_level_v, limits, can, name="safe level")
        self._check_rate(rate_hz)
        self._check_inputs(inputs, rate_hz)
        if can.max_samples is not None and u.size > can.max_samples:
            raise RefusedError("the run is too long for the device", value=f"{u.size} samples",
                               allowed=f"at most {can.max_samples}", do="shorten the protocol or lower the rate")
        samples = self.quantise(u)
        check_samples(samples, rate_hz, limits, can)
        self._accept(samples, rate_hz)
        return frozen(samples)

    @final
    def stream(self, u: Samples, rate_hz: float, limits: "Limits", safe_level_v: float = 0.0, ramp_s: float = 0.1,
               inputs: int = 1) -> Iterator[Block]:
        """Check ``u`` (N,), V, then play it once while reading y; return the blocks of y in order of time.

        With ``inputs`` above 1 every block also has what inputs 2 to ``inputs`` read. A long ``u`` goes by slices.

        Raises RefusedError before anything is output. The iterator yields an empty block when nothing arrived for
        ``POLL_S``, and raises DeviceError when the device fails or falls silent. When left early it stops the clock;
        the output then holds its level until ``safe``. A device with a watchdog returns to ``safe_level_v`` within
        ``ramp_s`` by itself when the host falls silent.
        """
        samples = self.check(u, rate_hz, limits, safe_level_v, inputs)
        log.info("stream %d samples at %g Hz", samples.size, rate_hz)
        return self._blocks(samples, rate_hz, safe_level_v, ramp_s, inputs)

    @final
    def safe(self, level_v: float = 0.0, ramp_s: float = 0.1) -> None:
        """Stop whatever plays and bring the output to ``level_v`` in a ramp of ``ramp_s``; return when it is there.

        Raises RefusedError for a level the device cannot make, DeviceError when the device does not confirm.
        """
        check_level(level_v, None, self.capabilities(), name="safe level")
        if not (np.isfinite(ramp_s) and ramp_s >= 0):
            raise RefusedError("not a ramp time", value=f"{ramp_s} s", allowed="0 s or more")
        log.info("ramp to %g V in %g s", level_v, ramp_s)
        with nullcontext() if self.guardian is None else self.guardian.over(level_v, ramp_s):
            self._safe(float(level_v), float(ramp_s))

    @final
    def level_v(self) -> float | None:
        """Return the level now at the output in V, read back; None when nothing was output or it cannot be told."""
        return self._level_v()

    @final
    def played(self) -> int | None:
        """Return how many samples of the last run were put out at least; None when the device does not tell."""
        return self._played()

    @final
    def close(self) -> None:
        """Release the link; closing twice is harmless. Does not touch the output."""
        if not self._closed:
            self._closed = True
            with self.held:
                self._close()

    @final
    def __enter__(self) -> Self:
        """Return the device itself."""
        return self

    @final
    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None,
                 ) -> None:
        """Close the link."""
        self.close()

    def _facts(self) -> tuple[Identity, Capabilities]:
        """Return identity and capabilities, asked once a connection; raise DeviceError for what cannot be."""
        if self._known is None:
            who, can = self._identity(), self._capabilities()
            if (wrong := impossible(can)) is not None:
                raise DeviceError("the device describes itself badly", where=str(who), value=wrong,
                                  do="update its firmware, or see that the address is that of this device")
            self._known = (who, can)
        return self._known

    def _check_rate(self, rate_hz: float) -> None:
        """Raise RefusedError when the clock makes another rate than ``rate_hz``."""
        made = self.achievable_rate(rate_hz)
        if abs(made - rate_hz) > RATE_TOLERANCE * rate_hz:
            raise RefusedError("the device's clock cannot make this rate", value=f"{rate_hz!r} Hz",
                               allowed=f"{made!r} Hz is the nearest", do="plan the protocol for that rate")

    def _check_inputs(self, inputs: int, rate_hz: float) -> None:
        """Raise RefusedError when the device has fewer than ``inputs``, or cannot read them all at this rate."""
        can = self.capabilities()
        if not 1 <= inputs <= can.inputs:
            raise RefusedError("the device has not so many inputs", value=f"{inputs}", allowed=f"1 to {can.inputs}",
                               do="change acquisition.inputs")
        if can.max_total_rate_hz is not None and inputs * rate_hz > can.max_total_rate_hz * (1 + RATE_TOLERANCE):
            raise RefusedError("the device cannot read so many inputs at this rate", value=f"{inputs} x {rate_hz:g} Hz",
                               allowed=f"{can.max_total_rate_hz:g} Hz over all inputs",
                               do="lower acquisition.rate or take fewer acquisition.inputs")

    def _blocks(self, samples: Samples, rate_hz: float, safe_level_v: float, ramp_s: float, inputs: int,
                ) -> Iterator[Block]:
        """Yield the blocks of one run in order, under the deadline; stop the clock however the run ends."""
        expected, patience_s = 0, STALL_S + 2 / rate_hz
        self._inputs = inputs
        with self._halted_afterwards():
            if self.guardian is not None:
                self.guardian.arm(safe_level_v, ramp_s)
            self._begin(samples, rate_hz, safe_level_v, ramp_s)
            deadline = time.monotonic() + patience_s
            while expected < samples.size:
                block = self._read(POLL_S)
                if block is not None:
                    expected = self._following(block, expected, samples.size)
                    deadline = time.monotonic() + patience_s
                elif time.monotonic() > deadline:
                    raise DeviceError("the device fell silent", where=str(self.identity()),
                                      value=f"{expected} of {samples.size} samples after {patience_s:.3g} s of waiting")
                yield block or Block(expected, np.empty(0))

    @contextmanager
    def _halted_afterwards(self) -> Iterator[None]:
        """Stop the clock on the way out; a device that failed may fail here again, and the first failure is told."""
        second_failure: AbstractContextManager[None] = nullcontext()
        try:
            yield
        except DeviceError:
            second_failure = suppress(DeviceError)
            raise
        finally:
            with second_failure:
                self._halt()

    def _following(self, block: Block, expected: int, size: int) -> int:
        """Return the index after ``block``; raise DeviceError when it does not follow the block before."""
        if block.y.size and block.further.shape[0] != self._inputs - 1:
            raise DeviceError("the device sent other inputs than were asked for", where=str(self.identity()),
                              value=f"{1 + block.further.shape[0]} inputs", allowed=f"{self._inputs}")
        if block.start < expected or block.stop > size:
            raise DeviceError("the device sent samples out of order", where=str(self.identity()),
                              value=f"samples {block.start} to {block.stop}", allowed=f"{expected} to {size}")
        return block.stop

    def _quantise(self, u: Array) -> Array:
        """Return ``u`` rounded to symmetric two's complement codes; drivers with another coding override this."""
        lsb = self.capabilities().output_lsb_v
        middle = 0.5 * (self.capabilities().output_low_v + self.capabilities().output_high_v)
        return np.asarray(np.rint((u - middle) / lsb) * lsb + middle, dtype=np.float64)

    def _accept(self, u: Samples, rate_hz: float) -> None:  # noqa: B027 - most have no reason of their own
        """Raise RefusedError for checked and quantised samples that a device has its own reason not to play."""

    def _played(self) -> int | None:
        """Return how many samples of the last run are known to have been put out; drivers that know override this."""
        return None

    @abstractmethod
    def _identity(self) -> Identity:
        """Ask the device who it is."""

    @abstractmethod
    def _capabilities(self) -> Capabilities:
        """Ask the device what it can do."""

    @abstractmethod
    def _achievable_rate(self, rate_hz: float) -> float:
        """Return the nearest rate the clock makes; ``rate_hz`` is within the capabilities."""

    @abstractmethod
    def _begin(self, u: Samples, rate_hz: float, safe_level_v: float, ramp_s: float) -> None:
        """Load the checked and quantised ``u``, by slices where it is long; start the clock and read ``_inputs``."""

    @abstractmethod
    def _read(self, timeout_s: float) -> Block | None:
        """Return the next samples, or None when none arrived in ``timeout_s``; a lost tail is an empty block at N."""

    @abstractmethod
    def _halt(self) -> None:
        """Stop the clock, hold the output; harmless when it is not running."""

    @abstractmethod
    def _safe(self, level_v: float, ramp_s: float) -> None:
        """Halt, ramp to the level, return when the device confirms it."""

    @abstractmethod
    def _level_v(self) -> float | None:
        """Read back the output level."""

    @abstractmethod
    def _close(self) -> None:
        """Release the link."""
