"""Are the borders of the backlash bent, and does the bend pay for its parameters?

The straight fit says which stretch of v each border was ridden on; knots go there, evenly. From a straight line on,
more and more knots are fitted. How many are kept: one order more than Akaike's criterion would, so that what is left of
the error of the shape lies below its noise and the intervals hold (tests/benchmarks/bent_borders.py). Whether the bend
is believed at all is a matter of Schwarz's criterion, which hardly ever takes a straight border for a bent one, and the
repeats of the stimulus that are kept back have their say beside it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import log

import numpy as np

from identify.bent.border import Border, of_points
from identify.bent.curved import SIDES, CurvedPlay
from identify.blocks import Play
from identify.chain import Chain
from identify.fit import Fit, fit, total_chi_squared
from identify.identifiability.visits import visits
from identify.model import CurvedBacklash, Points
from identify.observe import Observation
from identify.trace import Array
from identify.uncertainty.inflation import inflation

COUNTS = (3, 4, 5, 6, 8, 10, 12, 15, 18)  # knots of a border, tried in this order
ALONG = 60  # places along a border for its nearest straight line
PATIENCE = 2  # orders without a better criterion that end the search

Ranges = Mapping[str, tuple[float, float]]


@dataclass(frozen=True)
class Order:
    """One number of knots that was tried (2: straight): chi-squared and what the criteria make of it.

    Where even the best order leaves more than noise, the criteria take what it leaves for the noise, as intervals do:
    otherwise whatever else the model lacks would speak for more knots.
    """

    knots: int
    parameters: int
    chi_squared: float
    akaike: float
    schwarz: float


@dataclass(frozen=True)
class Orders:
    """The straight fit, the bent one of the chosen order, and every order on the way."""

    straight: Fit
    bent: Fit
    tried: tuple[Order, ...]
    chosen: Order

    @property
    def pays(self) -> bool:
        """Return whether the bend is worth its parameters by Schwarz's criterion."""
        return self.chosen.schwarz < self.tried[0].schwarz


def ridden(chain: Chain, observations: Sequence[Observation]) -> Ranges:
    """Return for each border, L and U, the stretch of v in V on which w rode it; ValueError when one was never met."""
    where = visits(chain, observations)
    found = dict(zip(SIDES, (where.loading, where.unloading), strict=True))
    for side, stretch in found.items():
        if not stretch.low < stretch.high:
            raise ValueError(f"no run rides the {SIDES[side]} border, so its shape cannot be told")
    return {side: (stretch.low, stretch.high) for side, stretch in found.items()}


