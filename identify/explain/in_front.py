"""At which frequencies may a line in front of the gap go on, of which the reading shows little but where w was left?

w keeps the level at which contact ended: all readings until the next contact tell of v at that one instant. What the
residual asks of v is therefore the residual, back through G2, summed up where contact was (the transpose of what a
small change of v does to the answer). There a line stands out that what is read hides.

A line that is quick against the stimulus shakes the borders apart, at whatever frequency it goes, and that is most of
what it does: those few instants tell of any quick line alike. It shows by its own frequency while w moves.
"""

from collections.abc import Sequence

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft, rfftfreq

from identify.blocks import LinearBlock
from identify.chain import Chain, signals
from identify.explain.anew import asked_together, periodogram, standing_out
from identify.explain.wander import whitened
from identify.harmonic.steady import frequency_response
from identify.observe import Observation
from identify.stage import Place
from identify.trace import Array, Mask

MOVES = 1e-9  # of the range of w: a smaller step is rounding
AS_HIGH = 0.8  # of how much the highest stands out, in logs, from which what is stronger may be the line
APART = 2.0  # what the longest run resolves: frequencies closer than that are one


def lines_in_front(chain: Chain, observations: Sequence[Observation], count: int) -> tuple[float, ...]:
    """Return the frequencies of the ``count`` likeliest lines of v, Hz, the likeliest first, all runs asked together.

    And one more, at which what is left changes most while F moves. None where F never moves. What hangs on the stimulus
    makes lines, too, but in every run others. Where F turns as often, so do images of a line, and stand out more where
    less is around them: half of the frequencies are those that are strongest among what stands out nearly as much as
    any.
    """
    moving = [(o, *there) for o in observations if (there := _while_moving(chain, o))[1].any()]
    if not moving:
        return ()
    powers = [_power(_pulled(chain, o, left, moves)) for o, left, moves in moving]
    turns, told = asked_together([standing_out(power) for power in powers])
    _, strong = asked_together(powers)
    _, changing = asked_together([standing_out(_power(_changes(left, moves))) for _, left, moves in moving])
    rate_hz = observations[0].trace.rate_hz
    apart = max(round(APART * 2.0 * turns.size / max(left.size for _, left, _ in moving)), 1)
    height = np.sum(np.log1p(told), axis=0)
    chosen = _highest(height, count - count // 2, apart, [])
    chosen = _highest(np.where(height > AS_HIGH * np.max(height), np.sum(strong, axis=0), 0.0), count, apart, chosen)
    chosen = _highest(np.sum(np.log1p(changing), axis=0), len(chosen) + 1, apart, chosen)
    return tuple(float(turns[at]) * rate_hz for at in chosen)


def _power(signal: Array) -> Array:
    """Return the periodogram of a whole signal, shape (frequencies,)."""
    return periodogram(signal, np.ones(signal.size, dtype=bool))


def _changes(left: Array, moves: Mask) -> Array:
    """Return by how much a residual changes from reading to reading while w moves, 0 elsewhere, shape (N,)."""
    return np.where(moves, np.diff(left, prepend=left[:1]), 0.0)


def _highest(values: Array, count: int, apart: int, chosen: Sequence[int]) -> list[int]:
    """Return where values are highest, the highest first, after those that are chosen: so many, that far apart."""
    found = list(chosen)
    for at in np.argsort(-values):
        if len(found) == count or values[at] <= 0.0:
            break
        if all(abs(int(at) - other) > apart for other in found):
            found.append(int(at))
    return found


def asked_of_v(chain: Chain, observation: Observation) -> Array:
    """Return how much less a change of v by one unit at every instant would leave, up to a factor, shape (N,).

    Borders count alike, whatever their slopes. Zeros where w never moves.
    """
    return _pulled(chain, observation, *_while_moving(chain, observation))


def _while_moving(chain: Chain, observation: Observation) -> tuple[Array, Mask]:
    """Return the residual in units of white noise, and when w moves, shape (N,) each."""
    left = whitened(observation, observation.masked_residual(chain))
    w = signals(chain, observation.trace)[chain.index(Place.F) - 1]
    return left, np.abs(np.diff(w, prepend=w[0])) > MOVES * max(float(np.ptp(w)), 1e-300)


def _pulled(chain: Chain, observation: Observation, left: Array, moves: Mask) -> Array:
    """Return a residual back through G2, summed up where w moved last, shape (N,)."""
    latest = np.maximum.accumulate(np.where(moves, np.arange(moves.size), -1))
    there = latest >= 0
    back = _back_through_g2(chain, left, observation.trace.rate_hz)
    return np.asarray(np.bincount(latest[there], back[there], minlength=moves.size), dtype=np.float64)


def _back_through_g2(chain: Chain, left: Array, rate_hz: float) -> Array:
    """Return a residual through G2 backwards in time, shape (N,)."""
    blocks = [s for s in chain.stages if isinstance(s, LinearBlock) and s.place is Place.G2]
    size = next_fast_len(2 * left.size, real=True)
    spectrum = rfft(left, size)
    for block in blocks:
        spectrum *= np.conj(frequency_response(block.fitted(chain.values), rfftfreq(size, 1.0 / rate_hz)))
    return np.asarray(irfft(spectrum, size)[: left.size])
