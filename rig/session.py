"""How does a protocol become a recording: planned for one device, proven there, played, kept?"""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from identify.natural_units import shown
from identify.notebook.glance import Glance, Seen
from identify.trace import part
from rig import registry, retry, runner
from rig.amplifier import behind, parted
from rig.calibration import kept_for
from rig.device import Capabilities, Device, Identity
from rig.errors import FileError, IncompleteError, MisfitError, RefusedError, visible
from rig.guardian import post
from rig.plan import Plan
from rig.plan import plan as draw
from rig.protocol import Protocol, read_protocol
from rig.provenance import now
from rig.recorded import VOLTAGES, Equipment, Recording
from rig.recording import Writer
from rig.references import is_file, packaged
from rig.rigfile import RigFile
from rig.stopping import bell, held_back
from rig.transcript import ongoing
from rig.units import exact
from rig.yamlfile import parse_yaml

RATE_MAY_GIVE = 1e-2
"""Relative; a clock that makes a rate this near plays the protocol at its own rate, and says so."""

NO_RIG_NAMED = re.compile(r"loopback:(?P<options>(\?.*)?)")


@dataclass(frozen=True, repr=False)
class Checked(Seen):
    """A protocol proven on a device: nothing was output, and everything that can be refused was not."""

    plan: Plan
    address: str
    identity: Identity
    capabilities: Capabilities
    asked_rate_hz: float

    def glance(self) -> Glance:
        """Return what would be played on what."""
        plan = self.plan
        low_v, high_v = plan.range_v
        length = f"{plan.u.size} samples at {shown(plan.rate_hz, 'Hz')}, {shown(plan.duration_s, 's')}"
        rows = (
            ("question", plan.question), ("device", f"{self.address} ({self.identity})"),
            ("levels", f"{low_v:.6g} to {high_v:.6g} V"), ("slew", shown(plan.slew_v_per_s, "V/s")),
            *(("note", note) for note in plan.notes),
        )  # fmt: skip
        return Glance("Accepted", f"{plan.title}, {length}; nothing was output", rows)


@dataclass(frozen=True)
class Segment:
    """One stretch of a run, recorded without a pause: where its recording is, and how it ended."""

    path: Path
    recording: Recording
    outcome: runner.Outcome


@dataclass(frozen=True)
class Recorded:
    """A run that was played: one segment, and one more for every time that lost samples were retried."""

    segments: tuple[Segment, ...]

    @property
    def paths(self) -> tuple[Path, ...]:
        """Return where the recordings are."""
        return tuple(segment.path for segment in self.segments)

    @property
    def recording(self) -> Recording:
        """Return the recording of a run in one segment; raise IncompleteError where it fell into several."""
        if len(self.segments) > 1:
            raise IncompleteError("the run is in several segments, samples having been lost in all but the last",
                                  value=", ".join(map(str, self.paths)), do="use them together")
        return self.segments[0].recording

    @property
    def outcome(self) -> runner.Outcome:
        """Return how the run ended: as its last segment did."""
        return self.segments[-1].outcome


def shipped(name: str | Path) -> Path:
    """Return the file ``name`` as given, or among the protocols and rigs that come with the program."""
    folder = packaged()
    inside = Path(*Path(name).parts[1:]) if Path(name).parts[:1] == (folder.name,) else Path(name)
    return next((path for path in (Path(name), folder / inside) if is_file(path)), Path(name))


def check(protocol_path: str | Path, address: str | None = None, rig: str | None = None) -> Checked:
    """Prove a protocol on a device without output; raise FileError, RefusedError, UsageError or DeviceError.

    ``rig`` is a rig file to take in place of the one the protocol names.
    """
    protocol = read_protocol(shipped(protocol_path), shipped(rig) if rig else None)
    address = played_at(address, protocol)
    with registry.connect(address) as device:
        return proven(protocol, address, device)


