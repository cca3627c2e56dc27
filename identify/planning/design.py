"""Which protocol tells most about a rig in a given time, within the limits of its input?

Every stimulus on offer is played, in simulation, on the rig as its file has it and on rigs 30 % off in every value, so
that a wrong value does not leave the gap stuck; its Fisher information is that of one repetition once settled. The
times are then chosen for the smallest mean log relative standard error of borders, gains and phases.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.chain import Chain, plain_chain, signals
from identify.coordinate import Coordinate, coordinates_of
from identify.effects import chain_of
from identify.holdout import settling_s
from identify.model import Backlash, LinearF, Model, Rational
from identify.observe import Observation
from identify.planning.allocation import Choice, thinned, whole
from identify.planning.candidates import Candidate, Chord, Offer, Room, Stairs, Tone, gain_at, gap_of, offered, rounded
from identify.planning.information import by_step, prior_of
from identify.planning.quantities import Quantity, corners_hz, quantities
from identify.stage import Place
from identify.trace import Array, Step, Trace

OFF = 0.3
SIGNS = ((1, -1, 1, 1), (-1, 1, -1, -1), (1, 1, -1, 1), (-1, -1, 1, -1))
"""Of the gap, the slopes, the time constants of G1 and of G2: corners of the tolerances; the first is hard to move."""
RUN = "planned"
MOST_OF_TIME = 0.5  # that one repetition of a stimulus may take
NOTICED = 0.03  # of the time: the least for sines that must be there
APART = 1.1  # least ratio of two amplitudes that tell |G1| from |G2|

Note = Callable[[str, float], None]


@dataclass(frozen=True)
class Design:
    """Stimuli and how often each is repeated, in the order they are to be played."""

    steps: tuple[tuple[Candidate, int], ...]
    time_s: float


def designed(model: Model, room: Room, noise_v: float, note: Note = lambda sentence, share: None) -> Design:
    """Return the protocol for a rig. Raises ValueError with one sentence for a rig or a room it cannot design for."""
    offer = offered(model, room)
    candidates = _usable(offer)
    choice = weighed(model, offer, candidates, noise_v, note)
    note("choosing", 0.85)
    chosen, counts = _chosen(choice, candidates, room.time_s)
    steps = tuple((candidates[k], n) for k, n in zip(chosen, counts, strict=True) if n)
    return Design(tuple(sorted(steps, key=_order)), sum(c.time_s * n for c, n in steps))


def _usable(offer: Offer) -> tuple[Candidate, ...]:
    """Return what fits the time and keeps w and y in range; ValueError where no protocol can be made of it."""
    room, on_offer = offer.room, offer.candidates()
    walks = [c for c in on_offer if isinstance(c, Stairs) and c.readable]
    short = tuple(c for c in on_offer if c.time_s <= MOST_OF_TIME * room.time_s)
    found = tuple(c for c in short if _stays_off(offer, c))
    if np.isfinite(room.slew_v_per_s):
        if found:
            return found
        raise ValueError(
            f"nothing that moves F stays below {room.slew_v_per_s:g} V/s in {room.time_s:g} s; allow a steeper slope"
        )
    if not walks:
        raise ValueError(f"no walk within {offer.span_v:.3g} V meets either border on two levels; widen the limit")
    least_s = min(c.time_s for c in walks)
    if least_s > MOST_OF_TIME * room.time_s:
        raise ValueError(
            f"{room.time_s:g} s is too short: the shortest walk of which every level settles takes {least_s:.3g} s, "
            f"which is to be no more than half of the time; allow {rounded(least_s / MOST_OF_TIME, up=True):g} s"
        )
    if not any(isinstance(c, Stairs) and c.readable for c in found):
        raise ValueError(
            "every walk rings so far that w meets a rail or y leaves the range of the reading; lower the limit"
        )
    return found


def _order(step: tuple[Candidate, int]) -> tuple[int, float]:
    """Return the order of playing: walks that settle, other walks, triangles and sines by frequency, multisines."""
    candidate = step[0]
    if isinstance(candidate, Stairs):
        return 0 if candidate.readable else 1, -candidate.time_s
    return (2, candidate.frequency_hz) if isinstance(candidate, Tone) else (3, 0.0)


def _chosen(choice: Choice, candidates: tuple[Candidate, ...], time_s: float) -> tuple[list[int], list[int]]:
    """Return which stimuli are played and how often, with those that must be among them."""
    kept = _musts(choice, candidates, time_s)
    mask = thinned(choice, time_s, kept)
    once = np.where([isinstance(c, Stairs) for c in candidates], 1, np.ceil(NOTICED * time_s / choice.times_s))
    counts = whole(choice.part(mask), time_s, np.where(kept, once, 0)[mask].astype(np.int64))
    return np.flatnonzero(mask).tolist(), counts.tolist()


def _musts(choice: Choice, candidates: tuple[Candidate, ...], time_s: float) -> NDArray[np.bool_]:
    """Return the stimuli that are played whatever they weigh: what makes the answer independent of the blocks' orders.

    A walk whose levels can be read gives the borders without any dynamics; two amplitudes of one sine tell |G1| from
    |G2| without any rational function (physics.md 1.2).
    """
    gains = choice.shares(time_s / choice.times_s / choice.times_s.size)
    kept = np.zeros(len(candidates), dtype=bool)
    readable = [isinstance(c, Stairs) and c.readable for c in candidates]
    if any(readable):
        kept[_best(gains, readable)] = True
    paired = [any(_pair(one, other) for other in candidates) for one in candidates]
    if any(paired):
        first = _best(gains, paired)
        kept[[first, _best(gains, [_pair(candidates[first], c) for c in candidates])]] = True
    return kept


def _pair(one: Candidate, other: Candidate) -> bool:
    """Return whether these are sines of one frequency and of amplitudes well apart."""
    if not (isinstance(one, Tone) and isinstance(other, Tone)) or one.triangle or other.triangle:
        return False
    low, high = sorted((one.amplitude_v, other.amplitude_v))
    return one.frequency_hz == other.frequency_hz and high >= APART * low


def _best(gains: Array, among: list[bool]) -> int:
    """Return the index of the largest gain among some."""
    return int(np.argmax(np.where(among, gains, -np.inf)))


def weighed(
    model: Model, offer: Offer, candidates: tuple[Candidate, ...], noise_v: float, note: Note
) -> Choice:
    """Return the information of one repetition of every candidate about the rig and about rigs 30 % off."""
    rigs = [model, *(off(model, signs) for signs in SIGNS)]
    frequencies = corners_hz(chain_of(model), offer.room.rate_hz)
    matrices, slopes, prior = [], [], np.zeros((0, 0))
    asked: tuple[Quantity, ...] = ()
    for number, rig in enumerate(rigs):
        note("weighing stimuli", 0.05 + 0.8 * number / len(rigs))
        chain = chain_of(rig)
        coordinates = coordinates_of(chain, chain.values, [RUN], rig.fixed)
        asked = quantities(chain, coordinates, frequencies)
        slopes.append([q.slope / q.size for q in asked])
        matrices.append([_repetition(chain, coordinates, c, offer, noise_v) for c in candidates])
        prior = prior_of(coordinates)
    times_s = np.array([c.time_s for c in candidates])
    return Choice(np.array(matrices), np.array(slopes), _weights(asked, len(rigs)), prior, times_s)


def _weights(asked: Sequence[Quantity], rigs: int) -> NDArray[np.float64]:
    """Return the weights, shape (rigs, quantities): half to the first rig; of each rig half to F, half to the rest."""
    of_f = np.array([q.name.startswith("F.") for q in asked])
    halves = [part / np.count_nonzero(part) for part in (of_f, ~of_f) if part.any()]
    of_rig = np.full(rigs, 0.5 / (rigs - 1))
    of_rig[0] = 0.5
    return np.outer(of_rig, np.mean(halves, axis=0))


def _led(candidate: Candidate, offer: Offer) -> tuple[Array, int]:
    """Return samples that lead into a repetition and settle, with it behind them, and how many lead."""
    once = candidate.drawn(offer.room.rate_hz)
    lead = min(int(np.ceil(settling_s(offer.model) / candidate.time_s)), 50)
    return np.tile(once, lead + 1), lead * once.size


def _repetition(
    chain: Chain, coordinates: tuple[Coordinate, ...], candidate: Candidate, offer: Offer, noise_v: float
) -> NDArray[np.float64]:
    """Return the information of one settled repetition, shape (p, p)."""
    u, lead = _led(candidate, offer)
    steps = (Step("lead", "", 0, lead), Step("repetition", "", lead, u.size))
    trace = Trace(RUN, offer.room.rate_hz, u, np.broadcast_to(0.0, u.shape), steps=steps)
    use = np.arange(u.size) >= lead
    return np.asarray(by_step(chain, coordinates, [Observation(trace, use, noise_v)])[1][1])


def _stays_off(offer: Offer, candidate: Candidate) -> bool:
    """Return whether w keeps off the known rails and y within the range of the reading."""
    u, _ = _led(candidate, offer)
    plain = plain_chain(offer.model)
    taps = signals(plain, Trace(RUN, offer.room.rate_hz, u, np.broadcast_to(0.0, u.shape)))
    w, y = taps[plain.index(Place.F) - 1], taps[-1]
    inside = np.min(w) >= offer.rails_w[0] and np.max(w) <= offer.rails_w[1]
    return bool(inside and np.max(np.abs(y)) <= offer.room.reading_v)


def off(model: Model, signs: tuple[int, int, int, int]) -> Model:
    """Return the rig with gap, slopes and time constants of G1 and G2 off by 30 % one way or the other."""
    gap, slope, slow1, slow2 = (1.0 + OFF * sign for sign in signs)
    f = model.f
    if isinstance(f, Backlash):
        f = Backlash(f.s_l * slope, f.d_l_v * gap, f.s_u * slope, f.d_u_v * gap)
    elif isinstance(f, LinearF):
        f = LinearF(f.gain * slope, f.offset_v)
    return replace(model, g1=slowed(model.g1, slow1), f=f, g2=slowed(model.g2, slow2))


def slowed(block: Rational, factor: float) -> Rational:
    """Return a block whose time constants are all ``factor`` times as long, its gain at 0 Hz the same."""

    def stretched(side: tuple[float, ...]) -> tuple[float, ...]:
        return tuple(a * factor ** (len(side) - 1 - k) for k, a in enumerate(side))

    return Rational(stretched(block.num), stretched(block.den), block.dead_time_s * factor)


def purpose(model: Model, candidate: Candidate, steps: Sequence[tuple[Candidate, int]] = ()) -> str:
    """Return what a stimulus is for, in a sentence with the levels it reaches."""
    if isinstance(candidate, Stairs):
        if candidate.readable:
            met = "" if gap_of(model) is None else ", and either border is met on two levels or more"
            return f"Every level settles, also on a rig 30 % slower{met}: F can be read without any dynamics."
        return "Edges in quick succession: the levels need not settle for a joint fit."
    if isinstance(candidate, Chord):
        return "Several lines at once move the gap through uneven loops; no low harmonic of any is on the mains."
    v = candidate.amplitude_v * gain_at(model.g1, candidate.frequency_hz)
    gap = gap_of(model)
    moves = f", and the gap moves from {0.5 * (gap.d_l - gap.d_u):.3g} V on" if gap is not None else ""
    paired = any(_pair(candidate, c) for c, _ in steps)
    pair = " Two amplitudes here tell |G1| from |G2| whatever their orders are." if paired else ""
    return f"V = {v:.3g} V arrives at F{moves}.{pair}"
