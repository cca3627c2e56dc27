"""What does a protocol file ask for: which question, on which rig, within which limits, in which steps?"""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator

from rig.errors import FileError, MisfitError, unknown
from rig.forms import Form, Rate, Seconds, Volts
from rig.limits import Limits, LimitsForm
from rig.references import file_meant
from rig.rigfile import RigFile, read_rig
from rig.steps import STIMULI, Count
from rig.stimulus import Stimulus
from rig.yamlfile import Document, parse_yaml, read_text

STEP_KEYS = ("label", "repeats")
SIGNAL = re.compile(r"[A-Za-z]\w{0,39}", re.ASCII)
RETRY = re.compile(r"retry ([1-9][0-9]?)")
NAMES: dict[str, Any] = {"items": {"type": "string", "pattern": rf"^(?!u$){SIGNAL.pattern}$"}, "uniqueItems": True}


@dataclass(frozen=True)
class ProtocolStep:
    """One stimulus, played ``repeats`` times in a row; ``where`` is its file, line and key."""

    label: str
    stimulus: Stimulus
    repeats: int
    where: str


@dataclass(frozen=True)
class Protocol:
    """A protocol as its file describes it. ``rig`` is the file it names, ``device`` an address; both may be absent.

    ``inputs`` names what is wired to inputs 1, 2, ... of the device; the first is y.
    ``retries``: how often a step that lost samples, and what follows it, is played again in a segment of its own.
    """

    title: str
    question: str
    path: str
    text: str
    limits: Limits
    rate_hz: float
    steps: tuple[ProtocolStep, ...]
    repeats: int = 1
    safe_level_v: float = 0.0
    ramp_s: float = 0.1
    rig_path: str | None = None
    rig: RigFile | None = None
    device: str | None = None
    inputs: tuple[str, ...] = ("y",)
    retries: int = 0


class AcquisitionForm(Form):
    """The sample clock: in Hz, or so many times a stimulus frequency (``628 x 0.01 rad/s``); and what is recorded.

    ``inputs`` names what is wired to the device's inputs 1, 2, ...: y, and further signals to be kept beside it.
    ``u_measured`` is the output read back.
    """

    rate: Rate
    inputs: list[str] = Field(default_factory=lambda: ["y"], json_schema_extra=NAMES)

    @field_validator("inputs")
    @classmethod
    def _named(cls, inputs: list[str]) -> list[str]:
        wrong = next((name for name in inputs if not SIGNAL.fullmatch(name)), None)
        if wrong is not None:
            raise MisfitError("not a name for an input", value=repr(wrong), allowed="letters, digits and _, as in w_2")
        if "u" in inputs:
            raise MisfitError("u is what is put out, not an input", do="call an input that reads it back 'u_measured'")
        if inputs[:1] != ["y"] or len(set(inputs)) < len(inputs):
            raise MisfitError("the inputs are y and further ones, each named once", value=", ".join(inputs) or "none",
                              allowed="for example [y, u_measured, v]")
        return inputs


class ProtocolForm(Form):
    """The top of a protocol file; its steps are read one by one."""

    spec: Literal[1] = Field(description="The form of this file: 1.")
    title: str = Field(min_length=1, description="What it is called, in lists and reports.")
    question: str = Field(min_length=1, description="The question it answers.")
    limits: LimitsForm
    acquisition: AcquisitionForm
    steps: list[Any]
    rig: str | None = Field(None, description="The rig file, beside this protocol or one that comes with the program.")
    device: str | None = Field(None, description="The address it is played at when none is typed.")
    repeats: Annotated[Count, Field(description="How often all steps are played.")] = 1
    safe_level: Annotated[Volts, Field(description="Where the output begins and ends.")] = 0.0
    ramp: Annotated[Seconds, Field(description="How long the way to the safe level takes.")] = 0.1
    on_overrun: str = Field("report", description="What is done about lost samples: report, or retry N.",
                            json_schema_extra={"pattern": f"^(report|{RETRY.pattern})$"})


class StepForm(Form):
    """What every step may say beside its stimulus."""

    label: str | None = Field(default=None, min_length=1, max_length=80)
    repeats: Count = 1


