"""Which lags does a place have, and which of them is the one that is not drawn?

Lags in a row can be told in any order: a block with the lag in it that was left out, and beside it one of the block's
own, is the same data. The rig file decides: its block keeps the poles that lie nearest to those it is drawn with.
"""

import numpy as np

from identify.blocks import LinearBlock
from identify.chain import Chain
from identify.sections import product, sections
from identify.stage import Place
from identify.trace import Array

REAL = 1e-6  # of a pole: a smaller imaginary part is rounding


def time_constants(chain: Chain, place: Place) -> Array:
    """Return those of the plain block at a place, s, shape (order,), the slowest first; of a pair how fast it decays.
    """
    blocks = [s for s in chain.stages if isinstance(s, LinearBlock) and s.place is place]
    poles = [np.roots(block.fitted(chain.values).den) for block in blocks]
    rates = np.abs(np.real(np.concatenate([np.zeros(0), *poles])))
    return np.asarray(1.0 / np.sort(rates[rates > 0.0]))


def as_drawn(chain: Chain, place: Place, lag: str) -> Chain:
    """Return ``chain`` with the time constant ``lag``, in s, exchanged with a pole of the block at ``place``.

    The block is then as near as can be to its values in the rig file, in the sum of squares of logs. The chain itself
    is returned where it is that already, where there is no such block, or where one of its values is held.
    """
    block = next((s for s in chain.stages if isinstance(s, LinearBlock) and s.place is place), None)
    order = len(block.start.den) - 1 if block is not None else 0
    if block is None or order == 0 or chain.values[lag] <= 0.0:
        return chain
    names, drawn = [p.name for p in block.coefficients()[:order]], np.log(block.start_values()[:order])
    now = np.array([chain.values[name] for name in names])
    if np.any(now == block.start_values()[:order]):  # no fit leaves a value where it was
        return chain
    least, best = float(np.sum(np.square(np.log(now) - drawn))), chain
    poles = np.roots(product(block.parts(chain.of(block, ""))))
    for i in np.flatnonzero(np.abs(poles.imag) < REAL * np.abs(poles)).tolist():
        others = np.append(np.delete(poles, i), -1.0 / chain.values[lag])
        den = np.array([value for part in sections(np.poly(others).real.tolist()) for value in part])
        away = float(np.sum(np.square(np.log(den) - drawn)))
        if away < least:
            values = dict(zip(names, den.tolist(), strict=True))
            least, best = away, chain.with_values({**values, lag: float(-1.0 / poles[i].real)})
    return best
