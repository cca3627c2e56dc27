"""Does what wanders from repeat to repeat know where F stands, or when it makes contact?

Noise of the reading does not, nor does what comes in behind F. What wanders while w is held in the gap, and is next to
gone as soon as a border pushes w, has come in at F, or in front of it where it is so quick that G2 passes none of it
but what the gap has kept. So has what is there while one border pushes w and not while the other does, and what stays
as it is until a border takes w along or lets it go, and is another then.
Told from what repeats differ by, so that physics that comes back is in none of it.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identify.blocks import Play
from identify.chain import Chain, signals
from identify.explain.contact import age, held_in_gap, tap
from identify.explain.wander import DRIFT_S, MOSTLY, compared, unrepeated
from identify.observe import Observation
from identify.stage import Place
from identify.trace import Array, Mask

SETTLED_S = 0.02  # after which what has been before has passed G2
FEW = 20  # windows, below which chance may keep what hangs together out of them
TENTH = 0.1  # of the power elsewhere: a place that has less has none
NONE = 0.04  # the same of one border, beside the other: noise that wanders slowly has next to a tenth there by chance
LAGS = 16  # windows, by which two that are compared are apart at most
SURE = 5.0  # standard deviations of chance from which there is some


def knows_gap(chain: Chain, observations: Sequence[Observation]) -> bool:
    """Return whether what hangs together in the differences of repeats is only there where w is held in the gap.

    False where F has no gap, or where repeats are too few.
    """
    if chain.stage_of(Play) is None:
        return False
    places = [_pushed_and_held(held_in_gap(chain, o), o) for o in observations]
    return _is_next_to_gone(*_windows(chain, observations, places), TENTH)


def knows_border(chain: Chain, observations: Sequence[Observation]) -> bool:
    """Return whether what hangs together in the differences of repeats is there while one border pushes w alone.

    False where F has no gap, or where repeats are too few.
    """
    if chain.stage_of(Play) is None:
        return False
    up, down = _windows(chain, observations, [_pushed_up_and_down(chain, o) for o in observations])
    return _is_next_to_gone(up, down, NONE) or _is_next_to_gone(down, up, NONE)


def _is_next_to_gone(here: Array, there: Array, share: float) -> bool:
    """Return whether what hangs together in some windows, shape (2, windows), is beyond doubt, and next to none here.
    """
    if min(here.shape[1], there.shape[1]) < FEW:
        return False
    least, most = (float(np.mean(power - alone)) for power, alone in (here, there))
    return most > SURE * _chance(there) and max(least, 0.0) + _chance(here) < share * most


def knows_contact(chain: Chain, observations: Sequence[Observation]) -> bool:
    """Return whether what repeats differ by stays until contact is made or broken, and is another from there on.

    Windows as far apart in time are compared, with a contact between them and with none. False where F has no gap, or
    where repeats are too few.
    """
    if chain.stage_of(Play) is None:
        return False
    lags, met, squares, alone = np.concatenate([_changes(chain, o) for o in observations], axis=1)
    lags, at = lags.astype(np.intp), met.astype(np.bool_)
    counts = [np.bincount(lags[which], minlength=LAGS + 1) for which in (~at, at)]
    both = np.minimum(*counts)
    if both.sum() < FEW:
        return False
    sums = [np.bincount(lags[which], (squares - alone)[which], LAGS + 1) for which in (~at, at)]
    shares = [both / np.maximum(n, 1) / both.sum() for n in counts]
    stays, changes = (float(total @ share) for total, share in zip(sums, shares, strict=True))
    chance = float(np.mean(alone)) * np.sqrt(2.0 / both.sum())
    return bool(changes > SURE * chance and max(stays, 0.0) + chance < TENTH * changes)


def knows_f(chain: Chain, observations: Sequence[Observation]) -> bool:
    """Return whether what hangs together in the differences of repeats knows where F stands, or when it makes contact.
    """
    return any(knows(chain, observations) for knows in (knows_gap, knows_border, knows_contact))


def ruled_out(chain: Chain, observations: Sequence[Observation]) -> tuple[Place, ...]:
    """Return the places at which a misfit, most of which does not come back, has not come in: those behind F."""
    in_front = unrepeated(chain, observations) > MOSTLY and knows_f(chain, observations)
    return (Place.G2, Place.SENSE) if in_front else ()


def _windows(
    chain: Chain, observations: Sequence[Observation], places: Sequence[tuple[Mask, Mask]]
) -> tuple[Array, Array]:  # fmt: skip
    """Return the powers of windows of what repeats differ by, V^2, in either of two places of every recording.

    Either has the shape (2, windows): of their means, and what single readings alone would make of that.
    """
    found: tuple[list[Array], list[Array]] = [np.zeros((2, 0))], [np.zeros((2, 0))]
    for observation, both_places in zip(observations, places, strict=True):
        residual, size = observation.residual(chain), _size(observation)
        for once, again, both in compared(observation, residual):
            differs = (residual[once] - residual[again]) / np.sqrt(2.0)
            for which, where in zip(found, both_places, strict=True):
                means, alone = _means(differs, _begins(where[once] & where[again] & both, size), size)
                which.append(np.stack((np.square(means), alone)))
    return np.concatenate(found[0], axis=1), np.concatenate(found[1], axis=1)


def _changes(chain: Chain, observation: Observation) -> Array:
    """Return by how much windows of what repeats differ by change from one to another of the same stretch, (4, pairs).

    How many windows apart they are; whether contact is made or broken between them, in either repeat; half the square
    of the change of their means, V^2, and what single readings alone would make of that.
    """
    residual, size = observation.residual(chain), _size(observation)
    held = held_in_gap(chain, observation)
    places, contacts = _pushed_and_held(held, observation), np.cumsum(np.diff(held.astype(np.int8), prepend=0) != 0)
    found = [np.zeros((4, 0))]
    for once, again, both in compared(observation, residual):
        differs = (residual[once] - residual[again]) / np.sqrt(2.0)
        begins = np.sort(np.concatenate([_begins(where[once] & where[again] & both, size) for where in places]))
        means, alone = _means(differs, begins, size)
        i = np.repeat(np.arange(begins.size), LAGS)
        j = i + np.tile(np.arange(1, LAGS + 1), begins.size)
        i, j = i[j < begins.size], j[j < begins.size]
        lags = np.rint((begins[j] - begins[i]) / size)
        i, j, lags = (each[lags <= LAGS] for each in (i, j, lags))
        met = np.any([contacts[part][begins[i]] != contacts[part][begins[j]] for part in (once, again)], axis=0)
        found.append(np.stack((lags, met, 0.5 * np.square(means[j] - means[i]), 0.5 * (alone[i] + alone[j]))))
    return np.concatenate(found, axis=1)


def _size(observation: Observation) -> int:
    """Return how many readings a window has: two at least, which tell what single ones make of its mean."""
    return max(round(DRIFT_S * observation.trace.rate_hz), 2)


def _pushed_and_held(held: Mask, observation: Observation) -> tuple[Mask, Mask]:
    """Return where a border has pushed w for long enough, and where w has been held in the gap for as long."""
    settled = round(SETTLED_S * observation.trace.rate_hz)
    return np.asarray(age(~held) >= settled), np.asarray(age(held) >= settled)


def _pushed_up_and_down(chain: Chain, observation: Observation) -> tuple[Mask, Mask]:
    """Return where w has been pushed up for long enough, and where it has been pushed down for as long."""
    settled = round(SETTLED_S * observation.trace.rate_hz)
    moves = np.diff(tap(chain, signals(chain, observation.trace), "w"), prepend=0.0)
    return np.asarray(age(moves > 0.0) >= settled), np.asarray(age(moves < 0.0) >= settled)


def _means(values: Array, begins: NDArray[np.int64], size: int) -> tuple[Array, Array]:
    """Return the means of windows, and the variance that single readings alone would give each."""
    windows = values[begins[:, None] + np.arange(size)]
    return np.mean(windows, axis=1), np.var(windows, axis=1) / (size - 1)


def _begins(where: Mask, size: int) -> NDArray[np.int64]:
    """Return where windows begin that lie side by side in stretches of one place."""
    ends = np.flatnonzero(np.diff(where.astype(np.int8), prepend=0, append=0)).reshape(-1, 2)
    return np.concatenate([np.arange(a, b - size + 1, size) for a, b in ends] or [np.zeros(0)]).astype(np.int64)


def _chance(windows: Array) -> float:
    """Return by how much the mean power of windows of white noise scatters, V^2."""
    return float(np.sqrt(2.0 / windows.shape[1]) * np.mean(windows[1]))