def record(
    protocol_path: str | Path, address: str | None, out: str | Path, progress: runner.Progress, overwrite: bool = False,
    rig: str | None = None,
) -> Recorded:  # fmt: skip
    """Play a protocol and keep what comes back at ``out``; however the run ends, the output is left safe.

    What is played again because samples were lost goes beside it, as ``RUN.retry1.h5`` and so on. Raises what ``check``
    raises, before any output; a failure in the run is told in the outcome.
    """
    protocol = read_protocol(shipped(protocol_path), shipped(rig) if rig else None)
    address = played_at(address, protocol)
    with registry.connect(address) as device:
        return play(protocol, address, device, out, progress, overwrite)


def play(
    protocol: Protocol, address: str, device: Device, out: str | Path,
    progress: runner.Progress = lambda done, total: None, overwrite: bool = False,
) -> Recorded:  # fmt: skip
    """Play a protocol on a device that is connected at ``address``; otherwise as ``record``."""
    post(device)
    plan = proven(protocol, address, device).plan
    if runner.elsewhere(plan, device) is not None:
        plan = replace(plan, initial="in_motion")
    _make_room(Path(out), overwrite)
    segments = [_segment(plan, address, device, Path(out), progress, overwrite)]
    while (plan_again := retry.again(plan, segments[-1].outcome.lost_at)) is not None:
        plan, path = plan_again, retry.path_of(Path(out), len(segments))
        try:
            segments.append(_segment(plan, address, device, path, progress, overwrite))
        except RefusedError as error:
            raise IncompleteError("what was lost cannot be played again", where=str(segments[-1].path),
                                  value=str(error), do="the recording is kept as it is") from error
    return Recorded(tuple(segments))


def _segment(
    plan: Plan, address: str, device: Device, out: Path, progress: runner.Progress, overwrite: bool,
) -> Segment:  # fmt: skip
    """Play a plan and keep what comes back."""
    u, found = device.quantise(plan.u), equipment(address, device, plan.rate_hz)
    known = replace(found, calibration=kept_for(found, plan.rate_hz, now()))
    with held_back() as told, Writer(out, plan, known, u, overwrite) as writer, bell(out) as rung:
        outcome = runner.run(plan, device, writer, progress, lambda: told() or rung())
        try:
            recording = writer.finish(outcome.complete, outcome.reason, outcome.events, ongoing().text())
        except FileError as error:
            raise outcome.failure or IncompleteError("the recording cannot be read back", where=str(out),
                                                     value=str(error), do="see what became of its folder") from error
    return Segment(out, recording, _as_kept(outcome, recording, out))


def _as_kept(outcome: runner.Outcome, recording: Recording, out: Path) -> runner.Outcome:
    """Return how a run ended, the keeping of its recording included."""
    if recording.complete or not outcome.complete:
        return outcome
    failure = IncompleteError(recording.reason, where=str(out),
                              do="every command reads it as it is; with room on the disk, play it again")
    return replace(outcome, complete=False, reason=recording.reason, failure=failure)


def _make_room(out: Path, overwrite: bool) -> None:
    """Remove the retries of a run that is to be overwritten; raise FileError where they must not be touched."""
    for path in retry.paths_beside(out):
        if not overwrite:
            raise FileError("there is a retry of another run of this name", where=str(path),
                            do="choose another name, or overwrite both")
        path.unlink()


def played_at(address: str | None, protocol: Protocol) -> str:
    """Return the address a protocol is played at: its own device's where none is named, the rig's amplifier behind it.

    A loopback of which no rig file is named plays the rig of the protocol.
    """
    bare, amplifier = parted(address or usual_address(protocol))
    if protocol.rig_path and (named_none := NO_RIG_NAMED.fullmatch(bare)):
        bare = f"loopback:{_shortest(Path(protocol.rig_path))}{named_none['options']}"
    return at_rig(behind(bare, amplifier), protocol.rig)


