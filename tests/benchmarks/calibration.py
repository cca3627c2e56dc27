"""How often do the intervals of a calibration hold the truth?

``python -m tests.benchmarks.calibration [--count 100] [--seed 0]``: every cable is calibrated so often on the loopback
device through the whole way of `rig calibrate`, each time with other levels and other noise.
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from drivers.loopback import CAPABILITIES, LoopbackDevice
from identify.interval import Interval
from identify.natural_units import shown
from rig.calibrating import Wish, measured_on
from rig.rigfile import parse_rig

RATE_HZ = 4000.0
QUANTITIES = ("delay", "time_constant", "skew", "gain", "offset", "noise", "input_step")
UNITS = ("s", "s", "ppm", "V/V", "V", "V", "V")


@dataclass(frozen=True)
class Case:
    """A cable: times in s, the rest in V; ``hum_v`` is the amplitude of the mains on it."""

    name: str
    delay_s: float
    constant_s: float
    hum_v: float = 0.0
    noise_v: float = 1e-3

    def rig(self) -> str:
        """Return the cable as a rig file."""
        den = f"[{self.constant_s!r}, 1]" if self.constant_s else "[1]"
        hum = f"concealed: {{hum: {{frequency: 50 Hz, amplitude: {self.hum_v!r} V}}}}\n" if self.hum_v else ""
        return (
            f"spec: 1\nrig: {self.name}\nG1: {{num: [1], den: [1]}}\nF: {{linear: {{gain: 1.003, offset: 2 mV}}}}\n"
            f"G2: {{num: [1], den: {den}, dead_time: {self.delay_s!r} s}}\nnoise: {self.noise_v!r} V\n{hum}"
        )

    def truths(self) -> tuple[float, ...]:
        """Return what is true of every quantity, in the order of ``QUANTITIES``."""
        noise_v = float(np.hypot(self.noise_v, self.hum_v / np.sqrt(2.0)))
        return (self.delay_s, self.constant_s, 0.0, 1.003, 2e-3, noise_v, CAPABILITIES.input_lsb_v)


CASES = (
    Case("resistor and capacitor", 237e-6, 2e-4),
    Case("a fast tail", 90e-6, 3e-5),
    Case("a plain cable", 90e-6, 0.0),
    Case("with 2 mV of hum", 237e-6, 2e-4, hum_v=2e-3),
)


def calibrated(case: Case, seed: int) -> tuple[Interval | None, ...]:
    """Return the intervals of one calibration, in the order of ``QUANTITIES``."""
    device = LoopbackDevice(parse_rig(case.rig(), case.name), seed)
    found = measured_on(device, Wish(RATE_HZ, 2.0), lambda sentence, share: None, seed)
    return tuple(getattr(found, name) for name in QUANTITIES)


def holds(interval: Interval | None, truth: float) -> bool:
    """Return whether an interval holds the truth, rounding aside."""
    slack = 1e-9 * abs(truth)
    return interval is not None and interval.low - slack <= truth <= interval.high + slack


@dataclass(frozen=True)
class Row:
    """How often one quantity's interval held the truth, and half its median width."""

    quantity: str
    unit: str
    held: int
    count: int
    half: float


def coverage(case: Case, count: int, seed: int) -> Iterator[Row]:
    """Yield one row for every quantity of a cable calibrated ``count`` times."""
    runs = [calibrated(case, seed * 100_003 + index) for index in range(count)]
    for at, (name, unit, truth) in enumerate(zip(QUANTITIES, UNITS, case.truths(), strict=True)):
        told = [run[at] for run in runs]
        widths = [0.5 * (interval.high - interval.low) for interval in told if interval is not None]
        yield Row(name, unit, sum(holds(each, truth) for each in told), count, float(np.median(widths)))


def main(arguments: Sequence[str]) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args(arguments)
    print(f"{'cable':<24} {'quantity':<14} {'held':>10}   half width (median)")
    for case in CASES:
        for row in coverage(case, asked.count, asked.seed):
            print(f"{case.name:<24} {row.quantity:<14} {row.held:>4} of {row.count:<4}  {shown(row.half, row.unit, 2)}",
                  flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
