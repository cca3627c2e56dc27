"""How long does the command line take to say what it can do, beside an interpreter that does nothing?

``python -m tests.benchmarks.start_up [rounds]``
"""

import subprocess
import sys
from pathlib import Path

from tests.benchmarks.timing import Timed, ratio_of_rounds, side_by_side

RIG = str(Path(sys.executable).with_name("rig"))
COMMANDS = {
    "python -c pass": [sys.executable, "-c", "pass"],
    "rig --help": [RIG, "--help"],
    "rig devices": [RIG, "devices"],
    "import numpy": [sys.executable, "-c", "import numpy"],
    "import identify.explain": [sys.executable, "-c", "import identify.explain"],
}


def measured(commands: dict[str, list[str]], rounds: int) -> list[Timed]:
    """Time every command in a process of its own."""

    def started(command: list[str]) -> object:
        return subprocess.run(command, capture_output=True, check=True)

    return side_by_side([(name, lambda c=command: started(c)) for name, command in commands.items()], rounds)


def table(results: list[Timed]) -> str:
    """Return milliseconds and the ratio to the first command."""
    first = results[0]
    lines = [f"{len(first.seconds)} rounds in turn; ms", f"{'command':<25} {'least':>8} {'median':>8} {'ratio':>7}"]
    return "\n".join([*lines, *(row(r, first) for r in results)])


def row(timed: Timed, first: Timed) -> str:
    """Return one line of the table."""
    return f"{timed.name:<25} {1e3 * timed.least:8.1f} {1e3 * timed.median:8.1f} {ratio_of_rounds(timed, first):7.2f}"


def main(arguments: list[str]) -> None:
    """Measure and print."""
    print(table(measured(COMMANDS, int(arguments[0]) if arguments else 9)))


if __name__ == "__main__":
    main(sys.argv[1:])
