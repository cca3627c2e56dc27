"""How fast does the plain chain G1 -> play -> G2 run beside two linear filters of the same orders?

``python -m tests.benchmarks.plain_chain [samples] [rounds]``
"""

import sys
from dataclasses import dataclass

import numpy as np
from scipy.signal import cont2discrete, lfilter

from identify.chain import CHUNK, Chain, plain_chain, running
from identify.model import Backlash, LinearF, Model, Rational
from identify.stage import Block, Grid
from identify.trace import Array
from tests.benchmarks.timing import Timed, ratio_of_rounds, side_by_side

RATE_HZ = 1e6
TAUS_S = (4e-4, 9e-5, 3e-5)
ORDERS = (1, 2, 3)
GAP = Backlash(8.0, 1.25, 8.0, -1.25)
WITHOUT_GAP = Backlash(8.0, 0.0, 8.0, 0.0)


@dataclass(frozen=True)
class Result:
    """One order: the chain in one compiled loop, its stages one by one, and two passes of lfilter."""

    order: int
    samples: int
    fused: Timed
    staged: Timed
    filters: Timed


def block(order: int) -> Rational:
    """Return a low-pass of real poles with DC gain one."""
    den = np.ones(1)
    for tau in TAUS_S[:order]:
        den = np.convolve(den, (tau, 1.0))
    return Rational((1.0,), tuple(den.tolist()))


def chain_with(order: int, f: Backlash | LinearF) -> Chain:
    """Return the plain chain with G1 and G2 of one order."""
    return plain_chain(Model("benchmark", block(order), f, block(order)))


def stimulus(samples: int) -> Array:
    """Return levels that come and go, V: the play operator loads, holds and unloads."""
    t = np.arange(samples) / RATE_HZ
    return 3.0 * np.sin(2.0 * np.pi * 97.0 * t) + 2.0 * np.sin(2.0 * np.pi * 411.0 * t)


def run_fused(chain: Chain, u: Array) -> Array:
    """Return the answer of the whole chain to the source voltage u, one value an instant."""
    return running(chain, Grid("benchmark", 1.0 / RATE_HZ))(Block(u, u, 0, Grid("benchmark", 1.0 / RATE_HZ)))


def run_staged(chain: Chain, u: Array) -> Array:
    """Return the same answer by one stage after the other, each on a whole chunk."""
    grid, out = Grid("benchmark", 1.0 / RATE_HZ), np.empty_like(u)
    stages = chain.begin(grid)
    for first in range(0, u.size, CHUNK):
        signal = u[first : first + CHUNK]
        for stage in stages:
            signal = stage(Block(signal, u[first : first + CHUNK], first, grid))
        out[first : first + CHUNK] = signal
    return out


def coefficients(order: int, method: str) -> tuple[Array, Array]:
    """Return (b, a) of the discrete filter that ``method`` makes of the block; b is told from the level before."""
    num, den, _ = cont2discrete((block(order).num, block(order).den), 1.0 / RATE_HZ, method)
    return np.atleast_1d(np.squeeze(num)), den


def run_filters(order: int, u: Array) -> Array:
    """Return u through the zero-order-hold G1, a gain of 8 and the first-order-hold G2: two passes of lfilter.

    The zero-order hold answers one instant late; the source voltage of the chain is already the one before, so the
    filter's own delay is taken back.
    """
    (b1, a1), (b2, a2) = coefficients(order, "zoh"), coefficients(order, "foh")
    v = lfilter(np.append(b1[1:], 0.0), a1, u)
    return np.asarray(lfilter(8.0 * b2, a2, v))


def measured(order: int, samples: int, rounds: int) -> Result:
    """Time one order."""
    chain, u = chain_with(order, GAP), stimulus(samples)
    (b1, a1), (b2, a2) = coefficients(order, "zoh"), coefficients(order, "foh")
    timed = side_by_side(
        [
            ("one loop", lambda: run_fused(chain, u)),
            ("stage by stage", lambda: run_staged(chain, u)),
            ("two lfilter", lambda: lfilter(b2, a2, lfilter(b1, a1, u))),
        ],
        rounds,
    )
    return Result(order, samples, *timed)


def table(results: list[Result]) -> str:
    """Return nanoseconds a sample and ratios, one row an order."""
    lines = [
        f"{results[0].samples} samples, {len(results[0].fused.seconds)} rounds in turn; ns a sample as least / median",
        f"{'order':>5}  {'one loop':>15}  {'stage by stage':>15}  {'two lfilter':>15}  {'loop/lfilter':>12}",
    ]
    for r in results:
        nanoseconds = 1e9 / r.samples
        timed = (r.fused, r.staged, r.filters)
        cells = [f"{nanoseconds * t.least:6.2f} / {nanoseconds * t.median:6.2f}" for t in timed]
        lines.append(f"{r.order:>5}  " + "  ".join(cells) + f"  {ratio_of_rounds(r.fused, r.filters):12.2f}")
    return "\n".join(lines)


def main(arguments: list[str]) -> None:
    """Measure and print."""
    samples = int(float(arguments[0])) if arguments else 2_000_000
    rounds = int(arguments[1]) if len(arguments) > 1 else 9
    print(table([measured(order, samples, rounds) for order in ORDERS]))


if __name__ == "__main__":
    main(sys.argv[1:])
