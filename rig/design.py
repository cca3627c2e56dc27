"""How does a rig file become the protocol that tells most about the rig in a given time, within limits and device?"""

from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

from identify.natural_units import shown
from rig import protocolfile, registry, session
from rig.device import Capabilities, Device
from rig.errors import FileError, MisfitError, RefusedError, UsageError
from rig.foresight import Foresight, expected_noise, foreseen_plan
from rig.limits import Limits
from rig.linearblock import check_stable
from rig.outputs import check_destination, write_text
from rig.plan import Plan
from rig.protocol import parse_protocol
from rig.protocolfile import exact
from rig.references import ALLOWED, is_beside, name_seen_from
from rig.rigfile import RigFile, read_rig
from rig.stimulus import MAX_SAMPLES
from rig.workflow import Progress

if TYPE_CHECKING:
    from identify.model import Model
    from identify.planning.candidates import Candidate, Room
    from identify.planning.design import Design
    from identify.planning.information import Expected


@dataclass(frozen=True)
class Wish:
    """What the operator asked for; None: as much as the device can."""

    time_s: float = 60.0
    limit_v: float | None = None
    slew_v_per_s: float | None = None
    rate_hz: float | None = None
    device: str | None = None


@dataclass(frozen=True)
class Row:
    """One quantity: what the designed protocol and the paper's tell of it, and how much wider it gets at worst."""

    designed: "Expected"
    paper: "Expected"
    worst: float


@dataclass(frozen=True)
class Designed:
    """A protocol that was written, and how it compares with the paper's experiment in the same time.

    ``moving``: the least number of steps that move the gap when the rig's values are 30 % off.
    """

    path: Path
    plan: Plan
    told: Foresight
    rows: tuple[Row, ...]
    paper: str
    moving: int


def design(rig: str | Path, out: str | Path, wish: Wish, progress: Progress, overwrite: bool = False) -> Designed:
    """Write the protocol for a rig file at ``out``, proven on the device; nothing concealed in the rig file is used.

    Raises FileError, UsageError or DeviceError, and RefusedError for what cannot be designed for.
    """
    out, path = Path(out), session.shipped(rig)
    check_destination(out)
    if out.exists() and not overwrite:
        raise FileError("there is a file of this name already", where=str(out), do="choose another name or --overwrite")
    rigfile = usable(read_rig(path))
    if not is_beside(path, out.resolve().parent):
        raise UsageError("the protocol could not name its rig file", where=str(path), allowed=ALLOWED,
                         do="write the protocol beside the rig file, or above it")
    address = session.at_rig(wish.device or f"loopback:{path}", rigfile)
    with registry.connect(address) as device:
        room = _room(rigfile, wish, device)
        noise_v, origin = expected_noise(rigfile.model, device.capabilities())
        found = _designed(rigfile.model, room, noise_v, str(path), progress)
        heading = _heading(rigfile, path, out, wish, room)
        text = protocolfile.written(heading, found.steps)
        checked = session.proven(parse_protocol(text, str(out)), address, device)
    told = foreseen_plan(checked.plan, rigfile.model, noise_v, origin)
    progress("holding it against the paper's protocol", 0.93)
    rows, paper, moving = _compared(rigfile.model, room, told, checked.plan)
    why = {step.label: _why(step.label, found, rigfile.model, told) for step in checked.plan.steps}
    write_text(out, protocolfile.written(heading, found.steps, _remarks(rigfile.model, wish, room, told), why))
    return Designed(out, checked.plan, told, rows, paper, moving)


def usable(rigfile: RigFile) -> RigFile:
    """Return the rig file; raise RefusedError where it has no values, or a block is not stable as it stands there."""
    if rigfile.model.unknown:
        raise RefusedError("no protocol can be designed for a rig without values", where=rigfile.where,
                           value=f"{rigfile.model.unknown[0]} has none", do="give values near those of the rig")
    for name, block in (("G1", rigfile.model.g1), ("G2", rigfile.model.g2)):
        try:
            check_stable(block.den)
        except ValueError as error:
            raise RefusedError(
                f"no protocol can be designed for an unstable {name}", where=rigfile.where, value=str(error),
                do="give values of a stable block, near those of the rig",
            ) from error
    return rigfile


