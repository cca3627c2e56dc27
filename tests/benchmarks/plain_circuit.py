"""How near is the circuit of op-amps to the paper's chain within its rails, and what does simulating it cost?

``python -m tests.benchmarks.plain_circuit``: the paper's 50 Hz sine at 9 V, and the staircase of Fig. 13 at 0.7 of its
levels, 100 ms each; both keep w within the circuit's rails at +-10 V, also at the start.
"""

import time

import numpy as np

from drivers.spice import SpiceDevice
from identify.simulate import Player
from identify.trace import Array
from rig.plan import Limits
from rig.rigfile import parse_rig
from tests.rigs import QUIET

RATE_HZ = 10_000.0
LIMITS = Limits(-10.0, 10.0, None)
FIG13_V = np.concatenate([np.arange(-3.0, 3.1, 0.5), np.arange(2.5, -3.6, -0.5)])


def sine(seconds: float, volt: float = 9.0) -> Array:
    """Return 50 Hz from zero."""
    return np.asarray(volt * np.sin(2.0 * np.pi * 50.0 * np.arange(round(seconds * RATE_HZ)) / RATE_HZ))


def staircase(dwell: int, share: float = 0.7) -> Array:
    """Return a share of the levels of Fig. 13, ``dwell`` samples each."""
    return np.repeat(share * FIG13_V, dwell)


def compared(u: Array, address: str = "?noise=0V") -> tuple[dict[str, tuple[Array, Array]], float]:
    """Return y, v and w of circuit and chain, and the seconds that the circuit took a sample."""
    with SpiceDevice.connect(address) as device:
        u, began = device.quantise(u), time.perf_counter()
        read = np.hstack([np.vstack([block.y, *block.further])
                          for block in device.stream(u, RATE_HZ, LIMITS, inputs=4) if block.y.size])
        took_s = (time.perf_counter() - began) / u.size
    player = Player(parse_rig(QUIET, "quiet").simulated(), RATE_HZ, seed=0, substeps=8, probes=("G1", "F"))
    y, v, w = player.probed(u)
    return {"y": (read[0], y), "v": (read[2], v), "w": (read[3], w)}, took_s


def nrmse(circuit: Array, chain: Array) -> float:
    """Return the rms difference over the standard deviation."""
    return float(np.sqrt(np.mean((circuit - chain) ** 2)) / np.std(chain))


def main() -> None:
    """Print a line for each stimulus."""
    print("| stimulus | NRMSE of v | of w | of y | rms of y | s for 1000 samples |\n|---|---|---|---|---|---|")
    for name, u in (("50 Hz, 9 V, 1 s", sine(1.0)), ("staircase, 0.7, 100 ms", staircase(1000))):
        signals, took_s = compared(u)
        errors = " | ".join(f"{nrmse(*signals[signal]):.3%}" for signal in "vwy")
        rms_v = float(np.sqrt(np.mean((signals["y"][0] - signals["y"][1]) ** 2)))
        print(f"| {name} | {errors} | {1e3 * rms_v:.2f} mV | {1e3 * took_s:.2f} |")


if __name__ == "__main__":
    main()
