"""Does the firmware's recording of the Fig. 13 staircase tell the same as the loopback's?

    python -m tests.benchmarks.firmware_staircase 1000 5000         # rates in Hz

The firmware runs in simavr in front of the same simulated rig (tests/wire/simavr), through its own 12-bit DAC and
10-bit ADC. Printed are what ``rig explain`` says missing and the borders with their 95 % half widths.
"""

import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from identify.explain.explanation import Explanation
from identify.identification import Identification
from rig import session, workflow
from rig.rigfile import read_rig
from tests.wire.simavr.bench import on_simavr

PROTOCOL, RIG = "fig13_staircase.yaml", "rigs/opamp_backlash.yaml"
BORDERS = ("S_L", "D_L", "S_U", "D_U")
SPEED = 4.0


@dataclass(frozen=True)
class Answer:
    """What a recording of the staircase told, and how long it took to play."""

    device: str
    rate_hz: float
    samples: int
    played_s: float
    told: Explanation
    found: Identification

    def border(self, name: str) -> tuple[float, float]:
        """Return a value of the backlash and its 95 % half width."""
        value = self.found.to_dict()["backlash"][name]  # type: ignore[index, call-overload]
        return value["value"], (value["ci95"][1] - value["ci95"][0]) / 2

    def row(self) -> str:
        """Return the answer as a line of the table."""
        told = self.told.to_dict()
        held = told["fit"]["held_out"]  # type: ignore[index, call-overload]
        effects = ", ".join(effect["id"] for effect in told["effects"])  # type: ignore[attr-defined]
        borders = " | ".join("{:.5f} ± {:.5f}".format(*self.border(name)) for name in BORDERS)
        return (f"| {self.device} | {self.rate_hz:g} | {self.samples} | {self.played_s:.1f} "
                f"| {told['verdict']}: {effects} | {borders} | {held['after'] / held['noise']:.3f} |")


HEADER = (f"| device | rate [Hz] | samples | played in [s] | told | {' | '.join(BORDERS)} | held out / noise |\n"
          "|---|---|---|---|---|---|---|---|---|---|")


def answer(device: str, address: str, rate_hz: float, folder: Path) -> Answer:
    """Play the staircase at another rate than its own, explain the recording and identify what is left."""
    protocol, out = folder / f"{device}-{rate_hz:g}.yaml", folder / f"{device}-{rate_hz:g}.h5"
    text = session.shipped(PROTOCOL).read_text(encoding="utf-8")
    protocol.write_text(text.replace("rate: 10 kHz", f"rate: {rate_hz:g} Hz"), encoding="utf-8")
    begun = time.monotonic()
    recorded = session.record(protocol, address, out, lambda done, total: None)
    played_s = time.monotonic() - begun
    assert recorded.outcome.complete, recorded.outcome.reason
    runs = workflow.load([out])
    told = workflow.explain_runs(runs)
    found = workflow.identify_improved(runs, told)
    assert found is not None
    return Answer(device, rate_hz, recorded.recording.trace().size, played_s, told, found)


@contextmanager
def firmware() -> Iterator[str]:
    """Give the address of the firmware in front of the rig of the protocol."""
    with on_simavr(read_rig(session.shipped(RIG)).text, speed=SPEED) as board:
        yield board.address


def main(rates_hz: list[float]) -> None:
    """Print the table."""
    print(HEADER, flush=True)
    with tempfile.TemporaryDirectory() as folder, firmware() as address:
        for rate_hz in rates_hz:
            for device, where in (("loopback", "loopback:"), ("firmware", address)):
                print(answer(device, where, rate_hz, Path(folder)).row(), flush=True)


if __name__ == "__main__":
    main([float(word) for word in sys.argv[1:]] or [1000.0])