def _room(rigfile: RigFile, wish: Wish, device: Device) -> "Room":
    """Return what rig, device and operator allow; raise RefusedError where that is nothing."""
    from identify.planning.candidates import Room
    from identify.planning.sampling import usual_rate_hz

    can = device.capabilities()
    limits = _limits(rigfile, wish, can)
    usual_hz = max(can.min_rate_hz, usual_rate_hz(rigfile.model, can.max_rate_hz))
    rate_hz = device.achievable_rate(wish.rate_hz or usual_hz)
    if rate_hz * wish.time_s > MAX_SAMPLES:
        raise RefusedError("the protocol is too long", where="--time", value=f"{wish.time_s:g} s at {rate_hz:g} Hz",
                           allowed=f"{MAX_SAMPLES / rate_hz:.6g} s ({MAX_SAMPLES} samples)",
                           do="give less --time or a lower --rate")
    reading_v = min(-can.input_low_v, can.input_high_v)
    slew = limits.slew_v_per_s or float("inf")
    return Room(limits.low_v, limits.high_v, rate_hz, wish.time_s, slew, reading_v if reading_v > 0.0 else float("inf"))


def _limits(rigfile: RigFile, wish: Wish, can: Capabilities) -> Limits:
    """Return the limits of u; raise RefusedError where rig and device leave none."""
    limits = Limits(*_range(wish, can), wish.slew_v_per_s)
    try:
        return limits.within(rigfile.limits, "the rig file")
    except MisfitError as error:
        raise RefusedError(error.what, where=rigfile.where, value=error.value, allowed=error.allowed) from error


def _range(wish: Wish, can: Capabilities) -> tuple[float, float]:
    """Return the range of u in V."""
    if wish.limit_v is None:
        return can.output_low_v, can.output_high_v
    if wish.limit_v > max(-can.output_low_v, can.output_high_v):
        raise RefusedError("the limit is beyond the device", where="--limit", value=f"{wish.limit_v:g} V",
                           allowed=f"{can.output_low_v:g} to {can.output_high_v:g} V", do="lower --limit")
    return max(can.output_low_v, -wish.limit_v), min(can.output_high_v, wish.limit_v)


def _designed(model: "Model", room: "Room", noise_v: float, where: str, progress: Progress) -> "Design":
    """Return the stimuli and their repeats; the sentence of a refusal gets its place."""
    from identify.planning.design import designed

    try:
        return designed(model, room, noise_v, progress)
    except ValueError as error:
        raise RefusedError(str(error), where=where) from error


def _heading(rigfile: RigFile, path: Path, out: Path, wish: Wish, room: "Room") -> protocolfile.Heading:
    """Return the top of the protocol."""
    sure = f"How sure can G1, F and G2 become in {wish.time_s:g} s?"
    symmetric = room.low_v == -room.high_v
    limits = {"level": exact(room.high_v, "V")} if symmetric else {
        "low": exact(room.low_v, "V"), "high": exact(room.high_v, "V"),
    }  # fmt: skip
    ramp = None
    if isfinite(room.slew_v_per_s):
        limits["slew"] = exact(room.slew_v_per_s, "V/s")
        ramp = exact(max(0.1, 1.01 * max(-room.low_v, room.high_v) / room.slew_v_per_s), "s")
    rate = exact(wish.rate_hz or room.rate_hz, "Hz")
    title, rig = f"designed for {rigfile.model.title}", name_seen_from(path, out.resolve().parent)
    return protocolfile.Heading(title, sure, rig, limits, rate, wish.device, ramp)


