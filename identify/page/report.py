"""What does a bench operator read: one page that opens with the verdict, and shows at first glance what it means?"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from identify.effects import catalogue, choices, units_of
from identify.explain.confirm import adapted
from identify.explain.explanation import Explanation, Finding, Range, Verdict
from identify.identifiability.directions import undetermined
from identify.identification import FrequencyPoint, Identification
from identify.interval import Interval
from identify.model import LinearF, Model, Physics, Rational
from identify.natural_units import shown, shown_interval
from identify.observe import Observation, joined
from identify.of_device import device_lines
from identify.page import place_pictures, rig_pictures, signal_pictures
from identify.page.answers import Answer, beginnings
from identify.page.border_picture import borders
from identify.page.document import NOTHING, Imprint, Page, begun
from identify.page.drawing import AFTER, BEFORE, Picture
from identify.page.next_steps import next_steps
from identify.unnamed.stored import AT, is_unnamed

DECIDED = 0.95  # probability of a finding from which its rivals need not stand beside the verdict
FITTED = 1.1  # residual over noise up to which a fit leaves nothing beyond the noise
MOODS: dict[Verdict, str] = {
    "consistent": "good", "explained": "good", "partly_explained": "warn", "unexplained": "bad",
}  # fmt: skip

STAGES = (
    ("source", "generator, DAC"), ("G1", "linear, before F"), ("F", "backlash or line"), ("G2", "linear, behind F"),
    ("sense", "reading, ADC"),
)  # fmt: skip


def identification_page(found: Identification, imprint: Imprint = NOTHING) -> Page:
    """Return the page of ``rig identify``."""
    ratio = found.rms_v / found.noise.rms_v
    answer = [Answer("fitted model", AFTER, found.fit.chain, beginnings(found.observations))]
    return Page("identification.html", imprint, {
        "title": f"{found.model.title}: identified",
        "kicker": "Identified rig",
        "mood": "good" if ratio <= FITTED else "warn",
        "headline": identification_sentence(found),
        "subline": f"{found.model.title}; runs: {', '.join(o.trace.name for o in found.observations)}",
        "glance": _present(signal_pictures.glance(answer)),
        "borders": _borders(found),
        "bend": found.bend.sentence if found.bend else "", "curves": _curves(found),
        "line": line_sentence(found.model), "blocks": _blocks(found),
        "physics": [(_spaced(id_), stage, values) for id_, stage, values in physics_lines(found.model)],
        "responses": _responses(found), "fit": _fit(found),
        "not_identifiable": [(item.what, item.because, item.fixed_by) for item in found.not_identifiable],
        "warnings": found.warnings,
        "devices": list(device_lines([o.trace for o in found.observations])),
        "pictures": _identification_pictures(found, answer),
    })  # fmt: skip


def explanation_page(
    told: Explanation, found: Identification | None = None, imprint: Imprint = NOTHING
) -> Page:
    """Return the page of ``rig explain``; ``found`` adds the staircase of the improved model."""
    return Page("explanation.html", imprint, {
        "title": f"{told.model.title}: {_spaced(told.verdict)}",
        "kicker": _spaced(told.verdict), "mood": MOODS[told.verdict],
        "headline": told.sentence, "subline": _mismatch(told),
        "undecided": [_undecided(finding) for finding in told.effects if finding.probability < DECIDED],
        "stages": STAGES, "location": _location(told), "effects": [_effect(finding) for finding in told.effects],
        "others": told.rig_file.rows, "rig_file_rms": shown(told.rig_file.rms_v, "V", 3),
        "proof": _proof(told), "held_out_how": told.held_out.how, "noise_from": told.noise.origin,
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


def _identification_pictures(found: Identification, answer: Sequence[Answer]) -> list[Picture]:
    return _present(
        rig_pictures.staircase(found), borders(found.bend) if found.bend else None, rig_pictures.loop(answer),
        rig_pictures.frequency_response(found), signal_pictures.residuals(answer, "Residual of the fit"),
        signal_pictures.spectra(answer),
    )  # fmt: skip


def _explanation_pictures(told: Explanation, found: Identification | None) -> dict[str, list[Picture]]:
    """Return the pictures of each part of the page; ``shapes`` holds one a finding that has one, in their order."""
    every = _answers(told)
    train, test = (_on(every, runs) for runs in (told.train, told.test))
    return {
        "glance": _present(signal_pictures.glance(test, "held out") if told.test else signal_pictures.glance(train)),
        "where": _present(place_pictures.stages(told), place_pictures.mismatch(told.profiles, told.noise.rms_v)),
        "shapes": _present(*(place_pictures.shape(finding) for finding in told.effects)),
        "proof": _present(signal_pictures.residuals(test, "On data kept back")),
        "details": _present(
            signal_pictures.residuals(train, "On the data fitted"), rig_pictures.staircase(found) if found else None,
            rig_pictures.loop(every), signal_pictures.spectra(every),
            rig_pictures.frequency_response(found) if found else None,
        ),
    }  # fmt: skip


def at_first_glance(told: Explanation) -> list[Picture]:
    """Return the picture of where recording and plain model differ most, on what was held out where there is any."""
    answers = _on(_answers(told), told.test or told.train)
    return _present(signal_pictures.glance(answers, "held out" if told.test else ""))


def rig_at_first_glance(found: Identification) -> list[Picture]:
    """Return the pictures of the borders, or of what F does where no staircase shows them, and of G1 and G2."""
    answer = [Answer("fitted model", AFTER, found.fit.chain, beginnings(found.observations))]
    shape = rig_pictures.staircase(found) or rig_pictures.loop(answer)
    return _present(shape, rig_pictures.frequency_response(found))


def _answers(told: Explanation) -> list[Answer]:
    """Return the plain model's answer to all runs, and the improved one's where there is one.

    What is a run's own, such as the phase of the mains, is fitted to runs that were held out, as in the proof.
    """
    runs = beginnings(joined((*told.train, *told.test)))
    plain = adapted(told.plain.chain, runs)
    if told.verdict == "consistent":
        return [Answer("model", AFTER, plain, runs)]
    answer = Answer("plain model", BEFORE, plain, runs)
    improved = Answer("improved model", AFTER, adapted(told.improved.chain, runs), runs)
    return [answer, improved] if told.effects else [answer]


def _on(answers: Sequence[Answer], observations: Sequence[Observation]) -> list[Answer]:
    """Return answers to some of the runs."""
    runs = beginnings(joined(observations))
    return [replace(answer, observations=runs) for answer in answers]


def _present(*drawn: Picture | None) -> list[Picture]:
    """Return the pictures there is something to draw for."""
    return [picture for picture in drawn if picture is not None]


def _borders(found: Identification) -> list[tuple[str, str, str]]:
    def text(intervals: Mapping[str, Interval], name: str) -> str:
        return shown_interval(intervals[name], "V" if name.startswith("D") else "V/V") if name in intervals else "-"

    return [(name, text(found.borders, name), text(found.own_scale, name)) for name in found.borders]


def _curves(found: Identification) -> list[tuple[str, str, str]]:
    """Return the knots of the borders in the rig's own scale."""
    curves = found.bend.curves if found.bend else {}
    return [
        (side, shown(point.v_v, "V"), shown_interval(point.w_v, "V"))
        for side, points in curves.items() for point in points
    ]  # fmt: skip


