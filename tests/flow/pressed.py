"""What does a command leave behind when Ctrl-C is pressed at some moment of it?

Every command line is a process of its own that gets a real SIGINT. They are forked from one that has loaded the
program: what takes seconds to load is loaded once, and the moments are those of the work. (Ctrl-C while the program
loads: ``tests/flow/test_answers.py``.)
"""

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from rig.verifying import verify
from tests.flow.console import PROTOCOL

AGAIN_S, TIMES = 1.0, 5
"""Ctrl-C is pressed again where a compiled library swallowed it, as an operator would."""
LATEST_S = 60.0
"""Ctrl-C is pressed after this long on a command that should say something first and does not."""
NEVER = 1e9
LONG = PROTOCOL.replace("periods: 3}", "periods: 300}").replace("periods: 6}", "periods: 600}")
LINES: dict[str, tuple[str, ...]] = {
    "check": ("check", "short.yaml", "--plot", "new/check.png", "--json", "new/check.json"),
    "run": ("run", "long.yaml", "--out", "new/run.h5", "--json", "new/run.json"),
    "design": ("design", "rigs/opamp_backlash.yaml", "--out", "new/design.yaml", "--time", "5s"),
    "identify": ("identify", "short.h5", "--json", "new/identify.json", "--report", "new/identify.html"),
    "explain": ("explain", "short.h5", "--json", "new/explain.json", "--report", "new/explain.html"),
    "simulate": ("simulate", "short.h5", "--out", "new/simulate.csv", "--json", "new/simulate.json"),
    "compare": ("compare", "short.h5", "other.h5", "--json", "new/compare.json", "--report", "new/compare.html"),
    "batch": ("batch", "*.h5", "--job", "identify", "--out", "new/answers", "--workers", "1"),
    "verify": ("verify", "short.h5", "other.h5", "--json", "new/verify.json"),
    "list": ("list", ".", "--json", "new/list.json"),
    "import": ("import", "table.csv", "--out", "new/import.h5"),
    "export": ("export", "short.h5", "--to", "csv", "--out", "new/export.csv"),
    "calibrate": ("calibrate", "loopback:cable.yaml", "--out", "new/calibrate.json"),
    "devices": ("devices", "--json", "new/devices.json"),
    "emulate": ("emulate", "serial"),
    "protocols": ("protocols", "--json", "new/protocols.json"),
    "new": ("new", "new/new.yaml", "--about", "held", "--yes"),
    "schema": ("schema", "rig", "--out", "new/rig.json"),
    "demo": ("demo", "--out", "new/demo"),
}
PLAYS = {0: "whole", 4: "stopped while it played", 130: "stopped before or after"}
ENDS = {
    "run": PLAYS, "calibrate": PLAYS, "demo": PLAYS,
    "emulate": {0: "stopped", 130: "stopped before it offered anything"},
}  # fmt: skip
"""What a command may end with, where that is not 0 or 130."""


@dataclass(frozen=True)
class Left:
    """How a command ended that was stopped, how long after it began, and how often it had to be told."""

    code: int
    out: str
    err: str
    seconds: float
    pressed: int