def _lines(chain: Chain) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return slope and crossing of the straight borders."""
    v = chain.values
    return (v["F.S_L"], v["F.D_L"]), (v["F.S_U"], v["F.D_U"])


def bent(straight: Chain, knots: int, ranges: Ranges) -> Chain:
    """Return a straight chain with the same borders as points, ``knots`` to a border; ValueError without a play."""
    play = _straight_play(straight)
    points = [
        tuple((float(v), s * (float(v) - d)) for v in np.linspace(*ranges[side], knots))
        for side, (s, d) in zip(SIDES, _lines(straight), strict=True)
    ]
    stage = CurvedPlay(CurvedBacklash(*points))
    return with_curves(straight, play, stage)


def _straight_play(chain: Chain) -> Play:
    """Return the plain backlash of a chain; ValueError when it has none."""
    play = chain.stage_of(Play)
    if play is None or type(play) is not Play:
        raise ValueError("bent borders take the place of a plain backlash, and this model of F has none")
    return play


def with_curves(chain: Chain, old: Play | CurvedPlay, stage: CurvedPlay) -> Chain:
    """Return a chain with ``stage`` for its F, at the values it was made with; those of the old F are dropped."""
    gone = {p.name for p in old.parameters()}
    kept = Chain(chain.stages, {k: v for k, v in chain.values.items() if k not in gone}, chain.added)
    names = [p.name for p in stage.parameters()]
    return kept.with_replaced(old, stage, dict(zip(names, stage.start_values(), strict=True)))


def resampled(start: Chain, shaped: Chain) -> Chain:
    """Return ``start``, a chain with bent borders, with everything as ``shaped`` has it, its curves at other knots."""
    stage, shape = start.stage_of(CurvedPlay), shaped.stage_of(CurvedPlay)
    assert stage is not None
    shared = {name: shaped.values[name] for name in start.values if name in shaped.values}
    if shape is None:
        return start.with_values(shared)
    curves = shape.backlash(shaped.of(shape, ""))
    moved = CurvedPlay(CurvedBacklash(*(
        _moved(old, new) for old, new in ((curves.loading, stage.start.loading),
                                          (curves.unloading, stage.start.unloading))
    )))  # fmt: skip
    values = dict(zip([p.name for p in moved.parameters()], moved.start_values(), strict=True))
    return start.with_values({**{k: v for k, v in shared.items() if not k.startswith("F.")}, **values})


def _moved(curve: Points, onto: Points) -> Points:
    """Return the points of a curve at other knots."""
    at = np.array([v for v, _ in onto])
    return tuple(zip(at.tolist(), of_points(curve).at(at).tolist(), strict=True))


def orders(
    straight: Fit, observations: Sequence[Observation], fixed: Sequence[str] = (), knots: int | None = None
) -> Orders:
    """Fit bent borders from the straight fit on, with ``knots`` to a border or one order more than Akaike's choice.

    Raises ValueError where there is no plain backlash to bend or a border was never ridden.
    """
    _straight_play(straight.chain)
    ranges = ridden(straight.chain, observations)
    fits = {2: straight}
    for count in COUNTS if knots is None else (knots,):
        flat = bent(straight.chain, count, ranges)
        start = resampled(flat, list(fits.values())[-1].chain)
        fits[count] = fit(start, observations, {**flat.values, **centre_of(straight, flat)}, fixed)
        tried = judged(fits, observations)
        if min(range(len(tried)), key=lambda i: tried[i].akaike) < len(tried) - PATIENCE:
            break
    best = min(range(1, len(tried)), key=lambda i: tried[i].akaike)
    chosen = tried[min(best + 1, len(tried) - 1)]
    return Orders(straight, fits[chosen.knots], tried, chosen)


def centre_of(found: Fit, chain: Chain) -> dict[str, float]:
    """Return where the prior of a fit sat, as far as ``chain`` has the same parameters."""
    return {c.name: c.centre for c in found.coordinates if c.name in chain.values}


def judged(fits: Mapping[int, Fit], observations: Sequence[Observation]) -> tuple[Order, ...]:
    """Return what the criteria make of fits by their number of knots."""
    count = sum(o.count for o in observations)
    chi = {knots: total_chi_squared(found.chain, observations) for knots, found in fits.items()}
    closest = min(chi, key=lambda knots: chi[knots])
    beyond_noise = inflation(fits[closest].chain, observations) ** 2
    rows = []
    for knots, found in fits.items():
        size, scaled = len(found.coordinates), chi[knots] / beyond_noise
        rows.append(Order(knots, size, chi[knots], scaled + 2.0 * size, scaled + size * log(count)))
    return tuple(rows)


def borders_of(chain: Chain) -> tuple[Border, Border]:
    """Return the loading and the unloading border of a chain with bent ones."""
    stage = chain.stage_of(CurvedPlay)
    assert stage is not None
    return stage.borders(chain.of(stage, ""))


def straight_lines(chain: Chain) -> Array:
    """Return S_L, D_L, S_U, D_U of the straight lines nearest to bent borders over the stretch their knots span."""
    found = []
    for border in borders_of(chain):
        v = np.linspace(border.knots[0], border.knots[-1], ALONG)
        slope, offset = np.polyfit(v, border.at(v), 1)
        found += [slope, -offset / slope]
    return np.array(found)


def straight_values(chain: Chain) -> dict[str, float]:
    """Return the values of a chain, the nearest straight borders among them where its borders are bent."""
    if chain.stage_of(CurvedPlay) is None:
        return dict(chain.values)
    names = ("F.S_L", "F.D_L", "F.S_U", "F.D_U")
    return {**chain.values, **dict(zip(names, straight_lines(chain).tolist(), strict=True))}
