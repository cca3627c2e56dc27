"""How does the main job look from end to end, with no hardware: what ``rig demo`` plays and writes."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import protocols
from rig import session, workflow
from rig.errors import FileError
from rig.outputs import write_text

if TYPE_CHECKING:
    from identify.explain.explanation import Explanation

PROTOCOL, HELD_OUT = "demo.yaml", "demo_hold_out.yaml"


@dataclass(frozen=True)
class Shown:
    """What the demo found, and where it put what."""

    told: "Explanation"
    report: Path
    files: tuple[Path, ...]


def play(folder: str | Path, progress: workflow.Progress) -> Shown:
    """Record two protocols on the loopback device, explain one, prove it on the other, put all into ``folder``."""
    folder = _made(folder)
    trained, held_out = (_recorded(name, folder, progress) for name in (PROTOCOL, HELD_OUT))
    asked = workflow.asked("explain", [trained], hold_out=[held_out])
    runs = workflow.load_asked(asked)
    told = workflow.explain_runs(runs, workflow.part(progress, 0.05, 0.8))
    again = workflow.asked_of_improved(asked, told)
    found = workflow.identify_if_told(workflow.load_asked(again), workflow.part(progress, 0.8, 0.95))
    progress("writing the report", 0.95)
    report = workflow.explanation_page(told, found, runs).html()
    texts = {"explain.json": workflow.answer_json(told, asked.told()), "report.html": report}
    if found is not None:
        page = workflow.identification_page(found, runs)
        texts |= {"identify.json": workflow.answer_json(found, again.told()), "identify.html": page.html()}
    for name, text in texts.items():
        write_text(folder / name, text)
    return Shown(told, folder / "report.html", (trained, held_out, *(folder / name for name in texts)))


def _made(folder: str | Path) -> Path:
    """Return the folder, made where it is not there; raise FileError."""
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError("no folder can be made there", where=str(folder), value=error.strerror) from error
    return folder


def _recorded(protocol: str, folder: Path, progress: workflow.Progress) -> Path:
    """Return the recording of a protocol that comes with the program, played on the loopback device."""
    progress(f"recording {protocol}", 0.02)
    out = folder / f"{Path(protocol).stem}.h5"
    done = session.record(Path(protocols.__path__[0]) / protocol, None, out, lambda done, total: None, overwrite=True)
    if done.outcome.failure is not None:
        raise done.outcome.failure
    return out

