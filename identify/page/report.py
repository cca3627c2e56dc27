"""What does a bench operator read: one page that opens with the verdict and needs no network and no other file?"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial
from typing import TYPE_CHECKING, Any

from identify.effects import catalogue, choices, units_of
from identify.explain.explanation import Explanation, Finding, HeldOut, Range, Verdict
from identify.identifiability.directions import undetermined
from identify.identification import FrequencyPoint, Identification
from identify.interval import Interval
from identify.model import LinearF, Model, Physics, Rational
from identify.natural_units import shown, shown_interval
from identify.observe import Observation
from identify.of_device import device_lines
from identify.page import pictures, proof_picture
from identify.page.border_picture import borders
from identify.page.drawing import AFTER, BEFORE, Picture, page_style
from identify.page.next_steps import next_steps
from identify.page.pictures import Answer
from identify.unnamed.stored import AT, is_unnamed

if TYPE_CHECKING:
    from jinja2 import Environment

FITTED = 1.1  # residual over noise up to which a fit leaves nothing beyond the noise
MOODS: dict[Verdict, str] = {
    "consistent": "good", "explained": "good", "partly_explained": "warn", "unexplained": "bad",
}  # fmt: skip

STAGES = (
    ("source", "generator, DAC"), ("G1", "linear, before F"), ("F", "backlash or line"), ("G2", "linear, behind F"),
    ("sense", "reading, ADC"),
)  # fmt: skip


@dataclass(frozen=True)
class Imprint:
    """What stands on a page beside the answer: the model as the text of a rig file, and what made the page."""

    model_text: str = ""
    versions: Mapping[str, str] = field(default_factory=dict)


def identification_page(found: Identification, imprint: Imprint = Imprint()) -> str:
    """Return the page of ``rig identify``: HTML with its pictures inside."""
    ratio = found.rms_v / found.noise.rms_v
    return page("identification.html", imprint, {
        "title": f"{found.model.title}: identified",
        "kicker": "Identified rig",
        "mood": "good" if ratio <= FITTED else "warn",
        "headline": identification_sentence(found),
        "subline": f"{found.model.title}; runs: {', '.join(o.trace.name for o in found.observations)}",
        "borders": _borders(found),
        "bend": found.bend.sentence if found.bend else "", "curves": _curves(found),
        "line": line_sentence(found.model), "blocks": _blocks(found),
        "physics": physics_lines(found.model), "responses": _responses(found), "fit": _fit(found),
        "not_identifiable": found.not_identifiable, "warnings": found.warnings,
        "devices": list(device_lines([o.trace for o in found.observations])),
        "pictures": _identification_pictures(found),
    })  # fmt: skip


def explanation_page(
    told: Explanation, found: Identification | None = None, imprint: Imprint = Imprint()
) -> str:
    """Return the page of ``rig explain``; ``found`` adds the staircase of the improved model."""
    return page("explanation.html", imprint, {
        "title": f"{told.model.title}: {told.verdict.replace('_', ' ')}",
        "kicker": told.verdict.replace("_", " "), "mood": MOODS[told.verdict],
        "headline": told.sentence, "subline": _mismatch(told),
        "stages": STAGES, "location": _location(told), "effects": [_effect(finding) for finding in told.effects],
        "training": {
            "runs": ", ".join(o.trace.name for o in told.train), "before": shown(told.training.before_v, "V"),
            "after": shown(told.training.after_v, "V"),
        },
        "held_out": _held_out(told.held_out), "noise": shown(told.noise.rms_v, "V"), "noise_from": told.noise.origin,
        "remaining": told.remaining.sentence, "over_noise": f"{told.remaining.over_noise:.3g}",
        "devices": list(device_lines([o.trace for o in (*told.train, *told.test)])),
        "next_steps": next_steps(told), "warnings": told.warnings, "pictures": _explanation_pictures(told, found),
    })  # fmt: skip


def identification_sentence(found: Identification) -> str:
    """Return the verdict on an identification in one sentence."""
    ratio = found.rms_v / found.noise.rms_v
    head = f"The fitted model follows the recordings to {shown(found.rms_v, 'V', 3)} rms"
    noise = f"the noise of a reading is {shown(found.noise.rms_v, 'V', 3)}"
    if not found.fit.converged:
        return f"The fit did not settle ({found.fit.sentence}), so its numbers are provisional."
    if ratio <= FITTED:
        return f"{head}; {noise}, so nothing beyond the noise is left."
    return f"{head}, {ratio:.3g} times the noise ({shown(found.noise.rms_v, 'V', 3)}): the model lacks something."


def finding_lines(finding: Finding) -> list[tuple[str, str]]:
    """Return the parameters of a finding by name, each with its interval in natural units."""
    return [(name, shown_interval(interval, unit)) for name, (interval, unit) in finding.parameters.items()]


def page(template: str, imprint: Imprint, content: Mapping[str, Any]) -> str:
    """Return the page that a template makes of its content, with the model's text and the versions under it."""
    return _templates().get_template(template).render(
        content, model_text=imprint.model_text, versions=imprint.versions)  # fmt: skip


