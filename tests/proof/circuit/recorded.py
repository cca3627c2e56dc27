"""What does the bench record of a circuit, and where is that kept so that nobody waits for it twice?

A recording is found again by the SHA-256 of all it was made from: the circuit, the parts, the stimulus, the noise, and
the driver's own source.
"""

import os
import tempfile
from hashlib import sha256
from pathlib import Path

from drivers import netlist, ngspice, spice
from drivers.spice import DEFAULT, PARTS, SpiceDevice, shipped
from identify.trace import Step
from rig.plan import Limits, Plan
from rig.recording import Writer
from rig.runner import run
from rig.session import equipment
from tests.proof.circuit.changes import Circuit
from tests.proof.stimuli import (
    FIG13_LEVELS_V,
    HELD_OUT_LEVELS_V,
    Stimulus,
    multisine,
    sine,
    staircase,
)

FOLDER_VARIABLE = "RIG_CIRCUITS"
NOISE = "10 mV"
SHARE = 0.7  # of the levels of Fig. 13: w stays within +-9.6 V
LIMITS = Limits(-10.0, 10.0, None)


def training() -> tuple[Stimulus, ...]:
    """Return the runs to fit, 7.8 s: two step sizes, two hold times, two amplitudes, a fast sine and one that is stuck.

    All keep w off the rails of the circuit as it is.
    """
    return (
        staircase("staircase", tuple(SHARE * level for level in FIG13_LEVELS_V), 0.1),
        staircase("staircase_small", tuple(0.6 * level for level in FIG13_LEVELS_V), 0.05, 2),
        sine("sine_10hz_3.4v", 10.0, 3.4, 3, 2),
        sine("sine_10hz_2.6v", 10.0, 2.6, 3, 2),
        sine("sine_31hz_6v", 31.25, 6.0, 10, 3),
        sine("stuck_62hz_5v", 62.5, 5.0, 16, 2),
    )


def held_out() -> tuple[Stimulus, ...]:
    """Return the runs kept back, 2.6 s."""
    levels = tuple(0.75 * level for level in HELD_OUT_LEVELS_V)
    return multisine("multisine", 3.8, 1), staircase("staircase_other", levels, 0.1)


def folder() -> Path:
    """Return where recordings are kept."""
    told = os.environ.get(FOLDER_VARIABLE)
    return Path(told) if told else Path(tempfile.gettempdir()) / "rig-circuits"


def recorded(circuit: Circuit, stimulus: Stimulus, seed: int = 0) -> Path:
    """Return the recording of a stimulus played to a changed circuit, made now if it was not before."""
    netlist_text = circuit.applied(shipped(DEFAULT))
    sources = [Path(module.__file__ or "").read_bytes() for module in (spice, ngspice, netlist)]
    noise = f"{NOISE} {circuit.name} {stimulus.name} {stimulus.rate_hz} {seed}".encode()
    parts = [netlist_text.encode(), shipped(PARTS).encode(), stimulus.u.tobytes(), noise]
    place = folder() / sha256(b"\0".join([*sources, *parts])).hexdigest()[:16]
    path = place / f"{stimulus.name}.h5"
    if not path.exists():
        place.mkdir(parents=True, exist_ok=True)
        _played(netlist_text, stimulus, path, int.from_bytes(sha256(noise).digest()[:4]))
    return path


def _played(netlist_text: str, stimulus: Stimulus, path: Path, seed: int) -> None:
    """Play a stimulus to a circuit; the recording stands at ``path`` once it is whole."""
    wired, played = path.with_suffix(".cir"), path.with_suffix(f".{os.getpid()}.h5")
    wired.write_text(netlist_text)
    address = f"{wired}?noise={NOISE}&seed={seed}"
    steps = tuple(Step(s.label, s.kind, s.start, s.stop, s.repeat) for s in stimulus.segments)
    with SpiceDevice.connect(address) as device:
        plan = Plan(stimulus.name, device.quantise(stimulus.u), stimulus.rate_hz, steps, LIMITS)
        with Writer(played, plan, equipment(f"spice:{DEFAULT}", device, stimulus.rate_hz)) as writer:
            outcome = run(plan, device, writer)
            writer.finish(outcome.complete, outcome.reason, outcome.events)
    if not outcome.complete:
        raise RuntimeError(f"{stimulus.name}: {outcome.reason}")
    played.replace(path)
