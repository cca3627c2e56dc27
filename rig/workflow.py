"""How do recordings become an answer: the one module that sees both the files of the bench and the identification."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from identify.trace import Trace
from rig.calibration import Calibration, parse_calibration, read_calibration
from rig.doubt import doubt_of
from rig.errors import FileError, MisfitError, UsageError
from rig.of_device import with_device
from rig.outputs import json_text
from rig.provenance import software
from rig.question import Job, Named, Question
from rig.recorded import Recording
from rig.recording import read
from rig.rigfile import RigFile, model_to_dict, model_to_yaml, parse_rig, read_rig
from rig.session import shipped
from rig.simulated import Simulated

if TYPE_CHECKING:
    from identify.bent.curves import Form
    from identify.compared.comparison import Comparison
    from identify.explain.contenders import Contender
    from identify.explain.explanation import Explanation
    from identify.identification import Identification
    from identify.model import Model
    from identify.page.document import Imprint, Page

Progress = Callable[[str, float], None]
"""Told what is being done, and which share of the whole is over."""
Placed = tuple[str, Recording]
"""A recording, and where it is."""


@dataclass(frozen=True)
class Runs:
    """Recordings as identification sees them, under distinct names, and the plain model to start from.

    ``protocols`` are the texts of what was played, where the recordings know them; ``incomplete`` are the runs of which
    a part is missing, or still to come, and why.
    """

    traces: tuple[Trace, ...]
    held_out: tuple[Trace, ...]
    model: "Model"
    rig: RigFile | None = None
    protocols: tuple[str, ...] = ()
    incomplete: tuple[tuple[str, str], ...] = ()

    def beside(self) -> dict[str, object]:
        """Return what the JSON of an answer says of the runs it is from."""
        told = [{"run": name, "reason": reason} for name, reason in self.incomplete]
        return {"incomplete": told} if told else {}


def load(
    paths: Sequence[str | Path], rig: str | Path | None = None, hold_out: Sequence[str | Path] = (),
    calibration: str | Path | None = None,
) -> Runs:  # fmt: skip
    """Read recordings and their rig; those under ``hold_out`` are taken out of ``paths`` where they stand there too.

    ``calibration`` is of the device, where the recordings do not keep one. Raises FileError for a file that cannot be
    used, UsageError when nothing is left to fit.
    """
    kept, held = kept_and_held(paths, hold_out)
    named = None if rig is None else read_rig(shipped(rig))
    return _loaded(kept, held, named, None if calibration is None else read_calibration(calibration))


def asked(
    job: Job, paths: Sequence[str | Path], rig: str | Path | None = None, hold_out: Sequence[str | Path] = (),
    calibration: str | Path | None = None, borders: "Form | None" = None, knots: int | None = None,
) -> Question:  # fmt: skip
    """Return the question that is asked of recordings as they are now; raise FileError, UsageError."""
    beside = Named.of(None if rig is None else shipped(rig)), Named.of(calibration)
    return Question(job, (), (), *beside, borders, knots).of(*kept_and_held(paths, hold_out))


def load_asked(question: Question) -> Runs:
    """Return what a question is about; raise FileError for a file that cannot be used."""
    kept, held = ([source.path for source in sources] for sources in (question.recordings, question.held_out))
    rig, calibration = question.rig, question.calibration
    return _loaded(kept, held, parse_rig(rig.text, rig.name) if rig else None,
                   parse_calibration(calibration.text, calibration.name) if calibration else None)  # fmt: skip


def kept_and_held(paths: Sequence[str | Path], hold_out: Sequence[str | Path]) -> tuple[list[Path], list[Path]]:
    """Return the runs to fit and those held out, each once; raise UsageError when none is left to fit."""
    held = _distinct(hold_out)
    kept = [path for path in _distinct(paths) if path.resolve() not in {other.resolve() for other in held}]
    if not kept:
        raise UsageError("no run is left to fit", value=f"{len(held)} held out", do="hold out fewer of the runs")
    return kept, held


def _loaded(
    kept: Sequence[Path], held: Sequence[Path], rig: RigFile | None, given: Calibration | None
) -> Runs:
    """Return the runs at these paths with the rig and the calibration that were named, else with their own."""
    recordings = [(str(path), read(path)) for path in (*kept, *held)]
    return assembled(recordings[: len(kept)], recordings[len(kept) :], rig, given)


def assembled(
    kept: Sequence[Placed], held: Sequence[Placed], rig: RigFile | None, given: Calibration | None = None
) -> Runs:
    """Return recordings as identification sees them, with the rig and the calibration given, else with their own."""
    recordings = [recording for _, recording in (*kept, *held)]
    found = rig or _rig((*kept, *held))
    traces = _named_apart([with_device(recording, given) for recording in recordings])
    protocols = tuple(recording.protocol_text for recording in recordings)
    incomplete = tuple((trace.name, recording.reason)
                       for trace, recording in zip(traces, recordings, strict=True) if not recording.complete)
    return Runs(tuple(traces[: len(kept)]), tuple(traces[len(kept) :]), found.model, found, protocols, incomplete)


def identify_runs(
    runs: Runs, progress: Progress | None = None, borders: "Form | None" = None, knots: int | None = None
) -> "Identification":
    """Return which rig made the recordings; raise FileError when they cannot tell.

    ``borders`` says of which form those of the backlash are to be, curved ones with ``knots`` points; None: as told.
    """
    from identify.joint import identify

    with _unusable(runs):
        return identify(runs.model, (*runs.traces, *runs.held_out), progress, borders, knots)


def explain_runs(runs: Runs, progress: Progress | None = None) -> "Explanation":
    """Return why simulation and recordings differ; raise FileError when the recordings cannot tell."""
    from identify.explain import explain

    with _unusable(runs):
        return explain(runs.model, runs.traces, runs.held_out, progress)


def compare_traces(runs: Runs, progress: Progress | None = None, physics: bool = True) -> "Comparison":
    """Return what changed from the first run to the others; raise FileError when the recordings cannot tell."""
    from identify.compared import compare

    with _unusable(runs):
        return compare(runs.model, runs.traces[:1], runs.traces[1:], progress, physics)


def revised(told: "Explanation", sets: "Sequence[Sequence[Contender]]") -> "Explanation":
    """Return the explanation with the members of sets that were undecided on less data weighed again."""
    from identify.explain.revised import revised as weighed_again

    return weighed_again(told, sets)


def identify_improved(runs: Runs, told: "Explanation", progress: Progress | None = None) -> "Identification | None":
    """Return the identification that starts from the improved model; None when these recordings allow none."""
    return identify_if_told(replace(runs, model=told.model), progress)


def identify_if_told(runs: Runs, progress: Progress | None = None) -> "Identification | None":
    """Return which rig made the recordings; None when they cannot tell."""
    with suppress(FileError):
        return identify_runs(runs, progress)
    return None


def asked_of_improved(question: Question, told: "Explanation") -> Question:
    """Return the question of identifying, from the model that answers ``question``, what it was asked of."""
    return replace(question, job="identify", rig=Named("the improved model", model_to_yaml(told.model)))


def part(progress: Progress, low: float, high: float) -> Progress:
    """Return a progress that fills the stretch [low, high] of another."""
    return lambda sentence, share: progress(sentence, low + (high - low) * share)


def identification_page(found: "Identification", runs: Runs) -> "Page":
    """Return the page of ``rig identify``."""
    from identify.page.report import identification_page as page

    return page(found, _imprint(found.model, runs))


def explanation_page(told: "Explanation", found: "Identification | None", runs: Runs) -> "Page":
    """Return the page of ``rig explain``, with the staircase where the improved model was identified."""
    from identify.page.report import explanation_page as page

    return page(told, found, _imprint(told.model, runs))


def simulate(path: str | Path, rig: str | Path | None = None) -> Simulated:
    """Return a model's answer, from rest, to the input of a recording; raise FileError."""
    from identify.chain import simulate as answer
    from identify.effects import chain_of
    from identify.simulate import SUBSTEPS
    from identify.uncertainty.band import half_band
    from identify.uncertainty.coefficients import coefficients

    runs = load([path], rig)
    trace = runs.traces[0]
    doubt = doubt_of(runs.rig, tuple(coefficients(runs.model))) if runs.rig else None
    with _unusable(runs):
        half = half_band(runs.model, doubt, trace, SUBSTEPS) if doubt else None
        simulated = answer(chain_of(runs.model, trace.intersample), trace, SUBSTEPS)
        if not np.isfinite(simulated).all():
            raise ValueError("the answer of this model leaves all numbers there are: check its gains and its den")
        return Simulated(trace, runs.model, simulated, half)


