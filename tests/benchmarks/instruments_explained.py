"""Do recordings of the U2300A and the Red Pitaya tell the same as the loopback's?

    python -m tests.benchmarks.instruments_explained

Each emulated instrument, behind its real transport and unmodified pyvisa-py, plays a shipped protocol that fits it in
front of the rig the protocol names; the loopback plays the same. Printed are what ``rig explain`` says missing and the
borders with their 95 % half widths; the truth is 8, 1.25, 8 and -1.25, and rails of +-10 V are concealed.
"""

import tempfile
import time
from pathlib import Path

from rig import session, workflow
from rig.rigfile import read_rig
from tests.benchmarks.firmware_staircase import HEADER, Answer
from tests.wire.emulated import emulated

PLAYED = {("one_buffer.yaml", "rigs/opamp_behind_amplifier.yaml"): ("redpitaya", "u2300a"),
          ("fig13_staircase.yaml", "rigs/opamp_backlash.yaml"): ("u2300a",)}
SPEED = 4.0


def answer(device: str, address: str, protocol: str, folder: Path) -> Answer:
    """Play a shipped protocol, explain the recording and identify what is left."""
    begun = time.monotonic()
    recorded = session.record(protocol, address, folder / f"{device}.h5", lambda done, total: None, overwrite=True)
    played_s = time.monotonic() - begun
    assert recorded.outcome.complete, recorded.outcome.reason
    runs = workflow.load([folder / f"{device}.h5"])
    told = workflow.explain_runs(runs)
    found = workflow.identify_improved(runs, told)
    assert found is not None
    plan = recorded.recording
    return Answer(f"{device}, {protocol}", plan.rate_hz, plan.trace().size, played_s, told, found)


def main() -> None:
    """Print the table."""
    print(HEADER, flush=True)
    with tempfile.TemporaryDirectory() as folder:
        for (protocol, rig), kinds in PLAYED.items():
            described = read_rig(session.shipped(rig))
            print(answer("loopback", f"loopback:{session.shipped(rig)}", protocol, Path(folder)).row(), flush=True)
            for kind in kinds:
                with emulated(described.text, kind=kind, speed=SPEED) as device:
                    print(answer(kind, device.address, protocol, Path(folder)).row(), flush=True)


if __name__ == "__main__":
    main()
