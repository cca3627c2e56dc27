"""Which experiment would decide what the data could not, and what can no experiment at this rig's input decide?

Every member of an undecided set is fitted to what was recorded. The stimuli that suit the rig are then weighed by how
sharply their readings would rule out each member if another one were true, all parameters refitted
(identify.planning.discrimination), and the few that decide soonest make the protocol.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from threadpoolctl import threadpool_limits

from identify.effects import would_separate
from identify.explain.contenders import Contender, contenders
from identify.explain.explanation import Explanation, Finding
from identify.explain.phrases import probe
from identify.holdout import settling_s
from identify.model import Model
from identify.natural_units import shown
from identify.planning.candidates import Candidate, Chord, Room, Stairs
from identify.planning.discrimination import (
    LEAST,
    Choice,
    Rival,
    Sums,
    answers,
    chosen,
    difference,
    of_every_kind,
    rival,
    spread,
    told,
    trusted,
)
from identify.planning.separators import kind_of, separators
from identify.unnamed.correction import UNNAMED

HELD_BACK = 1  # repeats of every step beyond those that decide: an explanation keeps the last of them for the proof
DWELLS = 40  # times G1 and G2 may settle in a protocol, at least
WEIGHED = 24  # stimuli of which the slopes are computed; the others are behind them in the plain difference

Note = Callable[[str, float], None]


@dataclass(frozen=True)
class Separation:
    """An undecided set, the protocol that is expected to decide it, and what it cannot decide.

    ``sharpness`` is by how many standard deviations the closest of the pairs it separates are expected to part;
    ``equal`` are the members that no stimulus within the limits tells from the one that was named.
    """

    id: str
    stage: str
    members: tuple[Contender, ...]
    steps: tuple[tuple[Candidate, int], ...]
    time_s: float
    sharpness: float
    equal: tuple[Contender, ...]
    sentence: str

    @property
    def of_places(self) -> bool:
        """Return whether its members are places at which what has no name may have come in."""
        return self.id == UNNAMED

    @property
    def name(self) -> str:
        """Return a name for its files."""
        return f"separate_{self.id}_{self.stage}"


def least_time_s(model: Model) -> float:
    """Return the time that a protocol may always take, however short the recordings before it were, s."""
    return DWELLS * settling_s(model)


def undecided(explained: Explanation) -> tuple[Finding, ...]:
    """Return the findings whose physics has a name and could have another."""
    return tuple(f for f in explained.effects if f.could_also_be and f.id != UNNAMED)


def separations(
    explained: Explanation, room: Room, note: Note = lambda sentence, share: None
) -> tuple[Separation, ...]:
    """Return for every undecided set what would decide it, within a room for the input.

    The places at which what has no name may have come in are such a set, too.
    """
    sets = undecided(explained)
    found = []
    with threadpool_limits(1, "blas"):
        for number, finding in enumerate(sets):
            note(f"looking for what tells {finding.id} from its rivals", number / len(sets))
            found.append(_separation(explained, contenders(explained, finding), room))
        if len(explained.entered) > 1:
            note("looking for what tells where the mismatch enters", 0.9)
            found.append(_separation(explained, explained.entered, room))
    return tuple(found)


def _separation(explained: Explanation, members: tuple[Contender, ...], room: Room) -> Separation:
    """Return what decides one set."""
    fitted = [m for m in members if m.fit is not None]
    if len(fitted) < 2:
        return _separated(members, (), None, [])
    rivals = [rival(m.fit, m.probability, explained.model.fixed) for m in fitted if m.fit is not None]
    options = _worth(rivals, separators(explained.model, room), room, explained.noise.rms_v)
    if not options:
        return _separated(members, (), None, [])
    options, sums = _weighed(rivals, options, room, explained.noise.rms_v, members[0].substeps)
    if not options:
        return _separated(members, (), None, [])
    times_s = [c.time_s for c in options]
    if members[0].nameless:
        choice = of_every_kind(rivals, sums, [kind_of(c) for c in options], times_s, room.time_s)
    else:
        choice = chosen(rivals, sums, times_s, room.time_s)
    return _separated(members, options, choice, fitted)


def _worth(
    rivals: Sequence[Rival], candidates: Sequence[Candidate], room: Room, noise_v: float
) -> tuple[Candidate, ...]:
    """Return the stimuli of every kind on which the answers differ most per second and stay within the reading."""
    gains, usable = [], []
    for candidate in candidates:
        readings = answers(rivals, candidate.drawn(room.rate_hz), room.rate_hz)
        if max(float(np.max(np.abs(y))) for y in readings) <= room.reading_v:
            between = difference(readings, noise_v)
            usable.append(candidate)
            gains.append(min(between.values()) / candidate.time_s)
    return tuple(usable[k] for k in spread(gains, [kind_of(c) for c in usable], WEIGHED))


def _weighed(
    rivals: Sequence[Rival], options: Sequence[Candidate], room: Room, noise_v: float, substeps: int
) -> tuple[tuple[Candidate, ...], list[Sums]]:
    """Return the stimuli of which a simulation tells what the hypotheses answer, and what each tells them apart by."""
    drawn = [c.drawn(room.rate_hz) for c in options]
    sums = [told(rivals, u, room.rate_hz, noise_v, substeps) for u in drawn]
    good = [trusted(rivals, s, u, room.rate_hz, noise_v) for s, u in zip(sums, drawn, strict=True)]
    return tuple(c for c, g in zip(options, good, strict=True) if g), [s for s, g in zip(sums, good, strict=True) if g]


def _separated(
    members: tuple[Contender, ...], options: Sequence[Candidate], choice: Choice | None, fitted: Sequence[Contender]
) -> Separation:
    """Return the set with its protocol and its sentence."""
    reached = _reached(choice, fitted) if choice else {}
    named = members[0]
    equal = tuple(m for m in members[1:] if reached.get((named.label, m.label), 0.0) < LEAST)
    apart = [z for (one, other), z in reached.items() if z >= LEAST]
    steps = _played(options, choice) if choice and apart else ()
    sentence = _sentence(named, [m for m in members[1:] if m not in equal], equal, steps, min(apart, default=0.0))
    time_s = sum(c.time_s * n for c, n in steps)
    return Separation(named.id, named.stage, members, steps, time_s, min(apart, default=0.0), equal, sentence)


def _reached(choice: Choice, fitted: Sequence[Contender]) -> dict[tuple[str, str], float]:
    """Return by how many standard deviations each two members are expected to be told apart, whichever is true."""
    numbers = combinations(range(len(fitted)), 2)
    return {
        (fitted[a].label, fitted[b].label): min(choice.sharpness[a, b], choice.sharpness[b, a]) for a, b in numbers
    }  # fmt: skip


def _played(options: Sequence[Candidate], choice: Choice) -> tuple[tuple[Candidate, int], ...]:
    """Return the steps that were chosen with their repeats: walks first, then sines by frequency, then multisines."""

    def order(step: tuple[Candidate, int]) -> tuple[int, float]:
        candidate = step[0]
        if isinstance(candidate, Stairs):
            return 0, candidate.dwell_s
        return (2, 0.0) if isinstance(candidate, Chord) else (1, candidate.frequency_hz)

    steps = [(c, n + HELD_BACK) for c, n in zip(options, choice.repeats, strict=True) if n]
    return tuple(sorted(steps, key=order))


def _sentence(
    named: Contender, apart: Sequence[Contender], equal: Sequence[Contender], steps: Sequence[tuple[Candidate, int]],
    sharpness: float,
) -> str:  # fmt: skip
    """Return what the protocol decides and what it does not."""
    parts = [_equal(named, member) for member in equal]
    if steps and apart:
        parts.insert(0, _apart(named, apart, sum(c.time_s * n for c, n in steps), sharpness))
    return "; ".join(parts)


def _apart(named: Contender, others: Sequence[Contender], time_s: float, sharpness: float) -> str:
    """Return what a protocol tells apart, and how sharply; of laws without a name that is only so far as they go."""
    length, rest = shown(time_s, "s", 2), " and ".join(m.label for m in others)
    tell = f"tell {named.label} from {rest} by {sharpness:.2g} standard deviations or more"
    if named.nameless:
        return f"{length} of it would {tell}, if one of these were all there is"
    return f"{length} of it are expected to {tell}"


def _equal(named: Contender, member: Contender) -> str:
    """Return why two members stay together, and what outside the protocol would part them."""
    wanted = would_separate(named.id, named.stage, member.id, member.stage)
    wanted = wanted or (probe(named.stage, member.stage) if named.nameless else "")
    outside = f": {wanted}" if wanted else ", such as a loopback cable or a tap behind G1"
    if member.exact:
        return f"{member.label} gives the same data whatever is played; it takes something else{outside}"
    return (
        f"{member.label} is not expected to be told from {named.label} by anything played within the limits; it takes "
        f"wider limits or something else{outside}"
    )
