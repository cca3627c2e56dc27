"""Does any late reply slip into another's place, and does any mixture of faults end in a wrong sample or a live output?

    python -m tests.benchmarks.random_faults slip              # every reply of every driver late once, twice over
    python -m tests.benchmarks.random_faults slip u2300a
    python -m tests.benchmarks.random_faults drawn serial 60 7 # 60 scripts of up to three faults, seed 7

Any end will do but these: a wrong sample, an output left on without a word, a run that does not end, a crash.
"""

import sys
from dataclasses import replace

import numpy as np

from drivers.emulators.faults import Fault, Faults, What
from tests.benchmarks.fault_matrix import show, tried
from tests.wire.matrix.benches import BENCHES
from tests.wire.matrix.case import Case, script
from tests.wire.matrix.play import Bench, play

LATE_S = {"serial": 2.0, "u2300a": 1.5, "redpitaya": 1.5}
"""Beyond all patience for one reply: three times 0.5 s, or 1 s."""
OF_MESSAGES = {
    "serial": (What.LOST, What.LATE, What.TWICE, What.SPLIT, What.SHORT, What.FLIPPED, What.PRECEDED),
    "u2300a": (What.LOST, What.LATE, What.TWICE, What.SPLIT, What.SHORT, What.PRECEDED),
    "redpitaya": (What.LOST, What.LATE, What.TWICE, What.SPLIT, What.SHORT, What.PRECEDED),
}
"""A serial line flips bits and loses what the host says; TCP and USB do neither."""
OF_DEVICES = (What.MUTE, What.HUNG, What.TORN, What.UNPLUGGED, What.RESTARTED)


def words(bench: Bench) -> list[str]:
    """Return the first words of all that the device says in a run without faults."""
    plain = Case("nothing goes wrong", script(Fault(What.LOST, times=0)), None, output=None)
    return sorted({name.partition(" ")[0] for name in play(bench, plain).said})


def slips(bench: Bench) -> list[Case]:
    """Return a case for every word: its first reply, or its fourth, comes when nobody waits for it any more."""
    late = Fault(What.LATE, seconds=LATE_S[bench.kind])
    return [Case(f"{word} late, number {skip + 1}", script(replace(late, to=word, skip=skip)), None, output=None)
            for word in words(bench) for skip in (0, 3)]


def drawn(bench: Bench, count: int, seed: int) -> list[Case]:
    """Return ``count`` cases of one to three faults drawn by ``seed``."""
    said = words(bench)
    cases = []
    for number in range(count):
        random = np.random.default_rng((seed, number))
        faults = tuple(_fault(bench.kind, said, random) for _ in range(random.integers(1, 4)))
        cases.append(Case(f"{number}: {', '.join(map(_told, faults))}"[:52], Faults(faults), None, output=None))
    return cases


def _fault(kind: str, said: list[str], random: np.random.Generator) -> Fault:
    """Return one fault: of the device one time in four, else of some messages."""
    if random.random() < 0.25:
        what = OF_DEVICES[random.integers(len(OF_DEVICES))]
        return Fault(what, at_sample=int(random.integers(9000)), seconds=float(random.choice([0.1, 0.5, 1.5])))
    what = OF_MESSAGES[kind][random.integers(len(OF_MESSAGES[kind]))]
    times = float(random.choice([1, 1, 3, 1000]))
    seconds = 1e-3 if what is What.SPLIT else float(random.choice([0.05, 0.6, 1.5, 2.5]))
    return Fault(what, to=said[random.integers(len(said))], heard=bool(kind == "serial" and random.random() < 0.3),
                 skip=int(random.choice([0, 0, 0, 1, 4])), times=1 if what is What.LATE else times, seconds=seconds,
                 size=int(random.integers(1, 200)), new=b"\x00?\n\xa5\x5a\n")


def _told(fault: Fault) -> str:
    """Return a fault in few words."""
    return f"{fault.what.name} {fault.to or fault.at_sample}"


def main(study: str, kind: str = "", count: str = "30", seed: str = "1") -> int:
    """Print the tables of a study; return how many cases went wrong."""
    bad = 0
    for bench in [BENCHES[name] for name in ([kind] if kind else LATE_S)]:
        cases = slips(bench) if study == "slip" else drawn(bench, int(count), int(seed))
        bad += show(bench.kind, tried(bench, cases))
    return bad


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
