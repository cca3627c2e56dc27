"""How does an undecided set become a protocol on the disk that decides it, within the limits of rig and device?"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from identify.trace import Trace
from rig import protocolfile, session
from rig.device import Device
from rig.errors import MisfitError, RefusedError
from rig.limits import Limits
from rig.outputs import write_text
from rig.plan import plan
from rig.protocol import limits_in, parse_protocol
from rig.protocolfile import exact
from rig.signals import extremes
from rig.workflow import Progress, Runs

if TYPE_CHECKING:
    from identify.explain.explanation import Explanation
    from identify.explain.separate import Separation
    from identify.planning.candidates import Room

RIG_FILE = "separate_rig.yaml"
MOST_SAMPLES = 2_000_000  # of a protocol that separates: what is compared is in memory whole


@dataclass(frozen=True)
class Written:
    """An undecided set and the protocol that decides it; ``path`` is None where nothing that can be played does."""

    separation: "Separation"
    path: Path | None

    @property
    def sentence(self) -> str:
        """Return what would separate the set, the file first."""
        return f"{self.path}: {self.separation.sentence}" if self.path else self.separation.sentence

    @property
    def members(self) -> tuple[tuple[str, str], ...]:
        """Return id and stage of every member of the set."""
        return tuple((m.id, m.stage) for m in self.separation.members)

    def to_dict(self) -> dict[str, object]:
        """Return the form of the JSON answer."""
        s = self.separation
        return {
            "id": s.id, "stage": s.stage,
            "set": [{"id": m.id, "stage": m.stage, "probability": round(m.probability, 4)} for m in s.members],
            "protocol": str(self.path) if self.path else None, "time_s": round(s.time_s, 6),
            "expected_sharpness": round(s.sharpness, 2),
            "inseparable": [{"id": m.id, "stage": m.stage, "exact": m.exact} for m in s.equal],
            "sentence": s.sentence,
        }  # fmt: skip


def write(
    runs: Runs, told: "Explanation", folder: Path, device: Device | None, address: str | None, progress: Progress
) -> tuple[Written, ...]:
    """Write a protocol into ``folder`` for every undecided set that can be decided, proven where a device is given.

    Raises FileError, or RefusedError where the device cannot play what was chosen.
    """
    from identify.explain.separate import separations

    if not told.is_open:
        return ()
    limits = limits_of(runs)
    room = _room(runs, limits, device)
    try:
        found = separations(told, room, progress)
    except ValueError as error:
        if device is None:
            return ()  # nobody asked for a protocol: the answer stands without one
        raise RefusedError(f"no follow-up can be chosen: {error}", where=address) from error
    return tuple(Written(s, _file(s, runs, replace_limits(limits, room), room, folder, device, address)) for s in found)


def with_protocols(told: "Explanation", written: Sequence[Written]) -> "Explanation":
    """Return the explanation whose undecided findings name the protocols that would separate them.

    Of what has no name the last is the law that was located; others are of the readings.
    """
    by_set = {(w.separation.id, w.separation.stage): w.sentence for w in written}
    last = {(f.id, f.stage): f for f in told.effects}
    effects = tuple(
        replace(f, would_separate=by_set[key]) if (key := (f.id, f.stage)) in by_set and f is last[key] else f
        for f in told.effects
    )
    return replace(told, effects=effects)


def limits_of(runs: Runs) -> Limits:
    """Return what the rig's input may be given: the tightest limits declared, for want of any what was played to it.

    Raises FileError when they leave no level.
    """
    declared = [limits for limits in map(limits_in, runs.protocols) if limits is not None]
    tightest = declared[0] if declared else Limits(*_played((*runs.traces, *runs.held_out)))
    try:
        for limits in declared:
            tightest = tightest.within(limits, "the protocol of another run")
        return tightest.within(runs.rig.limits if runs.rig else None, "the rig file")
    except MisfitError as error:
        raise error.placed("limits") from error


def _played(traces: Sequence[Trace]) -> tuple[float, float]:
    """Return the lowest and highest level of u in recordings, V."""
    found = [extremes(trace.u) for trace in traces]
    return min(each.low_v for each in found), max(each.high_v for each in found)


def _room(runs: Runs, limits: Limits, device: Device | None) -> "Room":
    """Return what may be played: limits, device, the rate of the recordings, and about as long as those took."""
    from identify.explain.separate import least_time_s
    from identify.planning.candidates import Room

    rate_hz = max(t.rate_hz for t in runs.traces)
    played_s = min(sum(t.size / t.rate_hz for t in runs.traces), MOST_SAMPLES / rate_hz)
    time_s = max(played_s, least_time_s(runs.model))
    room = Room(limits.low_v, limits.high_v, rate_hz, time_s, limits.slew_v_per_s or float("inf"))
    if device is None:
        return room
    can = device.capabilities()
    rate_hz = device.achievable_rate(min(max(rate_hz, can.min_rate_hz), can.max_rate_hz))
    longest_s = float("inf") if can.max_samples is None else can.max_samples / rate_hz
    return replace(
        room, low_v=max(room.low_v, can.output_low_v), high_v=min(room.high_v, can.output_high_v), rate_hz=rate_hz,
        time_s=min(time_s, longest_s), reading_v=min(-can.input_low_v, can.input_high_v),
    )  # fmt: skip


def replace_limits(limits: Limits, room: "Room") -> Limits:
    """Return the limits as far as the device reaches."""
    return replace(limits, low_v=room.low_v, high_v=room.high_v)


def _file(
    separation: "Separation", runs: Runs, limits: Limits, room: "Room", folder: Path, device: Device | None,
    address: str | None,
) -> Path | None:  # fmt: skip
    """Write and prove the protocol of one set; return where it is, None where there is nothing to play."""
    if not separation.steps:
        return None
    path = _free(folder, separation.name)
    text = protocolfile.written(
        _heading(separation, limits, room, _rig_file(runs, folder), address), separation.steps, _remarks(separation)
    )
    write_text(path, text)
    protocol = parse_protocol(text, str(path))
    if device is not None and address is not None:
        session.proven(protocol, address, device)
    else:
        plan(protocol, protocol.rate_hz)
    return path


def _free(folder: Path, name: str) -> Path:
    """Return a protocol's path beside which no recording of it stands: what was recorded keeps its protocol."""
    number = 1
    path = folder / f"{name}.yaml"
    while path.with_suffix(".h5").exists():
        number += 1
        path = folder / f"{name}_{number}.yaml"
    return path