def _remarks(model: "Model", wish: Wish, room: "Room", told: Foresight) -> list[str]:
    """Return the paragraphs at the top of the file."""
    assert told.information is not None
    expected = ", ".join(
        f"{e.quantity.name} {shown(e.quantity.value, e.quantity.unit)} ± {shown(1.96 * e.sd, e.quantity.unit, 2)}"
        for e in told.information.expected() if e.told
    )  # fmt: skip
    known = [piece.id for piece in model.physics]
    rails = "No rail is known in the rig file: where an amplifier stops, name it there under physics and design again."
    return [
        f"Written by `rig design` for {wish.time_s:g} s within {room.low_v:g} to {room.high_v:g} V: of what "
        "was considered, these steps and repeats make the mean log relative standard error smallest, with half of the "
        "weight on F and half on gains and phases, half on the rig as its file has it and half on rigs 30 % off in "
        "every value.",
        f"Expected 95 % intervals, noise {shown(told.noise_v, 'V', 3)} ({told.noise_from}): {expected}.",
        *([] if "saturation" in known else [rails]),
    ]  # fmt: skip


def _why(name: str, found: "Design", model: "Model", told: Foresight) -> str:
    """Return why a step is there, and what it tells."""
    from identify.planning.design import purpose

    candidate = next(c for c, _ in found.steps if protocolfile.label(c) == name)
    assert told.information is not None
    step = next(s for s in told.information.steps() if s.label == name)
    shares = sorted(step.shares.items(), key=lambda item: -item[1])[:4]
    tells = ", ".join(f"{100.0 * share:.0f} % of {quantity}" for quantity, share in shares)
    return f"{purpose(model, candidate, found.steps)} It tells {tells}."


def _compared(
    model: "Model", room: "Room", told: Foresight, plan: Plan
) -> tuple[tuple[Row, ...], str, int]:
    """Return every quantity beside the paper's experiment, that experiment in words, and the fewest moving steps."""
    from identify.planning.design import SIGNS, off
    from identify.planning.fig13 import fig13, scaled

    assert told.information is not None
    candidates = fig13(model, room)
    paper = foreseen_plan(_played(candidates, plan), model, told.noise_v).information
    wrong = [foreseen_plan(plan, off(model, signs), told.noise_v) for signs in SIGNS]
    assert paper is not None
    time_s = sum(paper.times_s)
    rows = tuple(
        Row(one, other, max(_wider(one, k, elsewhere) for elsewhere in wrong))
        for k, (one, other) in enumerate(
            zip(told.information.expected(), scaled(paper, plan.duration_s).expected(), strict=True)
        )
    )  # fmt: skip
    names = " and ".join(protocolfile.label(c) for c in candidates)
    words = f"{names}: {shown(time_s, 's')}, counted {plan.duration_s / time_s:.3g} times for the same time"
    steps = len({step.label for step in plan.steps})
    return rows, words, min(steps - sum(a.rule == "stuck gap" for a in elsewhere.advice) for elsewhere in wrong)


def _wider(here: "Expected", index: int, elsewhere: Foresight) -> float:
    """Return how much larger a relative standard error is on another rig."""
    assert elsewhere.information is not None
    return elsewhere.information.expected()[index].relative / here.relative


def _played(candidates: "tuple[Candidate, ...]", plan: Plan) -> Plan:
    """Return a plan of each stimulus once, at the rate and within the limits of another."""
    import numpy as np

    from identify.trace import Step

    drawn = [c.drawn(plan.rate_hz) for c in candidates]
    edges = np.cumsum([0, *(u.size for u in drawn)]).tolist()
    steps = tuple(
        Step(protocolfile.label(c), "", start, stop)
        for c, start, stop in zip(candidates, edges, edges[1:], strict=False)
    )  # fmt: skip
    limits = Limits(plan.limits.low_v, plan.limits.high_v)
    return replace(plan, title="Fig. 13", u=np.concatenate(drawn), steps=steps, limits=limits)
