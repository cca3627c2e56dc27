"""Which devices misbehave as a test wants them to?"""

from collections.abc import Callable
from typing import final

import numpy as np

from rig.device import Array, Block, Capabilities, Device, Flag, Identity

Read = Callable[[int], Block | None]
BLOCK = 100


def following(u: Array, position: int) -> Block:
    """Return the next block of a device that reads back what it puts out."""
    return Block(position, u[position:position + BLOCK])


@final
class ScriptedDevice(Device):
    """A device that keeps a diary and fails where a test puts something else in place of a step."""

    def __init__(self, where: str = "") -> None:
        super().__init__()
        self.diary: list[str] = []
        self.u: Array = np.empty(0)
        self.position = 0
        self.level: float | None = None
        self.put_out: int | None = None
        self.read: Read = lambda position: following(self.u, position)
        self.begin: Callable[[], None] = lambda: None
        self.halt: Callable[[], None] = lambda: None
        self.ramp: Callable[[float], None] = lambda ramp_s: None

    @classmethod
    def connect(cls, where: str) -> "ScriptedDevice":
        return cls(where)

    @classmethod
    def port(cls, where: str) -> None:
        """Return None: it lives in the test."""

    def _identity(self) -> Identity:
        self.diary.append("identity")
        return Identity("scripted", "0", "1")

    def _capabilities(self) -> Capabilities:
        return Capabilities(output_low_v=-10.0, output_high_v=10.0, input_low_v=-10.0, input_high_v=10.0,
                            min_rate_hz=1.0, max_rate_hz=1e5, output_bits=16, input_bits=16, max_samples=10_000,
                            inputs=3, max_total_rate_hz=1.5e5)

    def _achievable_rate(self, rate_hz: float) -> float:
        return 1e6 / round(1e6 / rate_hz)

    def _begin(self, u: Array, rate_hz: float, safe_level_v: float, ramp_s: float) -> None:
        self.diary.append(f"begin {safe_level_v:g} V {ramp_s:g} s")
        self.u, self.position = u, 0
        self.begin()

    def _read(self, timeout_s: float) -> Block | None:
        block = self.read(self.position)
        if block is not None:
            self.position, self.level = block.stop, float(self.u[min(block.stop, self.u.size) - 1])
        return block

    def _halt(self) -> None:
        self.diary.append("halt")
        self.halt()

    def _safe(self, level_v: float, ramp_s: float) -> None:
        self.diary.append(f"safe {level_v:g} V {ramp_s:g} s")
        self.ramp(ramp_s)
        self.level = level_v

    def _played(self) -> int | None:
        return self.put_out

    def _level_v(self) -> float | None:
        return self.level

    def _close(self) -> None:
        self.diary.append("close")


def skipping(device: ScriptedDevice, lost: range, flags: Flag) -> Read:
    """Return a reading that jumps over ``lost``."""

    def read(position: int) -> Block | None:
        if position != lost.start:
            return following(device.u, position)
        return Block(lost.stop, device.u[lost.stop:lost.stop + BLOCK], flags)

    return read
