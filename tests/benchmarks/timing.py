"""How are two ways of doing one thing timed side by side?"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import median

Work = Callable[[], object]


@dataclass(frozen=True)
class Timed:
    """The durations of several rounds of one piece of work, s."""

    name: str
    seconds: tuple[float, ...]

    @property
    def least(self) -> float:
        return min(self.seconds)

    @property
    def median(self) -> float:
        return median(self.seconds)


def side_by_side(
    works: Sequence[tuple[str, Work]], rounds: int, clock: Callable[[], float] = time.perf_counter
) -> list[Timed]:
    """Run every piece of work once untimed, then all of them in turn, round after round.

    Taking turns lets what slows the machine down for a while slow all of them alike. Works of very different length
    are better timed by the processor's clock (``time.process_time``): only long ones are interrupted by other programs.
    """
    for _, work in works:
        work()
    seconds: list[list[float]] = [[] for _ in works]
    for _ in range(rounds):
        for taken, (_, work) in zip(seconds, works, strict=True):
            start = clock()
            work()
            taken.append(clock() - start)
    return [Timed(name, tuple(taken)) for (name, _), taken in zip(works, seconds, strict=True)]


def ratio_of_rounds(one: Timed, other: Timed) -> float:
    """Return the median over the rounds of ``one``'s duration over ``other``'s."""
    return median(a / b for a, b in zip(one.seconds, other.seconds, strict=True))
