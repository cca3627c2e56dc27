"""What does a command say in JSON where its result is a file or a sentence, and no answer of its own?

Identifications, explanations, comparisons and verdicts have their own form (``to_dict`` of each); these are the others.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from identify.observe import rms
from rig.recorded import Entry

if TYPE_CHECKING:
    from pathlib import Path

    from rig.batch import Batch, State
    from rig.calibrating import Calibrated
    from rig.demo import Shown
    from rig.design import Designed
    from rig.recorded import Recording
    from rig.registry import Attached
    from rig.session import Recorded, Segment
    from rig.simulated import Simulated

Summary = dict[str, object]


def run(done: "Recorded") -> Summary:
    """Return how a run ended and where it is."""
    return {
        "schema": "rig.run/1", "complete": done.outcome.complete, "reason": done.outcome.reason,
        "recordings": [_segment(segment) for segment in done.segments],
    }  # fmt: skip


def _segment(segment: "Segment") -> Summary:
    outcome = segment.outcome
    events = [{"kind": e.kind, "text": e.text, "start": e.start, "stop": e.stop} for e in outcome.events]
    return {
        "recording": str(segment.path), "complete": outcome.complete, "reason": outcome.reason,
        "samples": outcome.samples, "samples_asked": int(segment.recording.u.size), "events": events,
    }  # fmt: skip


def recording(schema: str, path: object, kept: "Recording") -> Summary:
    """Return what was imported or exported."""
    understood = kept.origin.equipment.settings.get("understood", "")
    return {
        "schema": schema, "file": str(path), "samples": int(kept.u.size), "rate_hz": kept.rate_hz,
        "initial": kept.initial, "intersample": kept.intersample, "complete": kept.complete, "reason": kept.reason,
        "lost": kept.count(Entry.LOST), "understood": [remark for remark in understood.split("; ") if remark],
    }  # fmt: skip


def simulate(played: "Simulated") -> Summary:
    """Return how far a model's answer lies from the recording."""
    good = slice(None) if played.trace.valid is None else played.trace.valid
    y, half = played.trace.y[:], played.half_band
    return {
        "schema": "rig.simulate/1", "recording": played.trace.name, "model": played.model.title,
        "samples": int(played.trace.size), "residual_rms_V": rms((y - played.answer)[good]),
        "y_rms_V": rms((y - y.mean())[good]),
        "band95_V": None if half is None else {"rms": rms(half), "largest": float(half.max())},
    }  # fmt: skip


def devices(found: "Sequence[Attached]") -> Summary:
    """Return what is attached, by identity."""
    told = [
        {"address": one.address, "identity": one.identity and str(one.identity), "problem": one.problem or None}
        for one in found
    ]  # fmt: skip
    return {"schema": "rig.devices/1", "devices": told}


def calibrate(done: "Calibrated") -> Summary:
    """Return the calibration, and where it is kept."""
    return {**done.calibration.to_dict(), "file": str(done.path)}


def design(done: "Designed") -> Summary:
    """Return what was designed, how sure it makes the answer, and how that compares with the paper's protocol."""
    rows = {
        row.designed.quantity.name: {
            "expected": row.designed.to_dict(), "fig13": row.paper.to_dict(), "wider_if_30_percent_off": row.worst,
        }
        for row in done.rows
    }  # fmt: skip
    return {
        "schema": "rig.design/1", "protocol": str(done.path), "duration_s": done.plan.duration_s,
        "rate_hz": done.plan.rate_hz, "noise_V": done.told.noise_v, "quantities": rows, "fig13": done.paper,
        "steps": list(dict.fromkeys(step.label for step in done.plan.steps)), "steps_that_move_if_off": done.moving,
    }  # fmt: skip


def batch(of: "Batch", state: "State", table: "Path") -> Summary:
    """Return how a batch ended."""
    return {
        "schema": "rig.batch/1", "job": of.question.job, "recordings": state.total, "answered": state.answered,
        "unchanged": state.unchanged, "reasons": dict(state.reasons), "seconds": state.seconds,
        "failures": [{"recording": str(path), "message": message} for path, message in state.failures],
        "answers": str(of.folder), "table": str(table),
    }  # fmt: skip


def demo(shown: "Shown") -> Summary:
    """Return what the demo found, and where it put what."""
    return {
        "schema": "rig.demo/1", "verdict": shown.told.verdict, "sentence": shown.told.sentence,
        "report": str(shown.report), "files": [str(path) for path in shown.files],
    }  # fmt: skip