class Bench:
    """A program that has loaded all there is, and starts commands in a folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._process = subprocess.Popen(
            [sys.executable, "-m", __name__, str(folder)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        assert self._answer() == "ready"

    def stopped(self, command: str, after_s: float, offered: bool = False) -> Left:
        """Return how a command ended that was stopped after so long, and not before it said something where asked.

        What it wrote is then in ``new``.
        """
        for path in sorted((self.folder / "new").rglob("*"), reverse=True):
            path.rmdir() if path.is_dir() else path.unlink()
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps([LINES[command], after_s, offered]) + "\n")
        self._process.stdin.flush()
        told: Any = self._answer()
        return Left(**told)

    def close(self) -> None:
        """End the program."""
        self._process.communicate(timeout=10.0)

    def _answer(self) -> object:
        assert self._process.stdout is not None
        return json.loads(self._process.stdout.readline())


def prepare(folder: Path) -> None:
    """Put into a folder what the commands work on, but for its recordings."""
    from tests.rigs import CABLE

    (folder / "new").mkdir()
    (folder / "long.yaml").write_text(LONG)
    (folder / "short.yaml").write_text(PROTOCOL)
    (folder / "cable.yaml").write_text(CABLE)


def wrong(command: str, left: Left, folder: Path) -> list[str]:
    """Return what is not as it must be after Ctrl-C: the code, what was said, and every file whole or absent."""
    allowed = ENDS.get(command, {0: "whole", 130: "stopped"})
    found = [f"exit code {left.code}"] if left.code not in allowed else []
    found += ["a traceback"] if "Traceback" in left.err else []
    said = left.err.splitlines()[-1] if left.err else ""
    if left.code == 130 and said != "rig: stopped":
        found.append(f"not said that it was stopped: {said!r}")
    if left.code == 4 and not ("stopped by SIGINT" in said and said.startswith("rig: ")):
        found.append(f"not said that the run was stopped: {said!r}")
    files = [path for path in sorted((folder / "new").rglob("*")) if path.is_file()]
    found += [f"{path.name}: {trouble}" for path in files if (trouble := broken(path))]
    if command == "run" and left.code in (0, 4) and not (folder / "new" / "run.h5").exists():
        found.append("no recording")
    return found


def broken(path: Path) -> str:
    """Return what is wrong with a file that a stopped command left; empty where it is whole."""
    if path.name.startswith(".") or path.suffix == ".part":
        return "left behind"
    text = "" if path.suffix in (".h5", ".png") else path.read_text(encoding="utf-8")
    if path.suffix == ".h5":
        kept = verify(path)
        events = [event.kind for event in kept.recording.events] if kept.recording else []
        played = kept.recording is not None and "loopback" in kept.recording.origin.equipment.address
        return "damaged" if not kept.intact else "no word of a safe output" if played and "safe" not in events else ""
    if path.suffix == ".json":
        json.loads(text)
    whole = {".html": text.rstrip().endswith("</html>"), ".csv": text.endswith("\n"), ".yaml": text.endswith("\n"),
             ".png": path.suffix == ".png" and path.read_bytes().endswith(b"IEND\xaeB`\x82")}  # fmt: skip
    return "" if whole.get(path.suffix, True) else "not whole"


def serve(folder: str) -> None:
    """Start the commands that are asked for on stdin, each in a process of its own, until there are no more."""
    _load()
    os.chdir(folder)
    print(json.dumps("ready"), flush=True)
    for line in sys.stdin:
        print(json.dumps(asdict(_stopped(*json.loads(line)))), flush=True)


def _load() -> None:
    """Load what the commands load when they are wanted."""
    import drivers.loopback  # noqa: F401
    import rig.commands
    import rig.comparing
    import rig.demo
    import rig.exporters
    import rig.followup
    import rig.importers
    import rig.preview  # noqa: F401
    from rig.schemas import SCHEMAS

    for make in SCHEMAS.values():
        make()


def _stopped(arguments: list[str], after_s: float, offered: bool) -> Left:
    """Start a command, press Ctrl-C, and return how it ended."""
    out = Path("out.txt")
    out.unlink(missing_ok=True)
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # until the command has its own way with it
    began = time.monotonic()
    child = os.fork()
    if child == 0:
        _become(arguments)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    pressed, next_s, code = 0, after_s, None
    while code is None:
        now = time.monotonic() - began
        silent = offered and now < LATEST_S and not (out.exists() and out.stat().st_size)
        if now >= next_s and pressed < TIMES and not silent:
            os.kill(child, signal.SIGINT)
            pressed, next_s = pressed + 1, now + AGAIN_S
        done, status = os.waitpid(child, os.WNOHANG)
        code = os.waitstatus_to_exitcode(status) if done else None
        time.sleep(0.002)
    said, err = (path.read_text(encoding="utf-8") for path in (out, Path("err.txt")))
    return Left(code, said, err, time.monotonic() - began, pressed)


def _become(arguments: list[str]) -> None:
    """Be the command, from here to the end of the process."""
    from rig import cli

    def listening(words: list[str]) -> int:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        return run_line(words)

    run_line, cli.run_line = cli.run_line, listening
    for name, stream in (("out.txt", 1), ("err.txt", 2)):
        os.dup2(os.open(name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), stream)
    code = 70
    try:
        sys.argv = ["rig", *arguments]
        cli.main()
    except SystemExit as ended:
        code = int(ended.code or 0)
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


if __name__ == "__main__":
    serve(sys.argv[1])
