"""How is unnamed physics written into a model, and read back to the last bit?

A model keeps a piece of physics as an id, a stage, a form and values by short name. Here the id is ``unnamed``, the
form names a kind of correction, the knots are the values ``at1``, ``at2`` ... and the weights stand beside them.
"""

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from identify.chain import Chain
from identify.model import Physics
from identify.stage import Place
from identify.unnamed.contact import AfterContact, AfterEither, AfterImpact, Giving, Kicking, Sticking
from identify.unnamed.correction import UNNAMED, Correction
from identify.unnamed.crossings import Pulse
from identify.unnamed.drawn import Drawn
from identify.unnamed.hysteresis import Hysteresis, Relays
from identify.unnamed.linear import Bypass, Filter, OneWay, SlowFilter
from identify.unnamed.lines import Flutter, GapRipple, Line, Ripple, Wave
from identify.unnamed.maps import BrokenMap, LevelMap, LevelTable, OuterMap, SourceGain, SourceMap
from identify.unnamed.memory import BorderMap, Leak, Plateau
from identify.unnamed.past import AFTER, Swiftness
from identify.unnamed.rates import BorderOverRate, GainOverRate, GapOverRate, RateMap, Trailing
from identify.unnamed.sudden import SUDDEN, GainSince, SuddenDynamics
from identify.unnamed.timed import (
    Ageing,
    GainInRun,
    GainOverClock,
    GainSteps,
    GapInRun,
    GapOverClock,
    GapSteps,
    LeadInRun,
    LeadOverClock,
    LeadSteps,
    Moments,
    OffsetInRun,
    OffsetOverClock,
    OffsetSteps,
)
from identify.unnamed.turned import FARTHEST, SINCE

AT = "at"
UNEVEN = 1e-6  # share by which evenly spaced knots may differ, for rounding
EVERY: tuple[type[Correction], ...] = (
    LevelMap, BrokenMap, OuterMap, LevelTable, Pulse, BorderMap, SourceMap, SourceGain, Leak, RateMap, GainOverRate,
    GapOverRate, BorderOverRate, Trailing, Filter, SlowFilter, OneWay, Bypass, Hysteresis, Relays, Sticking, Giving,
    Kicking, AfterContact, AfterEither, AfterImpact, Plateau, *FARTHEST, *SINCE, OffsetOverClock,
    OffsetSteps, OffsetInRun, Moments, GainOverClock, GainSteps, GainInRun, GapOverClock, GapSteps, GapInRun,
    LeadOverClock, LeadSteps, LeadInRun, Ageing, *SUDDEN, GainSince, SuddenDynamics, Line, Wave,
    Ripple, Flutter, GapRipple, *AFTER, Swiftness, Drawn,
)  # fmt: skip
KINDS = {kind.form: kind for kind in EVERY}


def is_unnamed(name: str) -> bool:
    """Return whether a piece of physics is a correction: ``unnamed``, or ``unnamed_2`` beside another."""
    return name == UNNAMED or (name.startswith(f"{UNNAMED}_") and name.removeprefix(f"{UNNAMED}_").isdigit())


def kind_of(form: str) -> type[Correction]:
    """Return the kind of correction a model calls ``form``, the map of the level when it says nothing."""
    kind = KINDS.get(form or LevelMap.form)
    if kind is None:
        raise ValueError(f"{UNNAMED} has no form {form!r}; forms: {', '.join(KINDS)}")
    return kind


def units_of(piece: Physics) -> dict[str, str]:
    """Return the unit of every value that unnamed physics of a form, with the knots it names, may have."""
    kind = kind_of(piece.form)
    blank = kind(kind.places[0], tuple(range(knot_count(piece.values))))
    weights = {p.name.removeprefix(f"{UNNAMED}."): p.unit for p in blank.parameters()}
    return {**knot_units(blank), **weights}


def knot_count(names: Mapping[str, object]) -> int:
    """Return how many knots the names of values speak of."""
    return sum(name.startswith(AT) and name.removeprefix(AT).isdigit() for name in names)


def correction_of(piece: Physics) -> Correction:
    """Return the correction a model keeps; ValueError with one sentence for one that cannot be."""
    kind = kind_of(piece.form)
    place = Place.of(piece.stage) if piece.stage else kind.places[0]
    if place not in kind.places:
        raise ValueError(f"{piece.form} is not at {place.label}; stages: {', '.join(p.label for p in kind.places)}")
    names = [f"{AT}{i}" for i in range(1, knot_count(piece.values) + 1)]
    if len(names) < kind.least or not set(names) <= set(piece.values):
        raise ValueError(f"{piece.id} ({kind.form}) needs knots {AT}1, {AT}2 ..., at least {kind.least}")
    knots = tuple(piece.values[name] for name in names)
    if any(b <= a for a, b in pairwise(knots)):
        raise ValueError(f"{piece.id}: its knots {AT}1, {AT}2 ... must rise")
    if kind.even and max(np.diff(knots)) > (1.0 + UNEVEN) * min(np.diff(knots)):
        raise ValueError(f"{piece.id} ({kind.form}): its knots {AT}1, {AT}2 ... must be evenly spaced")
    for name, unit in kind.constants:
        if not piece.values.get(name, 0.0) > 0.0:
            raise ValueError(f"{piece.id} ({kind.form}) needs {name}, in {unit}, above zero")
    return kind(place, knots, piece.id, **{name: piece.values[name] for name, _ in kind.constants})


def with_unnamed(chain: Chain, piece: Physics) -> Chain:
    """Return ``chain`` with the correction a model keeps; ValueError for a value it does not have."""
    correction = correction_of(piece)
    known = {p.name for p in correction.parameters()}
    values = {f"{piece.id}.{k}": v for k, v in piece.values.items() if k not in knot_units(correction)}
    for name in values:
        if name.partition("[")[0] not in known:
            short = name.removeprefix(f"{piece.id}.")
            raise ValueError(f"{piece.id} ({correction.form}) has no value {short!r}")
    if not correction.applicable(chain):
        raise ValueError(f"{piece.id} ({correction.form}) does not go into this F")
    return correction.put_in(chain, values)


def knot_units(correction: Correction) -> dict[str, str]:
    """Return the names and the units of the knots, and of what else is given and not fitted."""
    return {f"{AT}{i}": correction.knot_unit for i in range(1, len(correction.knots) + 1)} | dict(correction.constants)


def piece_of(correction: Correction, chain: Chain) -> Physics:
    """Return a correction as a model keeps it, with the values it has in ``chain``."""
    own = {p.name for p in correction.parameters()}
    constants = [float(getattr(correction, name)) for name, _ in correction.constants]
    knots = dict(zip(knot_units(correction), (*correction.knots, *constants), strict=True))
    weights = {
        name.removeprefix(f"{correction.name}."): value
        for name, value in chain.values.items() if name.partition("[")[0] in own
    }  # fmt: skip
    return Physics(correction.name, {**knots, **weights}, correction.place.label, correction.form)
