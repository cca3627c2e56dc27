"""How is a device calibrated with a cable from its output to its inputs?

It plays random levels, held for a few samples each, and reads them back: first one pass at a tenth of the level, which
shows that a cable is there and not a rig that a full level may harm; then the passes that count, each its own levels.
Every pass is a run like any other: checked before output, watched over by a guardian, the output left at 0 V.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, final

import numpy as np

from identify.interval import Interval
from identify.trace import Array, Step
from rig import registry, runner
from rig.calibration import Calibration, usual_path
from rig.device import Device
from rig.errors import RefusedError
from rig.outputs import check_destination, json_text, write_text
from rig.plan import Limits, Plan
from rig.provenance import now
from rig.session import equipment

if TYPE_CHECKING:
    from identify.calibration import Cable, Pass

SAMPLES, PASSES = 4000, 8
SHORTEST = 0.8
"""Of the samples, in a pass."""
LONGEST_HOLD = 5
"""Samples: short enough to see how a step arrives, long enough to see it settle."""
TIMID = 0.1
"""Of the level, in the pass that asks whether a cable is there."""
LIKE_A_CABLE = (0.2, 5.0)
"""Gains of output and input together beyond which it is no cable."""
RAMP_S = 0.1

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Wish:
    """What is asked for: the rate, the largest level of either sign, how many inputs the cable reaches."""

    rate_hz: float
    level_v: float
    inputs: int = 1


@dataclass(frozen=True)
class Calibrated:
    """A calibration and where it is kept."""

    calibration: Calibration
    path: Path


@final
@dataclass
class _Kept:
    """Keeps what comes back in memory: a sink of the runner."""

    size: int
    inputs: int
    y: Array = field(init=False)

    def __post_init__(self) -> None:
        self.y = np.full((self.inputs, self.size), np.nan)

    def append(self, start: int, y: Array, further: Array) -> None:
        """Store the readings of all inputs as the samples from index ``start`` on."""
        self.y[0, start:start + y.size] = y
        if self.inputs > 1:
            self.y[1:, start:start + y.size] = further


def calibrate(
    address: str, wish: Wish, out: str | Path | None, progress: Progress = lambda sentence, share: None, seed: int = 0,
) -> Calibrated:  # fmt: skip
    """Calibrate the device at ``address`` and keep what was found at ``out``, or where `rig run` looks for it.

    Raises RefusedError where there is no cable or the device cannot do what is asked, DeviceError, IncompleteError.
    """
    if out is not None:
        check_destination(out)
    with registry.connect(address) as device:
        found = measured_on(device, wish, progress, seed)
        path = Path(out) if out is not None else usual_path(equipment(address, device, found.rate_hz), found.rate_hz)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, json_text(found.to_dict()))
    return Calibrated(found, path)


def measured_on(device: Device, wish: Wish, progress: Progress, seed: int = 0) -> Calibration:
    """Return what a cable on a connected device tells."""
    rate_hz = device.achievable_rate(wish.rate_hz)
    random = np.random.default_rng(seed)
    progress("looking for a cable", 0.0)
    _refuse_no_cable(_played(device, wish, rate_hz, TIMID * _levels(random)))
    each: list[list[Pass]] = []
    for index in range(PASSES):
        progress("playing over the cable", (1 + index) / (PASSES + 2))
        each.append(_played(device, wish, rate_hz, _levels(random)))
    progress("reckoning", (PASSES + 1) / (PASSES + 2))
    return _told(device, wish, rate_hz, each)


def _levels(random: np.random.Generator) -> Array:
    """Return random levels within 1 of 0, each held for a few samples.

    No two passes are equally long: a hum that began each time at the same instant would leave the same trace in all.
    """
    size = int(random.integers(round(SHORTEST * SAMPLES), SAMPLES + 1))
    held = random.integers(1, LONGEST_HOLD + 1, size)
    return np.asarray(np.repeat(random.uniform(-1.0, 1.0, size), held)[:size])


def _played(device: Device, wish: Wish, rate_hz: float, shape: Array) -> "list[Pass]":
    """Play one pass and return what every input read of it; raise what ended it early."""
    from identify.calibration import Pass

    u = device.quantise(wish.level_v * shape)[:]
    limits = Limits(-wish.level_v, wish.level_v)
    names = ("y", *(f"input_{number}" for number in range(2, wish.inputs + 1)))
    plan = Plan("calibration", u, rate_hz, (Step("levels", "table", 0, u.size),), limits, ramp_s=RAMP_S, inputs=names)
    kept = _Kept(u.size, wish.inputs)
    outcome = runner.run(plan, device, kept)
    if outcome.failure is not None:
        raise outcome.failure
    if any(event.kind == "clipped" for event in outcome.events):
        raise RefusedError("the input reached the end of its range", value=f"{wish.level_v:g} V at the output",
                           do="give a smaller --level")
    return [Pass(u, y, rate_hz) for y in kept.y]


def _refuse_no_cable(passes: "Sequence[Pass]") -> None:
    """Raise RefusedError for an input that does not read what is put out."""
    from identify.calibration import at_once

    for number, one in enumerate(passes, start=1):
        gain, share = at_once(one)
        if not (LIKE_A_CABLE[0] <= abs(gain) <= LIKE_A_CABLE[1] and share >= 0.9):
            raise RefusedError(
                "this is no cable", where=f"input {number}",
                value=f"gain {gain:.3g}, {100.0 * share:.0f} % of the reading follows the output",
                allowed=f"gain {LIKE_A_CABLE[0]:g} to {LIKE_A_CABLE[1]:g}, at least 90 %",
                do="take the rig off and join the output to the input with a cable")


def _told(device: Device, wish: Wish, rate_hz: float, each: "Sequence[Sequence[Pass]]") -> Calibration:
    """Return the calibration that all passes tell."""
    from identify.calibration import measured

    try:
        first, *others = [measured([passes[at] for passes in each]) for at in range(wish.inputs)]
    except ValueError as error:
        raise RefusedError(str(error), do="check the cable and calibrate again") from error
    can, who = device.capabilities(), device.identity()
    return Calibration(
        model=who.model, serial=who.serial, firmware=who.firmware, rate_hz=rate_hz, level_v=wish.level_v, made=now(),
        ranges_v=(can.output_low_v, can.output_high_v, can.input_low_v, can.input_high_v), delay=first.delay,
        time_constant=first.time_constant, skew=first.skew_ppm, gain=first.gain, offset=first.offset,
        noise=first.noise, input_step=first.step, warnings=first.warnings,
        input_skews={f"input {number}": _apart(other, first) for number, other in enumerate(others, start=2)},
    )  # fmt: skip


def _apart(other: "Cable", first: "Cable") -> Interval:
    """Return by how much one input is read later than the first, s, at the worst of both intervals."""
    low, high = other.delay.low - first.delay.high, other.delay.high - first.delay.low
    return Interval(0.5 * (low + high), low, high)