def read_protocol(path: str | Path, rig: Path | None = None) -> Protocol:
    """Return the protocol in the YAML file at ``path``, on another ``rig`` than it names; raise FileError."""
    return parse_protocol(read_text(Path(path)), str(path), rig)


def parse_protocol(text: str, where: str, rig: Path | None = None) -> Protocol:
    """Return the protocol in ``text``; ``where`` is its path, which the rig it names stands by; raise FileError.

    ``rig`` is a rig file to take in place of the one it names.
    """
    document = parse_yaml(text, where)
    if document.data is None:
        raise document.error("the file is empty", do="a protocol starts with 'spec: 1'")
    form = ProtocolForm.read(document)
    rig_path = rig or (None if form.rig is None else _find_rig(document, form.rig))
    rig_file = None if rig_path is None else read_rig(rig_path)
    return Protocol(
        title=form.title, question=form.question, path=where, text=text, limits=_limits(document, form, rig_file),
        rate_hz=form.acquisition.rate, steps=_steps(document, form.steps), repeats=form.repeats,
        safe_level_v=form.safe_level, ramp_s=form.ramp, rig_path=None if rig_path is None else str(rig_path),
        rig=rig_file, device=form.device, inputs=tuple(form.acquisition.inputs),
        retries=_retries(document, form.on_overrun),
    )


def _limits(document: Document, form: ProtocolForm, rig: RigFile | None) -> Limits:
    """Return the limits of protocol and rig, the narrower on each side."""
    whose = f"the rig file {Path(rig.where).name}" if rig else ""
    try:
        return form.limits.limits().within(rig.limits if rig else None, whose)
    except MisfitError as error:
        raise error.placed(document.at("limits")) from error


def _retries(document: Document, asked: str) -> int:
    """Return how often what was lost is played again."""
    found = RETRY.fullmatch(asked)
    if asked != "report" and found is None:
        raise document.error("not what can be done about lost samples", "on_overrun", value=repr(asked),
                             allowed="report, or retry N with N from 1 to 99")
    return int(found[1]) if found else 0


def _find_rig(document: Document, name: str) -> Path:
    """Return the rig file ``name``, beside the protocol or among those installed."""
    try:
        found = file_meant(name, Path(document.where).parent)
    except MisfitError as error:
        raise error.placed(document.at("rig")) from error
    if found is None:
        raise document.error("no such rig file", "rig", value=name, do="give its path as seen from this protocol")
    return found


def _steps(document: Document, steps: list[Any]) -> tuple[ProtocolStep, ...]:
    if not steps:
        raise document.error("there is nothing to play", "steps", allowed="at least one step")
    return tuple(_step(document, index, step) for index, step in enumerate(steps))


def _step(document: Document, index: int, step: object) -> ProtocolStep:
    """Return one step: a mapping with one stimulus, and perhaps a label and repeats."""
    if not isinstance(step, dict):
        raise document.error("a step is a mapping", "steps", index, value=repr(step), allowed=", ".join(STIMULI))
    for key in step:
        if key not in STIMULI and key not in STEP_KEYS:
            raise FileError(where=document.at("steps", index, key), **unknown("key", key, [*STIMULI, *STEP_KEYS]))
    kinds = [key for key in step if key in STIMULI]
    if len(kinds) != 1:
        raise document.error("a step has one stimulus", "steps", index, value=" and ".join(kinds) or "none",
                             allowed=", ".join(STIMULI), do="start a new step with '-'")
    return _whole_step(document, index, kinds[0], {key: step[key] for key in STEP_KEYS if key in step})


def _whole_step(document: Document, index: int, kind: str, beside: dict[str, Any]) -> ProtocolStep:
    stimulus = STIMULI[kind].read(document, "steps", index, kind)
    form = StepForm.of(document, ("steps", index), beside)
    return ProtocolStep(form.label or stimulus.title(), stimulus, form.repeats, document.at("steps", index, kind))


def limits_in(text: str) -> Limits | None:
    """Return the limits a protocol's text declares; None where there is no such text."""
    if not text.strip():
        return None
    document = parse_yaml(text, "the protocol in the recording")
    return LimitsForm.read(document, "limits").limits()
