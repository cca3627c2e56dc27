"""Is every damaged or hostile file refused in one message, in time, in little memory, and with nothing followed out?

``python -m tests.benchmarks.mutated 1000 1`` plays so many cases, the last word being the seed: first every file made
to harm (`tests/mutations`), then damage at random to protocols, rig files, answers, calibrations, recordings with and
without a seal, and tables of every kind. One in twenty is typed in a process of its own as well.
"""

import sys
from collections import Counter, defaultdict
from itertools import chain, islice
from random import Random

from tests.mutations.case import DONE, NEGATIVE, REFUSED, Judged
from tests.mutations.every import damaged, hostile
from tests.mutations.originals import originals
from tests.mutations.player import in_a_process, played

ALONE = 20
"""One case in so many is typed in a process of its own as well."""
ENDINGS = {REFUSED: "refused", NEGATIVE: "answered no", DONE: "still good"}


def study(count: int, seed: int) -> list[Judged]:
    """Play so many cases; tell every fault when it is found."""
    made = originals()
    cases = list(islice(chain(hostile(made), damaged(made, Random(seed))), count))
    judged = []
    for number, one in enumerate(played(cases)):
        judged.append(one)
        if number % ALONE == 0:
            judged.append(in_a_process(one.case))
        for found in judged[-2:]:
            if found.faults:
                print(f"{found.case.name}: {', '.join(found.faults)}: {found.ending.err[:200]!r}", flush=True)
    return judged


def table(judged: list[Judged]) -> str:
    """Return how many cases of every kind ended how."""
    by_kind: dict[str, Counter[str]] = defaultdict(Counter)
    for one in judged:
        kind = one.case.name.partition(":")[0]
        ending = "at fault" if one.faults else ENDINGS.get(one.ending.code or 0, "other")
        by_kind[kind][ending] += 1
    columns = ("refused", "answered no", "still good", "at fault")
    lines = [f"| | {' | '.join(columns)} |", "|---" * (len(columns) + 1) + "|"]
    lines += [f"| {kind} | {' | '.join(str(counts[each]) for each in columns)} |" for kind, counts in by_kind.items()]
    total = Counter(ending for counts in by_kind.values() for ending in counts.elements())
    lines.append(f"| all {len(judged)} | {' | '.join(str(total[each]) for each in columns)} |")
    longest, largest = (max(getattr(one.ending, name) for one in judged) for name in ("seconds", "peak_bytes"))
    return "\n".join([*lines, "", f"longest {longest:.1f} s, most memory {largest / 1e6:.0f} MB"])


if __name__ == "__main__":
    everything = study(int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 1)
    print(table(everything))
    sys.exit(any(one.faults for one in everything))