@cache
def _templates() -> "Environment":
    from jinja2 import Environment, PackageLoader, StrictUndefined

    loader = PackageLoader("identify.page")
    return Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True)


def _identification_pictures(found: Identification) -> list[Picture]:
    answer = [Answer("fitted model", AFTER, found.fit.chain, pictures.beginnings(found.observations))]
    return _drawn(
        lambda: pictures.staircase(found), lambda: borders(found.bend) if found.bend else None,
        lambda: pictures.loop(answer), lambda: pictures.residuals(answer),
        lambda: pictures.spectra(answer), lambda: pictures.frequency_response(found),
    )  # fmt: skip


def _explanation_pictures(told: Explanation, found: Identification | None) -> dict[str, list[Picture]]:
    """Return the pictures of each part of the page; ``shapes`` holds one a finding that has one, in their order."""
    test, every = _answers(told, joined(told.test)), _answers(told, joined((*told.train, *told.test)))
    return {
        "where": _drawn(
            lambda: proof_picture.stages(told), lambda: pictures.mismatch(told.profiles, told.noise.rms_v),
        ),
        "shapes": _drawn(*(partial(proof_picture.shape, finding) for finding in told.effects)),
        "proof": _drawn(lambda: proof_picture.before_and_after(test[0], test[1] if len(test) > 1 else None)),
        "details": _drawn(
            lambda: pictures.residuals(every), lambda: pictures.staircase(found) if found else None,
            lambda: pictures.loop(every), lambda: pictures.spectra(every),
            lambda: pictures.frequency_response(found) if found else None,
        ),
    }  # fmt: skip


def _answers(told: Explanation, observations: Sequence[Observation]) -> list[Answer]:
    """Return the plain model's answer to runs, and the improved one's where there is one."""
    runs = pictures.beginnings(observations)
    plain = Answer("plain model", BEFORE, told.plain.chain, runs)
    return [plain, Answer("improved model", AFTER, told.improved.chain, runs)] if told.effects else [plain]


def joined(observations: Sequence[Observation]) -> tuple[Observation, ...]:
    """Return one observation a run, using every sample that is used in any of its parts."""
    whole: dict[str, Observation] = {}
    for part in observations:
        seen = whole.get(part.trace.name)
        whole[part.trace.name] = part if seen is None else replace(part, use=seen.use | part.use)
    return tuple(whole.values())


def _drawn(*draw: Callable[[], Picture | None]) -> list[Picture]:
    """Return the pictures there is something to draw for."""
    with page_style():
        return [picture for picture in (make() for make in draw) if picture is not None]


def _borders(found: Identification) -> list[dict[str, str]]:
    def text(intervals: Mapping[str, Interval], name: str) -> str:
        return shown_interval(intervals[name], "V" if name.startswith("D") else "V/V") if name in intervals else "-"

    return [
        {"name": name, "normalised": text(found.borders, name), "own": text(found.own_scale, name)}
        for name in found.borders
    ]  # fmt: skip


def _curves(found: Identification) -> list[dict[str, str]]:
    """Return the knots of the borders in the rig's own scale."""
    curves = found.bend.curves if found.bend else {}
    return [
        {"side": side, "v": shown(point.v_v, "V"), "w": shown_interval(point.w_v, "V")}
        for side, points in curves.items() for point in points
    ]  # fmt: skip


def line_sentence(model: Model) -> str:
    """Return F in words where it has no memory, nothing where it has."""
    if isinstance(model.f, LinearF):
        return f"F is a straight line: w = {model.f.gain:.6g} v + {shown(model.f.offset_v, 'V')}."
    return ""


def _blocks(found: Identification) -> list[dict[str, str]]:
    def row(name: str, block: Rational) -> dict[str, str]:
        num, den = (", ".join(f"{c:.6g}" for c in side) for side in (block.num, block.den))
        late = shown_interval(found.delay, "s") if block.dead_time_s else "none"
        den = f"{den} ({note})" if (note := block_note(found, name)) else den
        return {"name": name, "num": num, "den": den, "dead_time": late}

    return [row(name, block) for name, block in zip(("G1", "G2"), found.blocks, strict=True)]


