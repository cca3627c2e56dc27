"""Which corrections of free form say where a mismatch enters, without saying what it is?

A correction is the most that any physics of its kind at its place could explain, so it locates what has no name, and it
judges a name: physics that explains much less than the correction at the same place is the wrong one.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np

from identify.blocks import Play
from identify.chain import Chain
from identify.evidence import Evidence
from identify.explain.frequencies import flutter_hz, in_front_hz, line_hz, ripple_hz
from identify.lags import time_constants
from identify.stage import Place
from identify.trace import Array
from identify.unnamed.contact import AfterContact, AfterEither, AfterImpact, Giving, Kicking, Sticking
from identify.unnamed.correction import UNNAMED, Correction
from identify.unnamed.crossings import Pulse
from identify.unnamed.drawn import Drawn
from identify.unnamed.hysteresis import Hysteresis, Relays
from identify.unnamed.linear import Bypass, Filter, OneWay, SlowFilter
from identify.unnamed.lines import Flutter, GapRipple, Line, Ripple
from identify.unnamed.maps import LevelMap, LevelTable, SourceGain, SourceMap
from identify.unnamed.memory import BorderMap, Leak, Plateau
from identify.unnamed.past import AFTER, Swiftness
from identify.unnamed.rates import BorderOverRate, GainOverRate, GapOverRate, RateMap, Trailing
from identify.unnamed.timed import (
    Ageing,
    GainInRun,
    GainOverClock,
    GainSteps,
    GapInRun,
    GapOverClock,
    GapSteps,
    LeadInRun,
    LeadSteps,
    OffsetInRun,
    OffsetOverClock,
    OffsetSteps,
    Timed,
)
from identify.unnamed.turned import FARTHEST, SINCE
from identify.unnamed.what import Gap

FINE = 24  # of a map of the level that turns more often
KNOTS = 10  # of a map of the level where it is one of many: with more, each run has levels of its own
MORE = 18  # gaps of a second hysteresis that is fitted
FINER = (16, 28)  # of one that is fitted: the data choose
TAUS = 6  # time constants of a filter
CLOCK = 6
OFTENER = (16, 48)  # of a gain of the reading that drifts, or of what comes anew in every run, and is fitted
LAGS = 5
TURNS = 5
RATES = (0.3, 0.5, 0.7, 0.83, 0.93)  # of the largest: what a stage may be too slow for
RUNS = 32  # starts of runs from which on something may be another, at most
AGEING = 3
SPEEDS = 9  # levels at which dynamics may differ
GAPS = (3e-5, 3e-4, 1e-3, 3e-3, 0.01, 0.02, 0.04, 0.06, 0.09, 0.13, 0.18, 0.25, 0.35)  # of a range: half gaps
PUSHES = (3e-3, 7e-3, 0.015, 0.03, 0.06, 0.12)  # of how far w goes: what breaks a contact loose
THRESHOLDS = (0.05, 0.15, 0.3, 0.5, 0.7)  # of how far a signal goes: where something may switch
RINGS = 24  # instants after contact, close enough to show how it rings
KICKS = 3  # levels of w at which a contact that opens may push it by something else
RESTS = 50  # samples for which a level is kept, to be one that u rests on
APART = 1e-3  # of the range of u: levels closer than that are one
DWELT = 48  # levels that a table may have
SLOWER = 2.0  # than the slowest time constant of the chain: where creep begins and the filters of G1 and G2 end


def corrections(evidence: Evidence) -> Iterator[Correction]:
    """Yield every correction that makes sense for the chain and the data."""
    name = free_name(evidence.chain)
    for family in (_laws, _linear, _memories, _timed, _mixed):
        yield from (correction for correction in family(evidence, name) if correction.applicable(evidence.chain))


def free_name(chain: Chain) -> str:
    """Return the name of a further correction: ``unnamed``, or ``unnamed_2`` ... where the chain has one."""
    taken = {stage.name for stage in chain.added}
    return UNNAMED if UNNAMED not in taken else f"{UNNAMED}_{sum(t.startswith(UNNAMED) for t in taken) + 1}"


def _laws(evidence: Evidence, name: str) -> Iterator[Correction]:
    """Yield laws of level, rate and clock."""
    remembers = evidence.chain.stage_of(Play) is not None  # else a map of v is one of w
    for place in (Place.F, Place.SENSE, Place.SOURCE, *([Place.G1] if remembers else [])):
        yield from (LevelMap(place, level_knots(evidence, place, count), name) for count in (KNOTS, FINE))
    levels = dwelt_levels(evidence)
    if LevelTable.least <= len(levels) <= DWELT:
        yield LevelTable(Place.SOURCE, levels, name)
    yield Pulse(Place.SOURCE, fast_s(evidence)[1::2], name)
    yield from (RateMap(place, evidence.rates(place), name) for place in (Place.G1, Place.F, Place.G2))
    for place in GainOverRate.places:
        yield GainOverRate(place, speeds(evidence, place), name)
    for place in Trailing.places:
        top = max(evidence.rates(place))
        yield Trailing(place, tuple(share * top for share in (*(-q for q in RATES[::-1]), *RATES)), name)
    yield from (kind(Place.SENSE, level_knots(evidence, Place.SOURCE, KNOTS), name) for kind in (SourceMap, SourceGain))


def _linear(evidence: Evidence, name: str) -> Iterator[Correction]:
    """Yield filters at the time constants of the circuit and beyond, a path past the circuit, and lines."""
    slowest = SLOWER * slowest_s(evidence)
    fast = fast_s(evidence)
    slow = tuple(np.geomspace(2.0 * slowest, max(0.5 * evidence.longest_s, 4.0 * slowest), TAUS).tolist())
    yield from (Filter(place, fast, name) for place in (Place.G1, Place.G2))
    yield from (OneWay(place, fast[1::2], name) for place in OneWay.places)
    yield from (SlowFilter(place, slow, name) for place in (Place.SOURCE, Place.SENSE))
    for place in Drawn.places:
        knots, taus = level_knots(evidence, place, KNOTS), time_constants(evidence.chain, place)
        yield from (Drawn(place, knots, name, float(tau)) for tau in taus if tau > evidence.sample_s)
    yield Bypass(Place.SENSE, (0.0, *fast[1::2]), name)
    line = line_hz(evidence)
    yield Line(Place.SENSE, (line,), name)
    yield from (Line(Place.G1, (hz,), name) for hz in (line, *in_front_hz(evidence)))


def _memories(evidence: Evidence, name: str) -> Iterator[Correction]:
    """Yield what changes the hysteresis."""
    yield BorderMap(Place.F, level_knots(evidence, Place.G1, KNOTS), name)
    yield BorderOverRate(Place.F, speeds(evidence, Place.G1), name)
    for law in FARTHEST:
        yield from (law(place, distances(evidence, law.followed(place)), name) for place in law.places)
    since = (0.0, *np.geomspace(0.5 * slowest_s(evidence), max(0.5 * evidence.longest_s, slowest_s(evidence)), TURNS))
    yield from (law(place, since, name) for law in SINCE for place in law.places)
    width = max(map(abs, evidence.range(Place.F)))
    yield Sticking(Place.F, tuple(share * max(width, 1e-9) for share in PUSHES), name)
    yield Giving(Place.F, fast_s(evidence)[1::2], name)
    yield Kicking(Place.F, level_knots(evidence, Place.F, KICKS), name)
    yield from (kind(Place.F, fast_s(evidence), name) for kind in (AfterContact, AfterImpact))
    yield Leak(Place.F, level_knots(evidence, Place.G1, KNOTS), name)
    for place in Hysteresis.places:
        low, high = evidence.range(place)
        yield Hysteresis(place, tuple(share * max(high - low, 1e-9) for share in GAPS), name)
        if place in Relays.places:
            yield Relays(place, tuple(share * max(high, -low, 1e-9) for share in THRESHOLDS), name)
    yield Plateau(Place.F, level_knots(evidence, Place.F, 5), name)


def _timed(evidence: Evidence, name: str) -> Iterator[Correction]:
    """Yield what goes with time: the clock, from run to run, or within every run."""
    clock, runs = clock_knots(evidence), tuple(sorted({o.trace.start_s for o in evidence.observations}))
    within = (0.0, *np.geomspace(evidence.longest_s / 2**CLOCK, evidence.longest_s, CLOCK).tolist())
    kinds: tuple[tuple[tuple[float, ...], tuple[type[Timed], ...]], ...] = (
        (clock, (OffsetOverClock, GainOverClock, GapOverClock)),
        (runs, (OffsetSteps, GainSteps, GapSteps, LeadSteps)),
        (within, (OffsetInRun, GainInRun, GapInRun, LeadInRun)),
    )
    for knots, laws in kinds if len(runs) > 1 else kinds[:1]:  # of one run, all is by the clock
        if Timed.least <= len(knots) <= RUNS:  # of F, what changes the gap: all else is as well at the reading
            pairs = ((law, place) for law in laws for place in law.places)
            yield from (law(p, knots, name) for law, p in pairs if p is not Place.F or issubclass(law, Gap))
    fast = tuple(np.geomspace(evidence.sample_s, max(slowest_s(evidence), 2.0 * evidence.sample_s), AGEING).tolist())
    yield from (Ageing(place, (*fast, clock[-1]), name) for place in Ageing.places)


def sharpened(evidence: Evidence, correction: Correction) -> list[Correction]:
    """Return a map of the level, a current or a creep over it, or what comes anew in every run, with more knots, a
    hysteresis of more gaps, a drift of the gain of the reading with more knots, both borders alike over the rate; else
    nothing.

    More knots of an offset by the clock, or of a gain in front of F, would follow whatever wanders or changes.
    """
    anew = isinstance(correction, Timed) and correction.counted == "in a run"
    if anew or (correction.form == GainOverClock.form and correction.place is Place.SENSE):
        more = [count for count in (OFTENER[:1] if anew else OFTENER) if count > len(correction.knots)]
        return [replace(correction, knots=oftener(evidence, correction, count, anew)) for count in more]
    if correction.form in (AfterContact.form, AfterImpact.form):
        often = tuple(np.geomspace(correction.knots[0], correction.knots[-1], RINGS).tolist())
        kinds = (AfterContact, AfterEither) if correction.form == AfterContact.form else (AfterImpact,)
        return [kind(correction.place, at, correction.name) for kind in kinds for at in (correction.knots, often)]
    if correction.form == BorderOverRate.form:
        return [GapOverRate(correction.place, correction.knots, correction.name)]
    if correction.form == Hysteresis.form:
        ends = correction.knots[0], correction.knots[len(correction.knots) // 3], correction.knots[-1]
        return [replace(correction, knots=tuple(np.geomspace(*pair, MORE).tolist())) for pair in pairwise(ends)]
    if correction.form not in (LevelMap.form, Drawn.form, Plateau.form) or correction.place == Place.SOURCE:
        return []
    counts = (KNOTS, *FINER) if correction.form == Plateau.form else FINER
    return [replace(correction, knots=level_knots(evidence, correction.place, count)) for count in counts]


def _mixed(evidence: Evidence, name: str) -> Iterator[Correction]:
    """Yield what lets one thing change another."""
    yield from (Ripple(place, (ripple_hz(evidence, place),), name) for place in Ripple.places)
    flutter = flutter_hz(evidence.fine)
    yield from (Flutter(place, (flutter,), name) for place in Flutter.places)
    if evidence.chain.stage_of(Play) is not None:
        yield GapRipple(Place.F, (ripple_hz(evidence, Place.F),), name)
    slowest = slowest_s(evidence)
    lags = tuple(np.geomspace(slowest, max(100.0 * slowest, evidence.longest_s), LAGS).tolist())
    yield from (kind(place, lags, name) for kind in AFTER for place in kind.places)
    for place in (Place.G1, Place.G2):
        yield Swiftness(place, with_zero(level_knots(evidence, place, SPEEDS)), name)


def speeds(evidence: Evidence, place: Place) -> tuple[float, ...]:
    """Return the rates of change of the signal behind a place without their sign, V/s, zero first."""
    return tuple(rate for rate in evidence.rates(place) if rate >= 0.0)


def distances(evidence: Evidence, place: Place) -> tuple[float, ...]:
    """Return distances from zero of the signal behind a place, V, up to the farthest."""
    return tuple(np.linspace(0.0, max(*map(abs, evidence.range(place)), 1e-9), TURNS).tolist())


def level_knots(evidence: Evidence, place: Place, count: int) -> tuple[float, ...]:
    """Return evenly spaced knots over the range of the signal behind a place, V."""
    low, high = evidence.range(place)
    margin = 1e-3 * (high - low) + 1e-9
    return tuple(np.linspace(low - margin, high + margin, count).tolist())


def dwelt_levels(evidence: Evidence) -> tuple[float, ...]:
    """Return the levels that u rests on, and the ends of its range, V; what lies closer than ``APART`` of it is one."""
    low, high = evidence.range(Place.SOURCE)
    rests = np.unique(np.concatenate([_rests(o.trace.u[:]) for o in evidence.observations]))
    inner = rests[(rests > low + APART * (high - low)) & (rests < high - APART * (high - low))]
    inner = inner[np.diff(inner, prepend=-np.inf) > APART * (high - low)]
    return (low, *inner.tolist(), high) if high > low else ()


def _rests(u: Array) -> Array:
    """Return the levels that ``u`` keeps for ``RESTS`` samples and more, V."""
    ends = np.append(np.flatnonzero(np.diff(u)), u.size - 1)
    return np.asarray(u[ends[np.diff(ends, prepend=-1) >= RESTS]])


def with_zero(knots: tuple[float, ...]) -> tuple[float, ...]:
    """Return knots of which the inner one next to zero is moved there: what goes with a size turns at zero."""
    if not knots[0] < 0.0 < knots[-1]:
        return knots
    nearest = min(range(1, len(knots) - 1), key=lambda i: abs(knots[i]))
    return (*knots[:nearest], 0.0, *knots[nearest + 1 :])


def clock_knots(evidence: Evidence) -> tuple[float, ...]:
    """Return knots from the first to the last sample of all runs, s."""
    starts = [o.trace.start_s for o in evidence.observations]
    ends = [o.trace.start_s + o.trace.size * evidence.sample_s for o in evidence.observations]
    return tuple(np.linspace(min(starts), max(ends), CLOCK).tolist())


def oftener(evidence: Evidence, law: Correction, count: int, anew: bool) -> tuple[float, ...]:
    """Return more knots of a law over time, s, the time in a run where it comes ``anew`` in each."""
    return tuple(np.linspace(0.0, law.knots[-1], count).tolist()) if anew else recorded_knots(evidence, count)


def recorded_knots(evidence: Evidence, count: int) -> tuple[float, ...]:
    """Return knots on the clock, s, with as much recorded between any two of them, from the first to the last sample.
    """
    runs = sorted((o.trace.start_s, o.trace.start_s + o.trace.size * evidence.sample_s) for o in evidence.observations)
    ends = np.ravel(runs)
    told = np.cumsum([0.0, *np.where(np.arange(ends.size - 1) % 2, 0.0, np.diff(ends))])
    knots = np.interp(np.linspace(0.0, told[-1], count), told, ends)
    return tuple(np.unique(knots).tolist())


def fast_s(evidence: Evidence) -> tuple[float, ...]:
    """Return time constants of the circuit and below, s, from half a sample on."""
    slowest = SLOWER * slowest_s(evidence)
    return tuple(np.geomspace(0.5 * evidence.sample_s, max(slowest, evidence.sample_s), TAUS).tolist())


def slowest_s(evidence: Evidence) -> float:
    """Return the slowest time constant of G1 and G2 as fitted, s; a sample where they have none."""
    constants = (time_constants(evidence.chain, place) for place in (Place.G1, Place.G2))
    return max([evidence.sample_s, *(float(taus[0]) for taus in constants if taus.size)])