def line_sentence(model: Model) -> str:
    """Return F in words where it has no memory, nothing where it has."""
    if isinstance(model.f, LinearF):
        return f"F is a straight line: w = {model.f.gain:.6g} v + {shown(model.f.offset_v, 'V')}."
    return ""


def _blocks(found: Identification) -> list[tuple[str, str, str, str]]:
    def row(name: str, block: Rational) -> tuple[str, str, str, str]:
        num, den = (", ".join(f"{c:.6g}" for c in side) for side in (block.num, block.den))
        late = shown_interval(found.delay, "s") if block.dead_time_s else "none"
        den = f"{den} ({note})" if (note := block_note(found, name)) else den
        return name, num, den, late

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


def _responses(found: Identification) -> list[tuple[str, str, str, str]]:
    def row(name: str, point: FrequencyPoint) -> tuple[str, str, str, str]:
        phase = shown_interval(point.phase_rad, "rad")
        return name, shown(point.frequency_hz, "Hz"), shown_interval(point.gain), phase

    return [row(name, point) for name, points in (("G1", found.g1), ("G2", found.g2)) for point in points]


def _fit(found: Identification) -> list[tuple[str, str]]:
    return [
        ("residual, rms", shown(found.rms_v, "V")),
        ("noise of a reading, rms", f"{shown(found.noise.rms_v, 'V')} ({found.noise_words})"),
        ("fit", f"{found.fit_percent:.4g} % of the variation of y"), ("search", found.fit.sentence),
    ]  # fmt: skip


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
        "stage": found.stage, "sentence": begun(found.sentence), "alternatives": found.alternatives,
        "where": [_range(part) for part in found.where],
    }  # fmt: skip