def _rig_file(runs: Runs, folder: Path) -> str:
    """Put the plain model beside the protocols, word for word, so that recordings of it belong together."""
    if runs.rig is None:
        raise RefusedError("no rig is known for these recordings", do="name the plain model with --rig RIG.yaml")
    path = folder / RIG_FILE
    if not path.exists() or path.read_text(encoding="utf-8") != runs.rig.text:
        write_text(path, runs.rig.text)
    return path.name


def _heading(
    separation: "Separation", limits: Limits, room: "Room", rig: str, address: str | None
) -> protocolfile.Heading:
    """Return the top of the protocol."""
    names = [m.label for m in separation.members if m not in separation.equal]
    told = {"low": exact(limits.low_v, "V"), "high": exact(limits.high_v, "V")}
    if limits.low_v == -limits.high_v:
        told = {"level": exact(limits.high_v, "V")}
    ramp = None
    if limits.slew_v_per_s is not None:
        told["slew"] = exact(limits.slew_v_per_s, "V/s")
        ramp = exact(max(0.1, 1.01 * max(-limits.low_v, limits.high_v) / limits.slew_v_per_s), "s")
    return protocolfile.Heading(
        f"separate {' and '.join(names)}", f"Is it {' or '.join(names)}?", rig, told, exact(room.rate_hz, "Hz"),
        address, ramp,
    )  # fmt: skip


def _remarks(separation: "Separation") -> list[str]:
    """Return the paragraphs at the top of the file."""
    odds = ", ".join(f"{m.label} {100.0 * m.probability:.0f} %" for m in separation.members)
    again = "Record it and explain again together with the recordings before; --follow-up does both."
    return [f"Written by `rig explain`, which could not decide: {odds}. {again}", f"{separation.sentence}."]