def _shortest(rig_path: Path) -> Path:
    """Return a rig file as a loopback takes it: one that comes with the program by its name, if none here has it."""
    if not rig_path.is_relative_to(packaged()):
        return rig_path
    name = rig_path.relative_to(packaged())
    return rig_path if is_file(name) else name


def usual_address(protocol: Protocol) -> str:
    """Return the device a protocol is played on when none is named: its own, or the loopback.

    Raises FileError for one that only who types a command may name.
    """
    if protocol.device is None:
        return "loopback:"
    try:
        return registry.address_in(Path(protocol.path).parent, protocol.device)
    except MisfitError as error:
        raise error.placed(parse_yaml(protocol.text, protocol.path).at("device")) from error


def at_rig(address: str, rig: RigFile | None) -> str:
    """Return the address with the rig's amplifier behind the device, where there is one and u is not told behind it."""
    kind, _ = registry.driver_at(address)
    return behind(address, rig.amplifier) if rig is not None and kind.before_amplifier else address


def proven(protocol: Protocol, address: str, device: Device) -> Checked:
    """Return the protocol planned at a rate the device makes, and accepted by it; raise RefusedError."""
    with _blamed_on(parse_yaml(protocol.text, protocol.path).at("acquisition", "rate")):
        rate = device.achievable_rate(protocol.rate_hz)
        if abs(rate / protocol.rate_hz - 1.0) > RATE_MAY_GIVE:
            raise RefusedError("the device's clock cannot make this rate", value=f"{protocol.rate_hz:g} Hz",
                               allowed=f"{rate:g} Hz is the nearest", do="change acquisition.rate")
    plan = draw(protocol, rate)
    with _blamed_on(protocol.path):
        try:
            device.check(plan.u, rate, plan.limits, plan.safe_level_v, len(plan.inputs))
        except RefusedError as error:
            if error.where is None:
                _check_steps(protocol, plan, device)
            raise
    if rate != protocol.rate_hz:
        note = f"the device's clock makes {rate:.9g} Hz in place of {protocol.rate_hz:.9g} Hz"
        plan = replace(plan, notes=(*plan.notes, note))
    return Checked(plan, address, device.identity(), device.capabilities(), protocol.rate_hz)


def _check_steps(protocol: Protocol, plan: Plan, device: Device) -> None:
    """Raise RefusedError at the first step that a device which refused the whole does not accept by itself."""
    for step in protocol.steps:
        piece = next(planned for planned in plan.steps if planned.label == step.label)
        with _blamed_on(step.where):
            device.check(part(plan.u, piece.start, piece.stop), plan.rate_hz, plan.limits)


@contextmanager
def _blamed_on(where: str) -> Iterator[None]:
    """Name the place in a refusal by a device, which does not know the file."""
    try:
        yield
    except RefusedError as error:
        if error.where is not None:
            raise
        raise RefusedError(error.what, where=where, value=error.value, allowed=error.allowed, do=error.do) from error


def equipment(address: str, device: Device, rate_hz: float) -> Equipment:
    """Return who records at ``address``, and the settings it records with."""
    can, identity = device.capabilities(), device.identity()
    volts = {name: exact(getattr(can, f"{name}_v"), "V") for name in VOLTAGES}
    settings = {
        "rate": f"{rate_hz!r} Hz", "output_step": exact(can.output_lsb_v, "V"),
        "output_range": f"{can.output_low_v:g} to {can.output_high_v:g} V", "output_bits": str(can.output_bits),
        "input_range": f"{can.input_low_v:g} to {can.input_high_v:g} V", "input_bits": str(can.input_bits), **volts,
        "inputs_read": "in turn, each 1/n of a sample period after the one before" if can.multiplexed else "together",
    }
    model, serial, firmware = map(visible, (identity.model, identity.serial, identity.firmware))
    return Equipment(address, model, serial, firmware, settings)
