"""What changed between two days, and was it the rig, or what was played, the device, its calibration?"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from identify.notebook.glance import Glance, Seen
from rig.causes import Cause, causes
from rig.differences import Difference, differences, first_apart
from rig.errors import UsageError
from rig.outputs import json_text
from rig.provenance import program, software
from rig.question import Source
from rig.recorded import Recording
from rig.recording import read
from rig.rigfile import model_to_dict, model_to_yaml
from rig.workflow import Progress, compare_traces, load

if TYPE_CHECKING:
    from identify.compared.comparison import Comparison
    from identify.page.document import Page


@dataclass(frozen=True, repr=False)
class Compared(Seen):
    """What changed, in what the files differ, and what of that may be the cause; ``causes`` is empty for no change."""

    sources: tuple[Source, Source]
    recordings: tuple[Recording, Recording]
    found: "Comparison"
    differ: tuple[Difference, ...]
    causes: tuple[Cause, ...]

    def glance(self) -> Glance:
        """Return the verdict, what changed, and what may be the cause."""
        told = self.found.glance()
        return replace(told, rows=(*told.rows, *((cause.aspect, cause.sentence) for cause in self.causes)))

    def to_dict(self) -> dict[str, object]:
        """Return the answer of ``rig compare --json``."""
        sides = [
            {
                "path": str(source.path), "sha256": source.sha256, "started": recording.origin.started,
                "complete": recording.complete,
            }
            for source, recording in zip(self.sources, self.recordings, strict=True)
        ]  # fmt: skip
        models = (self.found.before.model, self.found.after.model)
        return {
            **self.found.to_dict(), "runs": dict(zip(("before", "after"), sides, strict=True)),
            "differences": [difference.to_dict() for difference in self.differ],
            "causes": [cause.to_dict() for cause in self.causes],
            "models": dict(zip(("before", "after"), map(model_to_dict, models), strict=True)), "program": program(),
        }  # fmt: skip

    def to_json(self) -> str:
        """Return the answer as JSON text."""
        return json_text(self.to_dict())


def compare_runs(
    before: str | Path, after: str | Path, rig: str | Path | None = None, calibration: str | Path | None = None,
    progress: Progress | None = None, physics: bool = True,
) -> Compared:  # fmt: skip
    """Return what changed from one recording to another; raise FileError for one that cannot be used.

    ``rig`` is the plain model of both, where they do not carry it; without ``physics`` none beyond it is looked for.
    """
    sources = Source.of(Path(before)), Source.of(Path(after))
    recordings = read(before), read(after)
    if recordings[0].y.size == recordings[1].y.size and first_apart(recordings[0].y, recordings[1].y) is None:
        raise UsageError("the same readings twice", where=str(after), do="name the recordings of two runs")
    found = compare_traces(load((before, after), rig, (), calibration), progress, physics)
    differ = differences(*recordings)
    suspects = causes(found, differ, recordings) if found.verdict != "no change seen" else ()
    return Compared(sources, recordings, found, differ, suspects)


def comparison_page(done: Compared) -> "Page":
    """Return the page of ``rig compare``."""
    from identify.page.comparison_page import Beside
    from identify.page.comparison_page import comparison_page as page
    from identify.page.document import Imprint

    names = [source.path.name for source in done.sources]
    beside = Beside(
        names[0], names[1], [(c.aspect, c.state, c.sentence) for c in done.causes],
        [(d.aspect, d.what, d.before, d.after) for d in done.differ],
    )  # fmt: skip
    incomplete = [(name, recording.reason) for name, recording in zip(names, done.recordings, strict=True)
                  if not recording.complete]  # fmt: skip
    return page(done.found, beside, Imprint(model_to_yaml(done.found.after.model), software(), incomplete))
