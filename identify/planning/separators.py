"""Which stimuli may tell two pieces of physics apart, within the limits of the input?

More than what identifies a rig: what leaves the gap stuck shows what bypasses F, what drives w onto a rail shows the
rail, long holds show what leaks and creeps, nested loops show memory, two step sizes and two amplitudes show what
grows with the level (physics.md 2, separators).
"""

from collections.abc import Iterator

import numpy as np

from identify.holdout import settling_s
from identify.model import Model
from identify.planning.advice import mains_hit
from identify.planning.candidates import Candidate, Chord, Offer, Room, Stairs, Tone, rounded

SPANS, RUNGS = (1.0, 0.6, 0.3), (1, 2, 5)
DWELLS = (0.15, 0.5, 1.2, 5.0)  # of the time in which a slow rig settles
LOOPS = ((1.0, -1.0, 0.8, -0.6, 0.4, -0.2), (1.0, 0.4, 0.8, 0.5, -1.0, -0.4, -0.8, -0.5), (1.0, 0.7, -1.0, -0.7))
SIZES = (1.0, 0.6, 0.35, 0.2, 0.1)  # of the largest amplitude
FREQUENCIES = 9
POINTS = 5  # samples a period, at least: what is nearly a delay shows far above the corners
TRIANGLES = 3  # frequencies, the lowest, at which triangles are offered too
BIASED, BIAS = 0.4, 0.55  # amplitude and offset of sines to one side, of the largest level
MOST_OF_TIME = 0.5  # that one stimulus may take


def separators(model: Model, room: Room) -> tuple[Candidate, ...]:
    """Return all stimuli that may be played on a rig in a room."""
    offer = Offer(model, room)
    found: list[Candidate] = [*_walks(offer), *_tones(offer), *_chords(offer)]
    short = [c for c in found if c.time_s <= MOST_OF_TIME * room.time_s]
    return tuple(c for c in short if offer.fits(c))


def kind_of(candidate: Candidate) -> str:
    """Return what sort of stimulus it is, so that none is overlooked beside the others."""
    if isinstance(candidate, Stairs):
        return f"walk of {candidate.dwell_s:.3g} s"
    if isinstance(candidate, Chord):
        return "multisine"
    return "triangle" if candidate.triangle else "biased sine" if candidate.offset_v else "sine"


def _middle(room: Room) -> tuple[float, float]:
    """Return the middle of the range of u and the largest amplitude about it.

    0 V where that is well inside, or where jumps are too steep to go elsewhere.
    """
    if np.isfinite(room.slew_v_per_s) or room.limit_v >= 0.25 * (room.high_v - room.low_v):
        return 0.0, rounded(room.limit_v)
    return rounded(0.5 * (room.low_v + room.high_v)), rounded(0.5 * (room.high_v - room.low_v))


def _dwells_s(offer: Offer) -> list[float]:
    settled_s = max(settling_s(offer.model), 8.0 / offer.room.rate_hz)
    return [max(round(share * settled_s * offer.room.rate_hz), 4) / offer.room.rate_hz for share in DWELLS]


def _walks(offer: Offer) -> Iterator[Stairs]:
    centre, top = _middle(offer.room)
    shapes = [[k / rungs for k in (*range(-rungs, rungs + 1), *range(rungs - 1, -rungs, -1))] for rungs in RUNGS]
    for dwell_s in _dwells_s(offer):
        for span in SPANS:
            for shape in (*shapes, *LOOPS):
                yield Stairs(tuple(rounded(centre + span * top * k, 6) for k in shape), dwell_s, readable=False)


def _tones(offer: Offer) -> Iterator[Tone]:
    centre, top = _middle(offer.room)
    frequencies = _frequencies(offer)
    for frequency in frequencies:
        periods = round(frequency * offer.block_s)
        for size in SIZES:
            yield Tone(frequency, rounded(size * top), centre, periods)
            if frequency in frequencies[:TRIANGLES]:
                yield Tone(frequency, rounded(size * top), centre, periods, triangle=True)
        for bias in (BIAS, -BIAS):
            yield Tone(frequency, rounded(BIASED * top), rounded(centre + bias * top), periods)


def _frequencies(offer: Offer) -> tuple[float, ...]:
    """Return frequencies of which whole periods fit a block, clear of the mains, in nearly equal ratios."""
    most = offer.room.rate_hz / POINTS * offer.block_s
    orders = np.unique(np.rint(np.geomspace(1.0, max(most, 1.0), 4 * FREQUENCIES)).astype(int))
    clear = [n / offer.block_s for n in orders.tolist() if mains_hit(n / offer.block_s, 1.0) is None]
    picks = np.unique(np.rint(np.linspace(0, len(clear) - 1, min(FREQUENCIES, len(clear)))).astype(int))
    return tuple(clear[k] for k in picks.tolist())


def _chords(offer: Offer) -> Iterator[Chord]:
    frequencies = _frequencies(offer)
    for chosen in (frequencies[::2], frequencies[: len(frequencies) // 2 + 1]):
        if len(chosen) > 1:
            for share in (1.0, 0.5):
                yield Chord(chosen, rounded(share * offer.room.limit_v), offer.block_s)
