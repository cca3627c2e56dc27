"""How does a run end under every fault of every link? Prints the fault matrix.

    python -m tests.benchmarks.fault_matrix                 # all drivers
    python -m tests.benchmarks.fault_matrix serial          # one of them
    python -m tests.benchmarks.fault_matrix serial torn     # the faults whose name has this word
"""

import sys
from concurrent.futures import ThreadPoolExecutor

from tests.wire.matrix.benches import BENCHES
from tests.wire.matrix.case import Case, Verdict
from tests.wire.matrix.play import Bench, play

AT_ONCE = 4
"""Cases played side by side: they mostly wait."""


def matrix(bench: Bench, word: str = "") -> list[tuple[Case, Verdict]]:
    """Return every case of ``bench`` whose name has ``word``, with what became of it."""
    cases = [case for case in bench.cases if word in case.name]
    with ThreadPoolExecutor(AT_ONCE) as pool:
        return list(zip(cases, pool.map(lambda case: play(bench, case), cases), strict=True))


def told(case: Case, verdict: Verdict) -> str:
    """Return a row of the table."""
    samples = f"{verdict.kept} of {verdict.total}" if verdict.total else "-"
    cells = (f"{case.name:44}", f"{verdict.ended.end.value:9}", f"{samples:>14}", f"{verdict.output.value:9}",
             f"{verdict.seconds:5.1f} s", f"{verdict.struck:4}", "; ".join(verdict.wrong) or "ok")
    return " | ".join(cells)


def main(kind: str = "", word: str = "") -> int:
    """Print the matrix; return how many cases went wrong."""
    bad = 0
    for bench in [BENCHES[kind]] if kind else BENCHES.values():
        rows = matrix(bench, word)
        print(f"\n{bench.kind}: {len(rows)} faults")
        print("fault | run | samples kept | output | took | struck | verdict")
        for case, verdict in rows:
            print(told(case, verdict))
            if verdict.wrong or word:
                print(f"    {verdict.ended.reason}", *verdict.ended.events, sep="\n    ")
            bad += bool(verdict.wrong)
        print(f"{len(rows) - sum(bool(v.wrong) for _, v in rows)} of {len(rows)} as they must be; longest "
              f"{max(v.seconds for _, v in rows):.1f} s")
    return bad


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
