"""How does a rig of the trial bench look from a wire? A device that plays through the independent integrator.

``tests.proof.device:IntegratorDevice:FILE.json`` is its address; the file holds what stands on the bench, concealed
physics included, and only this module reads it. Every run finds the rig at rest and its clock at 0.
"""

import json
from dataclasses import asdict
from pathlib import Path
from typing import final

import numpy as np

from rig.device import Array, Block, Capabilities, Device, Identity
from rig.errors import DeviceError
from tests.proof.bench import answer
from tests.proof.cases import Concealed
from tests.proof.integrator import Grid
from tests.proof.rigs import Rig

BLOCK = 65_536
SUBSTEPS = 128  # follow-ups are short and steep
CAPABILITIES = Capabilities(
    output_low_v=-10.0, output_high_v=10.0, input_low_v=-40.0, input_high_v=40.0,
    min_rate_hz=1.0, max_rate_hz=50e3, output_bits=24, input_bits=24,
)


def stand(path: Path, rig: Rig, physics: tuple[Concealed, ...], seed: int) -> str:
    """Put a rig with its concealed physics behind a file; return the address of the device in front of it."""
    path.write_text(json.dumps({"rig": asdict(rig), "physics": [asdict(p) for p in physics], "seed": seed}))
    return f"{__name__}:{IntegratorDevice.__name__}:{path}"


@final
class IntegratorDevice(Device):
    """A DAQ wired to a rig that no code of the product simulates; noise differs from stimulus to stimulus."""

    def __init__(self, rig: Rig, physics: tuple[Concealed, ...], seed: int) -> None:
        """Wire the rig."""
        super().__init__()
        self._rig, self._physics, self._seed = rig, physics, seed
        self._y, self._sent, self._level = np.empty(0), 0, 0.0

    @classmethod
    def connect(cls, where: str) -> "IntegratorDevice":
        """Return the device on the rig in the file ``where``."""
        try:
            found = json.loads(Path(where).read_text())
        except OSError as error:
            raise DeviceError("no rig stands there", where=where) from error
        numbers = {key: tuple(value) if isinstance(value, list) else value for key, value in found["rig"].items()}
        return cls(Rig(**numbers), tuple(Concealed(**p) for p in found["physics"]), found["seed"])

    def _identity(self) -> Identity:
        return Identity("trial bench", self._rig.name, "1")

    def _capabilities(self) -> Capabilities:
        return CAPABILITIES

    def _achievable_rate(self, rate_hz: float) -> float:
        return rate_hz

    def _begin(self, u: Array, rate_hz: float, safe_level_v: float, ramp_s: float) -> None:
        drawn = np.random.default_rng([self._seed, u.size, int(np.abs(u).sum() * 1e3)])
        noise_v = drawn.normal(0.0, self._rig.noise_v, u.size)
        self._y = answer(self._rig, u, Grid(rate_hz, u.size, SUBSTEPS), self._physics, self._seed, noise_v)
        self._sent, self._level = 0, float(u[-1])

    def _read(self, timeout_s: float) -> Block | None:
        start = self._sent
        self._sent = min(start + BLOCK, self._y.size)
        return Block(start, self._y[start : self._sent])

    def _halt(self) -> None:
        """Stop nothing: what was asked for has been played."""

    def _safe(self, level_v: float, ramp_s: float) -> None:
        self._level = level_v

    def _level_v(self) -> float | None:
        return self._level

    def _close(self) -> None:
        """Release nothing."""
