"""What is known of a device from a cable between its output and its input, of which runs is it true, where is it kept?

A calibration is a JSON file. It holds for the device it was made on, told by its identity, at the rate and ranges of
the calibration, for a year. Where it is put by default, `rig run` finds it and keeps it in the recording.
"""

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path

from pydantic import Field

from identify.interval import Interval
from identify.natural_units import shown
from rig.forms import Form
from rig.recorded import Equipment
from rig.yamlfile import parse_json, read_text

SCHEMA = "rig.calibration/1"
FOLDER_VARIABLE = "RIG_CALIBRATIONS"
AGE = timedelta(days=365)
SAME_RATE = 1e-6
"""Relative."""
PART_OF_SAMPLE = 0.05
"""Half the interval of a delay, over the sample period, up to which the delay is left out of the rig's."""


@dataclass(frozen=True)
class Calibration:
    """What a cable told: times in s, levels in V, gain in V/V, skew in ppm. ``made`` is UTC, ISO 8601.

    ``input_step`` is None where the readings lie on no grid. ``assumes`` says what the numbers rest on.
    """

    model: str
    serial: str
    firmware: str
    rate_hz: float
    ranges_v: tuple[float, ...]
    level_v: float
    made: str
    delay: Interval
    time_constant: Interval
    skew: Interval
    gain: Interval
    offset: Interval
    noise: Interval
    input_step: Interval | None
    input_skews: Mapping[str, Interval]
    warnings: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, object]:
        """Return the form of the file."""
        told = {name: interval.to_dict(unit) for name, (interval, unit) in self._quantities().items()}
        return {
            "schema": SCHEMA, "made": self.made,
            "device": {"model": self.model, "serial": self.serial, "firmware": self.firmware},
            "valid": {"rate_hz": self.rate_hz, "ranges_v": list(self.ranges_v), "level_v": self.level_v},
            **told, "input_step": self.input_step.to_dict("V") if self.input_step else None,
            "input_skews": {name: skew.to_dict("s") for name, skew in self.input_skews.items()},
            "warnings": list(self.warnings),
        }  # fmt: skip

    def _quantities(self) -> dict[str, tuple[Interval, str]]:
        return {
            "delay": (self.delay, "s"), "time_constant": (self.time_constant, "s"), "skew": (self.skew, "ppm"),
            "gain": (self.gain, "V/V"), "offset": (self.offset, "V"), "noise": (self.noise, "V"),
        }  # fmt: skip

    @property
    def origin(self) -> str:
        """Return where its numbers come from, in words."""
        return f"calibration of {self.model} {self.serial} at {shown(self.rate_hz, 'Hz')}, {self.made[:10]}"

    def not_for(self, equipment: Equipment, rate_hz: float, started: str) -> str | None:
        """Return why this is not true of a run, None when it is."""
        who = (equipment.model, equipment.serial, equipment.firmware)
        if who != (self.model, self.serial, self.firmware):
            return f"it is of {self.model} {self.serial} {self.firmware}, the run of {' '.join(who)}"
        if abs(rate_hz / self.rate_hz - 1.0) > SAME_RATE:
            return f"it is at {shown(self.rate_hz, 'Hz')}, the run at {shown(rate_hz, 'Hz')}"
        if equipment.ranges_v is not None and equipment.ranges_v != self.ranges_v:
            return f"it is of the ranges {_ranges(self.ranges_v)}, the run of {_ranges(equipment.ranges_v)}"
        if started and abs(_time(started) - _time(self.made)) > AGE:
            return f"it is of {self.made[:10]}, the run of {started[:10]}: more than a year apart"
        return None

    def delay_not_used(self) -> str | None:
        """Return why the delay is not left out of the rig's, None when it is."""
        half_s = 0.5 * (self.delay.high - self.delay.low)
        if half_s * self.rate_hz > PART_OF_SAMPLE:
            return (f"it is told only to ± {shown(half_s, 's', 2)}, more than a twentieth of a sample: a resistor and "
                    "a capacitor of about a sample period in the cable tell it better")
        if self.delay.value < 0.0:
            return "it is below 0"
        return None


def _ranges(volts: tuple[float, ...]) -> str:
    return ", ".join(f"{value:g}" for value in volts) + " V"


def _time(text: str) -> datetime:
    return datetime.fromisoformat(text)


class IntervalForm(Form):
    """A value with its 95 % interval."""

    value: float
    unit: str
    ci95: list[float] = Field(min_length=2, max_length=2)

    def interval(self) -> Interval:
        """Return it as an interval."""
        return Interval(self.value, *self.ci95)


class DeviceForm(Form):
    """Which device was calibrated."""

    model: str
    serial: str
    firmware: str


class ValidForm(Form):
    """With which settings."""

    rate_hz: float = Field(gt=0)
    ranges_v: list[float]
    level_v: float = Field(gt=0)


class CalibrationForm(Form):
    """The file."""

    schema_: str = Field(alias="schema", pattern=f"^{SCHEMA}$")
    made: str
    device: DeviceForm
    valid: ValidForm
    delay: IntervalForm
    time_constant: IntervalForm
    skew: IntervalForm
    gain: IntervalForm
    offset: IntervalForm
    noise: IntervalForm
    input_step: IntervalForm | None
    input_skews: dict[str, IntervalForm]
    warnings: list[str]


def parse_calibration(text: str, where: str) -> Calibration:
    """Return the calibration in ``text``; ``where`` names it in messages; raise FileError."""
    document = parse_json(text, where)
    form = CalibrationForm.read(document)
    try:
        _time(form.made)
    except ValueError as error:
        raise document.error("not a time", "made", value=repr(form.made), allowed="ISO 8601, UTC") from error
    names = ("delay", "time_constant", "skew", "gain", "offset", "noise")
    return Calibration(
        **form.device.model_dump(), rate_hz=form.valid.rate_hz, ranges_v=tuple(form.valid.ranges_v),
        level_v=form.valid.level_v, made=form.made, warnings=tuple(form.warnings),
        **{name: getattr(form, name).interval() for name in names},
        input_step=form.input_step.interval() if form.input_step else None,
        input_skews={name: skew.interval() for name, skew in form.input_skews.items()},
    )  # fmt: skip


def read_calibration(path: str | Path) -> Calibration:
    """Return the calibration in a file; raise FileError."""
    return parse_calibration(read_text(Path(path)), str(path))


def usual_path(equipment: Equipment, rate_hz: float) -> Path:
    """Return where the calibration of a device at a rate is kept by default."""
    data = os.environ.get("XDG_DATA_HOME") or str(Path.home() / ".local" / "share")
    folder = Path(os.environ.get(FOLDER_VARIABLE) or Path(data) / "backlash-rig" / "calibrations")
    name = "-".join((equipment.model, equipment.serial, f"{rate_hz:.9g} Hz"))
    return folder / f"{re.sub(r'[^A-Za-z0-9.+-]+', '_', name)}.json"


def kept_for(equipment: Equipment, rate_hz: float, now: str) -> str:
    """Return the text of the calibration kept for a device where it is true of a run now, empty where there is none."""
    path = usual_path(equipment, rate_hz)
    if not path.is_file():
        return ""
    text = read_text(path)
    return "" if parse_calibration(text, str(path)).not_for(equipment, rate_hz, now) else text