def block_note(found: Identification, name: str) -> str:
    """Return what to say beside a block's coefficients when not all of them are told; nothing when they are."""
    open_ = any(n.startswith(f"{name}.") for n in undetermined(found.fit))
    return "not all of it told, see what these recordings cannot tell" if open_ else ""


def physics_lines(model: Model) -> list[tuple[str, str, str]]:
    """Return every piece of physics in a model: its id, its stage, its values in natural units."""
    return [(piece.id, piece.stage or choices(piece.id).stages[0], _values(piece)) for piece in model.physics]


def _values(piece: Physics) -> str:
    """Return the values of a piece of physics; of an unnamed one, which has many, what they are."""
    units = units_of(piece)
    if is_unnamed(piece.id):
        weights = [value for name, value in piece.values.items() if not name.startswith(AT)]
        return f"{piece.form}: {len(weights)} weights, all in the model below"
    return ", ".join(f"{name} {shown(value, units[name])}" for name, value in piece.values.items() if name in units)


def _responses(found: Identification) -> list[dict[str, str]]:
    def row(name: str, point: FrequencyPoint) -> dict[str, str]:
        return {
            "name": name, "frequency": shown(point.frequency_hz, "Hz"), "gain": shown_interval(point.gain),
            "phase": shown_interval(point.phase_rad, "rad"),
        }  # fmt: skip

    return [row(name, point) for name, points in (("G1", found.g1), ("G2", found.g2)) for point in points]


def _fit(found: Identification) -> dict[str, str]:
    return {
        "rms": shown(found.rms_v, "V"), "noise": shown(found.noise.rms_v, "V"), "noise_from": found.noise_words,
        "percent": f"{found.fit_percent:.4g} %", "search": found.fit.sentence,
    }  # fmt: skip


def _mismatch(told: Explanation) -> str:
    noise = told.noise.rms_v
    size = f"{shown(told.mismatch_v, 'V', 3)} rms, {told.mismatch_v / noise:.3g} times the noise"
    source = f"{shown(noise, 'V', 3)}, from {told.noise.origin}"
    return f"{told.model.title}: recording and plain model differ by {size} ({source})."


def _location(told: Explanation) -> dict[str, Any] | None:
    if told.location is None:
        return None
    found = told.location
    return {
        "stage": found.stage, "sentence": found.sentence, "alternatives": found.alternatives,
        "where": [_range(part) for part in found.where],
    }  # fmt: skip


def _range(part: Range) -> dict[str, str]:
    return {
        "axis": part.axis, "low": shown(part.low, part.unit), "high": shown(part.high, part.unit),
        "share": f"{100.0 * part.share:.0f} %",
    }  # fmt: skip


def _effect(finding: Finding) -> dict[str, Any]:
    others = [(o.id.replace("_", " "), o.stage, o.probability) for o in finding.could_also_be]
    return {
        "name": _name(finding.id), "sentence": finding.sentence, "parameters": finding_lines(finding),
        "equation": finding.equation, "stage": finding.stage, "form": f", form {finding.form}" if finding.form else "",
        "probability": percent(finding.probability), "would_separate": finding.would_separate,
        "others": len(others),
        "odds": [
            {"name": name, "stage": stage, "percent": percent(p), "width": f"{100.0 * p:.0f}"}
            for name, stage, p in ((_name(finding.id), finding.stage, finding.probability), *others)
        ],
        "drawn": finding.shape is not None, "unnamed": is_unnamed(finding.id),
    }  # fmt: skip


def _name(id_: str) -> str:
    """Return what an effect is called, its everyday name behind it where the catalogue has one."""
    kind, name = catalogue().get(id_), id_.replace("_", " ")
    return f"{name} ({kind.title})" if kind is not None and kind.title != name else name


def _held_out(held: HeldOut) -> dict[str, str]:
    before, after = held.residuals.before_v, held.residuals.after_v
    return {
        "runs": ", ".join(held.runs) or "parts of the runs", "how": held.how, "before": shown(before, "V"),
        "after": shown(after, "V"), "named": shown(held.named_v, "V") if before > held.named_v > after else "",
    }  # fmt: skip


def percent(probability: float) -> str:
    """Return a probability in words that never claim certainty."""
    return "over 99 %" if probability > 0.99 else "below 1 %" if probability < 0.01 else f"{100.0 * probability:.0f} %"
