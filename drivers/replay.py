"""How can a recording be played again, as if the device that made it were there?

``replay:RUN.h5`` answers with what was recorded, sample by sample, gaps included; ``replay:FOLDER`` has all recordings
in a folder. A recording knows no answer to what it was not asked: samples that none of them begins with are refused.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import final

import numpy as np

from identify.trace import blocks
from rig.device import RATE_TOLERANCE, Array, Block, Capabilities, Device, Flag, Identity, Samples
from rig.errors import FileError, RefusedError, UsageError
from rig.recorded import Entry, Equipment, Recording
from rig.recording import read
from rig.units import quantity

BLOCK = 4096
"""Most samples a block, as the loopback has it."""
UNKNOWN_BITS = 24
"""Of converters that a recording, an imported one say, does not tell: fine enough to leave its samples as they are."""


@dataclass
class _Run:
    """What is being replayed, and how far it is."""

    recording: Recording
    size: int
    position: int = 0


@final
class ReplayDevice(Device):
    """Recordings of one device, in its place."""

    hardware = False
    before_amplifier = False

    def __init__(self, recordings: Sequence[Recording]) -> None:
        """Take the place of the device that made ``recordings``; raise FileError when they are of several."""
        super().__init__()
        self._recordings = tuple(recordings)
        self._who, self._can = _of_one_device(self._recordings)
        self._run: _Run | None = None
        self._level: float | None = None

    @classmethod
    def connect(cls, where: str) -> "ReplayDevice":
        """Return the recordings at ``where``, a file or a folder of them; raise UsageError or FileError."""
        if not where:
            raise UsageError("no recording", where="replay:", allowed="a recording or a folder, as in replay:RUN.h5")
        path = Path(where)
        paths = sorted(path.glob("*.h5")) if path.is_dir() else [path]
        if not paths:
            raise FileError("no recording in this folder", where=where, allowed="files *.h5")
        return cls([read(each) for each in paths])

    @classmethod
    def port(cls, where: str) -> None:
        """Return None: what is replayed is only read."""

    def _identity(self) -> Identity:
        return self._who

    def _capabilities(self) -> Capabilities:
        return self._can

    def _achievable_rate(self, rate_hz: float) -> float:
        return min((recording.rate_hz for recording in self._recordings), key=lambda rate: abs(rate - rate_hz))

    def _accept(self, u: Samples, rate_hz: float) -> None:
        self._answering(u, rate_hz)

    def _answering(self, u: Samples, rate_hz: float) -> Recording:
        """Return a recording that begins with ``u``; raise RefusedError where there is none."""
        at_rate = [r for r in self._recordings if abs(r.rate_hz - rate_hz) <= RATE_TOLERANCE * rate_hz]
        alike = [_alike(recording, u, 0.5 * self._can.output_lsb_v) for recording in at_rate]
        if u.size in alike:
            return at_rate[alike.index(u.size)]
        raise RefusedError("these samples were not recorded", where=str(self._who),
                           value=f"{max(alike, default=0)} of {u.size} samples are as in a recording at {rate_hz:g} Hz",
                           allowed="samples that a recording begins with", do="play the protocol that was recorded")

    def _begin(self, u: Samples, rate_hz: float, safe_level_v: float, ramp_s: float) -> None:
        self._run = _Run(self._answering(u, rate_hz), u.size)

    def _read(self, timeout_s: float) -> Block | None:
        run = self._run
        if run is None:
            return None
        start = _next_recorded(run.recording, run.position, run.size)
        stop = min(start + BLOCK, run.size)
        there = run.recording.ledger[start:stop] == Entry.RECORDED
        stop = start + int(np.argmin(there)) if there.size and not there.all() else stop
        flags = Flag.NONE if start == run.position else Flag.LINK_LOSS
        run.position = stop
        self._level = float(run.recording.u[max(stop - 1, 0):max(stop, 1)][0])
        y, *further = [signal[start:stop] for signal in run.recording.inputs().values()][:self._inputs]
        flags |= self._clipped(y)
        return Block(start, y, flags, np.array(further)) if further else Block(start, y, flags)

    def _clipped(self, y: Array) -> Flag:
        """Return whether a reading is at an end of the range the device had."""
        edge = 0.5 * self._can.input_lsb_v
        beyond = y.size and (y.min() <= self._can.input_low_v + edge or y.max() >= self._can.input_high_v - edge)
        return Flag.CLIPPED if beyond else Flag.NONE

    def _halt(self) -> None:
        self._run = None

    def _safe(self, level_v: float, ramp_s: float) -> None:
        self._run = None
        self._level = float(self._quantise(np.array([level_v]))[0])

    def _level_v(self) -> float | None:
        return self._level

    def _close(self) -> None:
        """Release nothing: no file is open."""


def _alike(recording: Recording, u: Samples, within_v: float) -> int:
    """Return with how many samples of ``u`` a recording begins."""
    size = min(recording.u.size, u.size)
    for start, stop in blocks(0, size):
        same = np.abs(recording.u[start:stop] - u[start:stop]) <= within_v
        if not same.all():
            return start + int(np.argmin(same))
    return size


def _next_recorded(recording: Recording, start: int, stop: int) -> int:
    """Return the first sample from ``start`` on that was recorded, ``stop`` where none was."""
    there = recording.ledger[start:stop] == Entry.RECORDED
    return start + int(np.argmax(there)) if there.any() else stop


def _of_one_device(recordings: Sequence[Recording]) -> tuple[Identity, Capabilities]:
    """Return who made all recordings and what it could do; raise FileError when that was not one device."""
    first = recordings[0].origin.equipment
    for other in recordings[1:]:
        if _who(other.origin.equipment) != _who(first) or _ranges(other) != _ranges(recordings[0]):
            raise FileError("recordings of different devices or ranges", where=other.name,
                            value=str(_who(other.origin.equipment)), allowed=str(_who(first)), do="replay them apart")
    try:
        return _who(first), _can(recordings)
    except ValueError as error:
        raise FileError("settings that no device has", where=recordings[0].name, value=str(error),
                        do="identify it as it is: nothing can be replayed by it") from error


def _can(recordings: Sequence[Recording]) -> Capabilities:
    """Return what the device could do; raise ValueError for settings that say nothing of the kind."""
    low, high, input_low, input_high, output_bits, input_bits = _ranges(recordings[0]) or _seen(recordings)
    rates = [recording.rate_hz for recording in recordings]
    return Capabilities(low, high, input_low, input_high, min(rates), max(rates), int(output_bits), int(input_bits),
                        max_samples=max(recording.u.size for recording in recordings),
                        output_step_v=_step_v(recordings[0].origin.equipment),
                        inputs=min(len(recording.inputs()) for recording in recordings))


def _who(equipment: Equipment) -> Identity:
    told = (equipment.model or "unknown device", equipment.serial or "?", equipment.firmware or "?")
    return Identity(f"replay of {told[0]}", told[1], told[2])


def _step_v(equipment: Equipment) -> float | None:
    """Return the step of the output in V, as the device told it; None where it told none."""
    told = equipment.settings.get("output_step")
    return None if told is None else quantity(told, "V")


def _ranges(recording: Recording) -> tuple[float, ...] | None:
    """Return output and input range in V and bits, as the device told them; None where it told none."""
    equipment = recording.origin.equipment
    if equipment.ranges_v is None or not {"output_bits", "input_bits"} <= equipment.settings.keys():
        return None
    return (*equipment.ranges_v, int(equipment.settings["output_bits"]), int(equipment.settings["input_bits"]))


def _seen(recordings: Sequence[Recording]) -> tuple[float, ...]:
    """Return ranges twice as wide as all samples, and 0 V in their middle, where nothing better is known."""
    edge = [2.0 * max(1e-3, *map(_peak, signals)) for signals in ([r.u for r in recordings], [r.y for r in recordings])]
    return (-edge[0], edge[0], -edge[1], edge[1], UNKNOWN_BITS, UNKNOWN_BITS)


def _peak(signal: Samples) -> float:
    """Return the largest magnitude of what was received of a signal, V."""
    stretches = (np.abs(signal[start:stop]) for start, stop in blocks(0, signal.size))
    return max(float(np.max(values, initial=0.0, where=np.isfinite(values))) for values in stretches)
