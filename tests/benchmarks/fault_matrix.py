"""How does a run end under every fault of every link? Prints the fault matrix.

    python -m tests.benchmarks.fault_matrix                 # all drivers
    python -m tests.benchmarks.fault_matrix serial          # one of them
    python -m tests.benchmarks.fault_matrix serial torn     # the faults whose name has this word
"""

import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

from tests.wire.matrix.benches import BENCHES
from tests.wire.matrix.case import Case, Verdict
from tests.wire.matrix.play import Bench, play


def matrix(bench: Bench, word: str = "") -> list[tuple[Case, Verdict]]:
    """Return every case of ``bench`` whose name has ``word``, with what became of it."""
    return tried(bench, [case for case in bench.cases if word in case.name])


def tried(bench: Bench, cases: Sequence[Case]) -> list[tuple[Case, Verdict]]:
    """Return what became of ``cases``, a few at a time."""
    with ThreadPoolExecutor(bench.at_once) as pool:
        return list(zip(cases, pool.map(lambda case: play(bench, case), cases), strict=True))


def told(case: Case, verdict: Verdict) -> str:
    """Return a row of the table."""
    samples = f"{verdict.kept} of {verdict.total}" if verdict.total else "-"
    cells = (f"{case.name:52}", f"{verdict.ended.end.value:9}", f"{samples:>14}", f"{verdict.output.value:9}",
             f"{verdict.seconds:5.1f} s", f"{verdict.struck:4}", "; ".join(verdict.wrong) or "ok")
    return " | ".join(cells)


def show(kind: str, rows: Sequence[tuple[Case, Verdict]], reasons: bool = False) -> int:
    """Print a table; return how many cases went wrong. With ``reasons`` every end is told in words, not those alone."""
    print(f"\n{kind}: {len(rows)} faults")
    print("fault | run | samples kept | output | took | struck | verdict")
    for case, verdict in rows:
        print(told(case, verdict))
        if verdict.wrong or reasons:
            print(f"    {verdict.ended.reason}", *verdict.ended.events, sep="\n    ")
    bad = sum(bool(verdict.wrong) for _, verdict in rows)
    print(f"{len(rows) - bad} of {len(rows)} as they must be; longest {max(v.seconds for _, v in rows):.1f} s")
    return bad


def main(kind: str = "", word: str = "") -> int:
    """Print the matrix; return how many cases went wrong."""
    benches = [BENCHES[kind]] if kind else list(BENCHES.values())
    return sum(show(bench.kind, matrix(bench, word), bool(word)) for bench in benches)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
