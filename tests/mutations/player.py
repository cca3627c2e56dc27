"""How is a command typed a thousand times, each in a folder of its own, and watched for time, memory and death?

One process plays command after command through the program's own front door, so that what is slow to load is loaded
once; this module, run as a program, is that process. Where a command kills it or goes on too long, the next gets a new
one. ``in_a_process`` types a single command as an operator does.
"""

import json
import os
import select
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from tests.mutations.case import LIMIT_BYTES, SECRET, Case, Ending, Judged, judge

ROOT = Path(__file__).parents[2]
ADDRESS_SPACE = 12 * LIMIT_BYTES
"""What a process may ask for at all, to save the machine; what it may have resident is judged."""
GIVEN_UP_S = 300.0
"""By the clock, on a machine that does other things; the limit is of the processor's time."""
OUTSIDE = "outside"


class Player:
    """The process that plays."""

    def __init__(self) -> None:
        """Start none yet."""
        self._process: subprocess.Popen[str] | None = None

    def play(self, case: Case, folder: Path) -> Ending:
        """Return how a command ended, typed in ``folder``, where its files are."""
        process = self._started()
        assert process.stdin is not None
        process.stdin.write(json.dumps({"folder": str(folder), "line": case.line}) + "\n")
        process.stdin.flush()
        begun = time.monotonic()
        told = _line(process.stdout, GIVEN_UP_S)
        if told:
            return Ending(**json.loads(told))
        died = process.wait(5.0) if _over(process) else None
        self.close()
        return Ending(None, "", "", time.monotonic() - begun, 0, (), None if died is None else -died)

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            for pipe in (self._process.stdin, self._process.stdout):
                if pipe is not None:
                    pipe.close()
        self._process = None

    def _started(self) -> subprocess.Popen[str]:
        if self._process is None:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "tests.mutations.player"], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                text=True, cwd=ROOT, env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
            )  # fmt: skip
        return self._process


def _line(pipe: IO[str] | None, within_s: float) -> str:
    """Return the next line, empty when none comes in time."""
    assert pipe is not None
    ready, _, _ = select.select([pipe], [], [], within_s)
    return pipe.readline() if ready else ""


def _over(process: subprocess.Popen[str]) -> bool:
    """Return whether a process that says nothing has died."""
    try:
        process.wait(0.5)
    except subprocess.TimeoutExpired:
        return False
    return True


def played(cases: Iterable[Case]) -> Iterator[Judged]:
    """Play cases one after the other and judge them."""
    player = Player()
    try:
        for case in cases:
            with laid_out(case) as folder:
                ending = player.play(case, folder)
            yield judge(case, ending)
    finally:
        player.close()


@contextmanager
def laid_out(case: Case) -> Iterator[Path]:
    """Give the folder of a case; in the one above stands a secret."""
    with tempfile.TemporaryDirectory(prefix="mutated-") as above:
        folder = Path(above) / "here"
        folder.mkdir()
        (Path(above) / OUTSIDE).write_text(SECRET)
        write_all(folder, case.files)
        yield folder


def write_all(folder: Path, files: Mapping[str, bytes]) -> None:
    """Put files into a folder."""
    for name, held in files.items():
        (folder / name).write_bytes(held)


def in_a_process(case: Case) -> Judged:
    """Play a case as an operator does; what memory it takes is not measured, a child's begins with its parent's."""
    import resource

    with laid_out(case) as folder:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run([sys.executable, "-m", "rig.cli", *case.line], cwd=folder, capture_output=True, text=True,
                              check=False, timeout=GIVEN_UP_S, errors="replace")  # fmt: skip
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        left = tuple(sorted(set(os.listdir(folder)) - set(case.files)))
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    died = -done.returncode if done.returncode < 0 else None
    return judge(case, Ending(done.returncode, done.stdout, done.stderr, seconds, 0, left, died))


def main() -> None:
    """Play what is asked on stdin, line by line, and tell how each ended on the stdout there was."""
    import resource

    resource.setrlimit(resource.RLIMIT_AS, (ADDRESS_SPACE, ADDRESS_SPACE))
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    answers = os.fdopen(os.dup(1), "w")
    for asked in sys.stdin:
        told = json.loads(asked)
        answers.write(json.dumps(_ended(Path(told["folder"]), told["line"])) + "\n")
        answers.flush()


def _ended(folder: Path, line: list[str]) -> dict[str, object]:
    """Return how a command ended, typed in ``folder``."""
    there = set(os.listdir(folder))
    os.chdir(folder)
    Path("/proc/self/clear_refs").write_text("5")
    with tempfile.TemporaryFile("w+", errors="replace") as out, tempfile.TemporaryFile("w+", errors="replace") as err:
        begun = sum(os.times()[:4])
        code = _typed(line, out, err)
        seconds = sum(os.times()[:4]) - begun
        texts = [_text(file) for file in (out, err)]
    left = sorted(set(os.listdir(folder)) - there)
    return {"code": code, "out": texts[0], "err": texts[1], "seconds": seconds, "peak_bytes": _peak_bytes(),
            "left": left}


def _typed(line: list[str], out: IO[str], err: IO[str]) -> int:
    """Return the exit code of a command whose output, that of C libraries too, goes into two files."""
    from rig.cli import run_line

    os.dup2(out.fileno(), 1)
    os.dup2(err.fileno(), 2)
    try:
        return run_line(line)
    except SystemExit as left:
        return int(left.code or 0)
    finally:
        sys.stdout.flush()
        sys.stderr.flush()


def _text(file: IO[str]) -> str:
    file.seek(0)
    return file.read(100_000)


def _peak_bytes() -> int:
    """Return the most memory resident since it was asked to be forgotten."""
    told = Path("/proc/self/status").read_text()
    return 1024 * int(next(line for line in told.splitlines() if line.startswith("VmHWM")).split()[1])


if __name__ == "__main__":
    main()
