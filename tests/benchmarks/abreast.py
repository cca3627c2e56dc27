"""How long do slopes take of a chain with physics in it, its moved values abreast and one after the other?

``python -m tests.benchmarks.abreast [samples] [rounds]``
"""

import sys
from dataclasses import dataclass

import numpy as np

from identify.chain import Chain, simulate
from identify.derivatives.sensitivities import DIFFERENCE, sensitivities
from identify.effects import chain_of
from identify.model import Model, Physics
from identify.observe import Observation
from identify.trace import Array, Trace
from tests.benchmarks.plain_chain import GAP, ORDERS, RATE_HZ, block, stimulus
from tests.benchmarks.timing import Timed, ratio_of_rounds, side_by_side

LAW = Physics("saturation", {"upper": 20.0}, form="upper")


@dataclass(frozen=True)
class Result:
    """Blocks of one order: all values abreast, and a simulation for each."""

    order: int
    values: int
    abreast: Timed
    simulated: Timed


def seen(samples: int) -> Observation:
    """Return a run of which every sample counts."""
    u = stimulus(samples)
    return Observation(Trace("run", RATE_HZ, u, np.zeros(samples)), np.ones(samples, dtype=np.bool_), 1.0)


def chain_with(order: int) -> Chain:
    """Return a chain with blocks of one order and a law that no fused loop knows."""
    return chain_of(Model("benchmark", block(order), GAP, block(order), physics=(LAW,)))


def steps(chain: Chain) -> dict[str, float]:
    """Return a step of every value by its name: as large as it is."""
    return {p.name: abs(chain.values[p.name]) for p in chain.parameters()}


def abreast(chain: Chain, observation: Observation) -> Array:
    """Return how the answer changes with every value, (p, n)."""
    return sensitivities(chain, steps(chain), observation).slopes()


def simulated(chain: Chain, observation: Observation) -> Array:
    """Return the same by a simulation for each."""
    trace, base = observation.trace, simulate(chain, observation.trace)
    moved = (chain.with_values({n: chain.values[n] + DIFFERENCE * step}) for n, step in steps(chain).items())
    return np.array([(simulate(other, trace) - base) / DIFFERENCE for other in moved])


def measured(order: int, samples: int, rounds: int) -> Result:
    """Time one order."""
    chain, observation = chain_with(order), seen(samples)
    timed = side_by_side(
        [("abreast", lambda: abreast(chain, observation)), ("simulated", lambda: simulated(chain, observation))], rounds
    )
    return Result(order, len(steps(chain)), *timed)


def table(results: list[Result], samples: int) -> str:
    """Return ns a sample and value, and ratios, one row an order."""
    head = "order  values  abreast  simulated  simulated/abreast"
    lines = [f"{samples} samples; ns a sample and value, the median", head]
    for r in results:
        each = 1e9 / (samples * r.values)
        times = f"{each * r.abreast.median:7.2f}  {each * r.simulated.median:9.2f}"
        lines.append(f"{r.order:>5}  {r.values:>6}  {times}  {ratio_of_rounds(r.simulated, r.abreast):17.2f}")
    return "\n".join(lines)


def main(arguments: list[str]) -> None:
    """Measure and print."""
    samples = int(float(arguments[0])) if arguments else 20_000
    rounds = int(arguments[1]) if len(arguments) > 1 else 21
    print(table([measured(order, samples, rounds) for order in ORDERS], samples))


if __name__ == "__main__":
    main(sys.argv[1:])