def answer_json(found: "Identification | Explanation", beside: Mapping[str, object] = MappingProxyType({})) -> str:
    """Return an answer as the JSON of the charter, the model in the form of a rig file; ``beside`` are further keys."""
    return json_text({**found.to_dict(), **beside, "model": model_to_dict(found.model)})


def _imprint(model: "Model", runs: Runs) -> "Imprint":
    """Return what stands on every page beside the answer."""
    from identify.page.document import Imprint

    return Imprint(model_to_yaml(model), software(), runs.incomplete)


def _distinct(paths: Sequence[str | Path]) -> list[Path]:
    """Return the paths without those that name a file twice."""
    return list({Path(path).resolve(): Path(path) for path in paths}.values())


def _rig(recordings: Sequence[Placed]) -> RigFile:
    """Return the rig that the recordings themselves carry, however its file is worded; raise FileError."""
    carried = {recording.rig_text: path for path, recording in recordings if recording.rig_text.strip()}
    if not carried:
        raise FileError("no rig is known for these recordings", where=", ".join(path for path, _ in recordings),
                        do="name the plain model with --rig RIG.yaml")
    rigs = [parse_rig(text, f"{path} (the rig in it)") for text, path in carried.items()]
    if not all(rig.is_as(rigs[0]) for rig in rigs):
        raise FileError("the recordings carry different rigs", where=", ".join(carried.values()),
                        do="name the one that is meant with --rig RIG.yaml")
    return rigs[0]


def _named_apart(traces: Sequence[Trace]) -> list[Trace]:
    """Return the traces with ``-2``, ``-3`` ... behind a name that came before."""
    taken = {trace.name for trace in traces}
    seen: Counter[str] = Counter()
    apart = []
    for trace in traces:
        seen[trace.name] += 1
        name, number = trace.name, seen[trace.name]
        while number > 1 and name in taken:
            name, number = f"{trace.name}-{number}", number + 1
        taken.add(name)
        apart.append(replace(trace, name=name))
    return apart


@contextmanager
def _unusable(runs: Runs) -> Iterator[None]:
    """Turn the sentence with which identification refuses data into an error about the files."""
    try:
        yield
    except MisfitError:
        raise
    except ValueError as error:
        names = ", ".join(trace.name for trace in (*runs.traces, *runs.held_out))
        raise FileError(str(error), where=names) from error
