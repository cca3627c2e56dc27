"""Does the live page hold ten pictures a second at any length of run, in constant memory, and cost the run no sample?

    python -m tests.benchmarks.live_page compressed --minutes 60     4 x 50 kS/s, as fast as the loopback plays them
    python -m tests.benchmarks.live_page real --seconds 60           4 x 50 kS/s in real time, an emulated serial DAQ

Either plays `rig run --live` with a headless Chromium that looks on, and prints a row for every tenth of the looks, one
a second: pictures that the browser was shown in a second (median, and the fewest in any), and the memory of the page's
process, of the browser's script, and of the run.
"""

import argparse
import json
import subprocess
import tempfile
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from selenium.webdriver import Chrome

from rig.recording import Entry, read
from tests.browser import DESK, at_size, chromium
from tests.flow.console import start
from tests.rigs import QUIET
from tests.wire.emulated import emulated

RATE_HZ, INPUTS = 50_000, ("y", "u_measured", "v", "w")
PROTOCOL = """\
spec: 1
title: how long can one look
question: Does the page keep up?
rig: rig.yaml
limits: {{level: 5 V}}
acquisition: {{rate: {rate} Hz, inputs: [{inputs}]}}
steps:
  - {{repeats: {repeats}, label: slow, sine: {{frequency: 5 Hz, amplitude: 4 V, periods: 25}}}}
  - staircase: {{levels: [{{from: -3 V, to: 3 V, step: 1 V}}, {{from: 2 V, to: -3 V, step: 1 V}}], dwell: 100 ms}}
"""
STEP_S, STAIRS_S = 5.0, 1.2
LOOK_S = 1.0
JS = "return [window.rigTicks ? window.rigTicks.length && window.rigTicks.at(-1) : 0, " \
     "(window.rigTicks || []).filter((t) => t > performance.now() - 1000).length, performance.memory.usedJSHeapSize]"


@dataclass(frozen=True)
class Look:
    """What one look, once a second, found: share of the run, pictures in the last second, memory in MB."""

    share: float
    behind: str
    pictures: int
    page_mb: float
    browser_mb: float
    run_mb: float


def resident_mb(process: int) -> float:
    """Return the memory of a process; 0 once it has ended."""
    try:
        status = Path(f"/proc/{process}/status").read_text()
    except OSError:
        return 0.0
    found = [line.split()[1] for line in status.splitlines() if line.startswith("RssAnon")]
    return float(found[0]) / 1024.0 if found else 0.0


def page_of(run: int) -> int:
    """Return the process that serves the page of a run."""
    children = Path(f"/proc/{run}/task/{run}/children").read_text().split()
    return next(int(each) for each in children if b"rig.live.process" in Path(f"/proc/{each}/cmdline").read_bytes())


def told(url: str) -> dict[str, object]:
    """Return what the page says."""
    with urllib.request.urlopen(url + "state", timeout=60) as reply:
        return dict(json.loads(reply.read()))


def looks(run: subprocess.Popen[str], shown: Chrome, url: str, page: int) -> Iterator[Look]:
    """Yield what is seen of a run, once a second, until page and run are at its end."""
    while True:
        time.sleep(LOOK_S)
        says, (_, pictures, heap) = told(url), shown.execute_script(JS)
        lamps = says.get("lamps")
        behind = str(lamps["page"]["words"]) if isinstance(lamps, dict) else ""
        yield Look(float(str(says.get("share", 0.0))), behind, int(pictures), resident_mb(page), heap / 1e6,
                   resident_mb(run.pid))
        if not says.get("going_on", True) and "up to date" in behind:
            return


@contextmanager
def folder_of(seconds: float) -> Iterator[Path]:
    """Give a folder with a protocol of about so many seconds."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "rig.yaml").write_text(QUIET + "noise: 10 mV\n")
        repeats = max(round((seconds - STAIRS_S) / STEP_S), 1)
        text = PROTOCOL.format(rate=RATE_HZ, inputs=", ".join(INPUTS), repeats=repeats)
        (folder / "long.yaml").write_text(text)
        yield folder


def watch(folder: Path, *device: str) -> list[Look]:
    """Play the protocol with a page that is looked at; return what was seen, and print how it ended."""
    with chromium() as shown, start("run", "long.yaml", "--live", *device, cwd=folder) as run:
        assert run.stderr is not None
        url = run.stderr.readline().split()[-1]
        at_size(shown, DESK)
        shown.get(url)
        began, page = time.monotonic(), page_of(run.pid)
        seen = list(looks(run, shown, url, page))
        took_s = time.monotonic() - began
        out, err = run.communicate()
        shown.get("about:blank")
    print(f"{out.strip()}{err.strip()}; looked at for {took_s:.0f} s")
    return seen


def table(seen: list[Look]) -> None:
    """Print a row for every tenth of what was seen."""
    print("| share of the run | pictures a second, median (fewest) | page, MB | browser's script, MB | run, MB |")
    print("|---|---|---|---|---|")
    tenth = max(len(seen) // 10, 1)
    for first in range(0, len(seen), tenth):
        rows = seen[first : first + tenth]
        pictures = [row.pictures for row in rows]
        last = rows[-1]
        print(f"| {100 * last.share:.0f} % | {median(pictures):.0f} ({min(pictures)}) | {last.page_mb:.0f} | "
              f"{last.browser_mb:.0f} | {last.run_mb:.0f} |")


def lost(folder: Path) -> str:
    """Return how many samples the recording has, and how many it lacks."""
    recording = read(folder / "long.h5")
    return f"{recording.count(Entry.RECORDED)} of {recording.u.size} samples recorded, {recording.reason}"


def compressed(minutes: float) -> None:
    """Play on the loopback device, whose clock never waits."""
    with folder_of(60.0 * minutes) as folder:
        table(watch(folder))
        print(lost(folder))


def real(seconds: float) -> None:
    """Play in real time, with and without a page."""
    from tests.benchmarks.streaming import hardware

    for live in (True, False):
        with folder_of(seconds) as folder, emulated(QUIET, **hardware()) as board:
            if live:
                table(watch(folder, "--device", board.address))
            else:
                with start("run", "long.yaml", "--device", board.address, cwd=folder) as run:
                    run.communicate()
            print(f"{'with' if live else 'without'} a page: {lost(folder)}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["compressed", "real"])
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--seconds", type=float, default=60.0)
    asked = parser.parse_args()
    if asked.what == "compressed":
        compressed(asked.minutes)
    else:
        real(asked.seconds)


if __name__ == "__main__":
    main()