def _range(part: Range) -> tuple[str, str, str, str]:
    return part.axis, shown(part.low, part.unit), shown(part.high, part.unit), f"{100.0 * part.share:.0f} %"


def _effect(finding: Finding) -> dict[str, Any]:
    others = [(_spaced(o.id), o.stage, o.probability) for o in finding.could_also_be]
    return {
        "name": _name(finding.id), "sentence": begun(finding.sentence), "parameters": finding_lines(finding),
        "equation": finding.equation, "stage": finding.stage, "form": f", form {finding.form}" if finding.form else "",
        "probability": percent(finding.probability), "would_separate": finding.would_separate,
        "others": len(others),
        "odds": [
            {"name": name, "stage": stage, "percent": percent(p), "width": f"{100.0 * p:.0f}"}
            for name, stage, p in ((_name(finding.id), finding.stage, finding.probability), *others)
        ],
        "drawn": finding.shape is not None, "unnamed": is_unnamed(finding.id),
    }  # fmt: skip


def _undecided(finding: Finding) -> str:
    """Return which physics these recordings leave open, with the odds."""
    named = [(finding.id, finding.stage, finding.probability), *((o.id, o.stage, o.probability)
                                                                 for o in finding.could_also_be)]  # fmt: skip
    return " or ".join(f"{_spaced(id_)} at {stage} ({percent(p)})" for id_, stage, p in named)


def _spaced(id_: str) -> str:
    return id_.replace("_", " ")


def _name(id_: str) -> str:
    """Return what an effect is called, its everyday name behind it where the catalogue has one."""
    kind, name = catalogue().get(id_), _spaced(id_)
    return f"{name} ({kind.title})" if kind is not None and kind.title != name else name


def _proof(told: Explanation) -> list[tuple[str, str, str, str]]:
    """Return what the models leave of the data: fitted, held out, and held out with the named physics alone."""
    held, noise = told.held_out, shown(told.noise.rms_v, "V")
    before, after = held.residuals.before_v, held.residuals.after_v
    fitted, kept = ", ".join(o.trace.name for o in told.train), ", ".join(held.runs) or "parts of the runs"
    named = any(not is_unnamed(finding.id) for finding in told.effects)
    rows = [
        (f"fitted ({fitted})", told.training.before_v, told.training.after_v),
        (f"held out ({kept})", before, after),
        *([("held out, named physics alone", before, held.named_v)] if named and before > held.named_v > after else []),
    ]
    return [(name, shown(one, "V"), shown(other, "V"), noise) for name, one, other in rows]


def percent(probability: float) -> str:
    """Return a probability in words that never claim certainty."""
    return "over 99 %" if probability > 0.99 else "below 1 %" if probability < 0.01 else f"{100.0 * probability:.0f} %"
