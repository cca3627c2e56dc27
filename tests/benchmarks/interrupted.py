"""Ctrl-C at random moments of every command: what do they end with, and what do they leave behind?

``python -m tests.benchmarks.interrupted 20`` presses each command 20 times, at moments drawn from as long as it takes.
"""

import random
import sys
import tempfile
from collections import Counter
from pathlib import Path

from tests.flow.console import protocol, rig
from tests.flow.pressed import LINES, NEVER, Bench, prepare, wrong

ENDLESS_S = 3.0


def main(times: int, seed: int = 1) -> None:
    """Print a line a command: how often it ended with which code, how long after, and what was wrong."""
    draw = random.Random(seed)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        prepare(folder)
        protocol(folder, ("scale: 0.6", "scale: 0.7"), name="other.yaml")
        for run in ("short", "other"):
            rig("run", f"{run}.yaml", cwd=folder)
        rig("export", "short.h5", "--to", "csv", "--out", "table.csv", cwd=folder)
        bench = Bench(folder)
        print(f"{'command':<10} {'takes':>7} {'pressed':>8} {'ended with':<24} {'at most after':>14}  wrong")
        for command in LINES:
            _line(bench, command, times, draw)
        bench.close()


def _line(bench: Bench, command: str, times: int, draw: random.Random) -> None:
    """Print the line of one command."""
    takes_s = ENDLESS_S if command == "emulate" else bench.stopped(command, NEVER).seconds
    codes, bad, most_s = Counter[int](), Counter[str](), 0.0
    for _ in range(times):
        after_s = draw.uniform(0.01, takes_s)
        left = bench.stopped(command, after_s)
        codes[left.code] += 1
        bad.update(wrong(command, left, bench.folder))
        most_s = max(most_s, left.seconds - after_s)
    ends = ", ".join(f"{count} x {code}" for code, count in sorted(codes.items()))
    told = dict(bad) or "nothing"
    print(f"{command:<10} {takes_s:>6.1f}s {times:>8} {ends:<24} {most_s:>13.2f}s  {told}", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
