"""How can a protocol be run with no hardware at all?

The loopback is the device model with no transport and a clock that never waits. It plays a simulated rig: the one in
``protocols/rigs/opamp_backlash.yaml``, or the rig file named in the address, with the physics that file conceals and
its noise. The same protocol gives the same recording; ``?seed=N`` at the end of the address draws other noise.
"""

import zlib
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import final

import numpy as np

import protocols
from drivers.converter import Coded, Codes, dac
from drivers.emulators.bench import WIRED, Bench
from drivers.emulators.device_model import DeviceModel, Hardware, State
from identify.trace import blocks
from rig.device import Block, Capabilities, Device, Flag, Identity, Samples
from rig.errors import FileError, UsageError
from rig.rigfile import RigFile, read_rig

DEFAULT_RIG = "rigs/opamp_backlash.yaml"
BLOCK = 4096
"""Most samples a block: small enough that an abort is prompt."""

CAPABILITIES = Capabilities(
    output_low_v=-10.0, output_high_v=10.0, input_low_v=-20.0, input_high_v=20.0,
    min_rate_hz=0.1, max_rate_hz=1e6, output_bits=16, input_bits=24, inputs=len(WIRED),
)


@final
class LoopbackDevice(Device):
    """A simulated rig on a simulated DAQ, as fast as the computer allows."""

    hardware = False

    def __init__(self, rig: RigFile, seed: int = 0) -> None:
        """Wire the simulated ``rig``; equal seeds and protocols give equal noise."""
        super().__init__()
        self._seed, self._runs, self._now_s = seed, 0, 0.0
        self._codes = Coded(np.empty(0), dac(CAPABILITIES))
        hardware = Hardware(Identity("loopback", rig.model.title, "1"), CAPABILITIES, BLOCK, BLOCK)
        self._model = DeviceModel(hardware, Bench(rig, CAPABILITIES))

    @classmethod
    def connect(cls, where: str) -> "LoopbackDevice":
        """Return the loopback on the rig file at ``where``, a path or empty, optionally followed by ``?seed=N``.

        Raises UsageError on another option, FileError when there is no such rig file or it is not valid.
        """
        path, _, option = where.partition("?")
        return cls(read_rig(rig_path(path)), _seed(option))

    @classmethod
    def port(cls, where: str) -> None:
        """Return None: the loopback is part of this program."""

    @classmethod
    def attached(cls) -> tuple[str, ...]:
        """Return the default rig: the loopback is always there."""
        return ("",)

    @classmethod
    def simulated(cls, rig: str, speed: float = 1.0) -> AbstractContextManager[str]:
        """Give the rig file itself: the loopback is its own emulator, and its clock never waits."""
        return nullcontext(rig)

    def _identity(self) -> Identity:
        return self._model.hardware.identity

    def _capabilities(self) -> Capabilities:
        return self._model.hardware.capabilities

    def _achievable_rate(self, rate_hz: float) -> float:
        return self._model.achievable_rate(rate_hz)

    def _begin(self, u: Samples, rate_hz: float, safe_level_v: float, ramp_s: float) -> None:
        self._codes = Coded(u, dac(CAPABILITIES))
        self._model.arm(u.size, rate_hz, (safe_level_v, ramp_s), self._noise_seed(), self._inputs)
        self._runs += 1

    def _noise_seed(self) -> int:
        """Return a seed that differs between protocols and between runs, and is the same when all is repeated."""
        seed = (self._seed + 1000003 * self._runs) & 0xFFFFFFFF
        for start, stop in blocks(0, self._codes.size):
            seed = zlib.crc32(self._codes[start:stop].tobytes(), seed)
        return seed

    def _read(self, timeout_s: float) -> Block | None:
        start = self._model.played
        self._model.push(start, self._codes[start:start + BLOCK])
        if self._model.state is State.ARMED:
            self._model.go(self._now_s)
            self._start_s = self._now_s
        self._now_s = self._start_s + (self._model.accepted - 1) / self._model.rate_hz
        self._model.advance(self._now_s)
        return self._block(self._model.take(BLOCK))

    def _block(self, taken: tuple[int, Codes] | None) -> Block | None:
        """Return the samples taken from the model in V."""
        if taken is None:
            return None
        converter = self._model.bench.adc
        flags = Flag.CLIPPED if converter.clipped(taken[1]) else Flag.NONE
        y, *further = converter.volts(taken[1].T)
        return Block(taken[0], y, flags, np.array(further)) if further else Block(taken[0], y, flags)

    def _halt(self) -> None:
        self._model.halt(self._now_s)

    def _safe(self, level_v: float, ramp_s: float) -> None:
        self._model.safe(level_v, ramp_s, self._now_s)
        self._now_s += ramp_s
        self._model.advance(self._now_s)

    def _played(self) -> int:
        return self._model.played

    def _level_v(self) -> float | None:
        return self._model.level_v(self._now_s)

    def _close(self) -> None:
        """Release nothing."""


def rig_path(where: str) -> Path:
    """Return the rig file ``where`` names: a path as given, or one beside the protocols; empty means the default.

    Raises FileError naming the rig files there are.
    """
    shipped = Path(protocols.__path__[0])
    for candidate in (Path(where or DEFAULT_RIG), shipped / (where or DEFAULT_RIG)):
        if candidate.is_file():
            return candidate
    known = ", ".join(f"rigs/{path.name}" for path in sorted((shipped / "rigs").glob("*.yaml")))
    raise FileError("no such rig file", where=where or DEFAULT_RIG, allowed=known or "a path to a YAML file",
                    do="give a path, or one of these names")


def _seed(option: str) -> int:
    """Return the N of ``seed=N``, 0 for an empty option; raise UsageError otherwise."""
    name, _, value = option.partition("=")
    if not option:
        return 0
    if name != "seed" or not value.isdecimal():
        raise UsageError("unknown option in a loopback address", value=option, allowed="seed=N with N >= 0")
    return int(value)
