"""Which shape do the borders have, how sure is that, and does the bend pay for its parameters?"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from identify.bent.bend import Order, Orders, borders_of, centre_of, orders, straight_lines
from identify.bent.curved import SIDES, CurvedPlay
from identify.chain import Chain
from identify.fit import Fit, fit
from identify.holdout import last_repeats
from identify.interval import Interval, number
from identify.model import Backlash, CurvedBacklash, LinearF, Model
from identify.natural_units import shown
from identify.noise import Noise
from identify.observe import Observation, pooled_rms
from identify.stepping import settled
from identify.trace import Array
from identify.uncertainty.inflation import inflation
from identify.uncertainty.normalised import scale_of
from identify.uncertainty.propagation import propagated

Form = Literal["straight", "curved"]
"""What the borders are asked to be."""

ALONG = 60  # places along a border for its picture and its straight line


@dataclass(frozen=True)
class CurvePoint:
    """One point of a border: v in V, and w in V with its interval."""

    v_v: float
    w_v: Interval

    def to_dict(self) -> dict[str, object]:
        """Return the form of JSON answers."""
        return {"v_V": number(self.v_v), "w_V": self.w_v.to_dict()}


Curves = dict[str, tuple[CurvePoint, ...]]
"""The points of L and of U."""


@dataclass(frozen=True)
class HeldOut:
    """What straight and bent borders leave on repeats that neither was fitted to, and the noise, V rms."""

    straight_v: float
    bent_v: float
    noise_v: float


@dataclass(frozen=True)
class Bend:
    """The borders as curves in the scale of the rig file, at their knots and along them, and what speaks for a bend.

    ``normalised`` has the knots in the paper's scale. ``taken``: the model has the bent borders. ``orders`` is empty
    where nothing was compared because the rig file's own borders are bent.
    """

    curves: Curves
    along: Curves
    normalised: Curves
    taken: bool
    orders: tuple[Order, ...] = ()
    chosen: Order | None = None
    held_out: HeldOut | None = None

    @property
    def sentence(self) -> str:
        """Return the verdict on the bend."""
        if self.chosen is None:
            return f"The borders are curves through {len(self.curves['L'])} and {len(self.curves['U'])} points."
        gain, more = self.orders[0].schwarz - self.chosen.schwarz, self.chosen.parameters - self.orders[0].parameters
        cost = f"{self.chosen.knots} knots to a border, {more} more parameters"
        if gain > 0.0:
            return f"The borders are bent: {cost} pay, Schwarz's criterion falls by {gain:.4g}.{self._proof()}"
        asked = " They are bent as asked for, all the same." if self.taken else ""
        return f"Straight borders suffice: {cost} do not pay, Schwarz's criterion rises by {-gain:.4g}." \
               f"{self._proof()}{asked}"

    def _proof(self) -> str:
        if self.held_out is None:
            return " No repeat was there to be held out."
        h = self.held_out
        return f" On held-out repeats straight borders leave {shown(h.straight_v, 'V')}, bent ones " \
               f"{shown(h.bent_v, 'V')}, the noise is {shown(h.noise_v, 'V')}."

    def to_dict(self) -> dict[str, object]:
        """Return the form of JSON answers, less the curves."""
        held = self.held_out
        return {
            "taken": self.taken, "sentence": self.sentence, "knots": self.chosen.knots if self.chosen else None,
            "orders": [
                {"knots": o.knots, "parameters": o.parameters, "chi_squared": number(o.chi_squared, 9),
                 "akaike": number(o.akaike, 9), "schwarz": number(o.schwarz, 9)} for o in self.orders
            ],
            "held_out": held and {"straight_V": number(held.straight_v), "bent_V": number(held.bent_v),
                                  "noise_V": number(held.noise_v)},
        }  # fmt: skip


def curves_dict(curves: Curves) -> dict[str, object]:
    """Return curves in the form of JSON answers."""
    return {side: [point.to_dict() for point in points] for side, points in curves.items()}


def bend_of(found: Fit, wider: float, taken: bool = True) -> Bend:
    """Return the borders of a fit with bent ones, and their 95 % intervals from deviations taken ``wider`` times."""
    knots: Curves = {}
    along: Curves = {}
    normalised: Curves = {}
    for at, (side, border) in enumerate(zip(SIDES, borders_of(found.chain), strict=True)):
        v = border.knots
        knots[side] = _points(found, at, v, wider)
        along[side] = _points(found, at, np.linspace(v[0], v[-1], ALONG), wider)
        normalised |= _normalised(found, at, wider)
    return Bend(knots, along, normalised, taken)


def _points(found: Fit, at: int, v: Array, wider: float) -> tuple[CurvePoint, ...]:
    """Return one border at ``v``."""
    intervals = propagated(found, lambda chain: borders_of(chain)[at].at(v)).intervals(wider)
    return tuple(CurvePoint(float(a), w) for a, w in zip(v, intervals, strict=True))


def _normalised(found: Fit, at: int, wider: float) -> Curves:
    """Return the knots of one border in the paper's scale, with the doubt of V_p in them.

    A negative V_p turns v around: what is the loading border there is the unloading one here.
    """
    scale = scale_of(found)
    v = borders_of(found.chain)[at].knots / scale.v_p(found.chain)

    def law(chain: Chain) -> Array:
        return scale.g2_gain * borders_of(chain)[at].at(scale.v_p(chain) * v)

    turned = scale.v_p(found.chain) < 0.0
    points = [CurvePoint(float(a), w) for a, w in zip(v, propagated(found, law).intervals(wider), strict=True)]
    return {tuple(SIDES)[1 - at if turned else at]: tuple(reversed(points) if turned else points)}


def bending(
    model: Model, straight: Fit, observations: tuple[Observation, ...], noise: Noise, knots: int | None = None
) -> tuple[tuple[Observation, ...], Fit, Bend]:
    """Bend the borders of a straight fit: return the observations as they were last fitted, the fit to go by, the bend.

    The bent fit is the one to go by when it pays, or when a number of ``knots`` was asked for.
    """
    found = orders(straight, observations, model.fixed, knots)
    finer, bent = settled(found.bent, observations, model.fixed)
    found = replace(found, bent=bent)
    bend = bend_of(found.bent, inflation(found.bent.chain, finer, noise.freedom), taken=found.pays or knots is not None)
    told = replace(bend, orders=found.tried, chosen=found.chosen, held_out=_held_out(found, finer, model.fixed))
    return (finer, found.bent, told) if bend.taken else (observations, straight, told)


def _held_out(found: Orders, observations: Sequence[Observation], fixed: Sequence[str]) -> HeldOut | None:
    """Return how both kinds of borders do on the last repeats when fitted to all else; None without repeats."""
    kept = [last_repeats(o.trace) for o in observations]
    train = [p for p in (replace(o, use=o.use & ~k) for o, k in zip(observations, kept, strict=True)) if p.count]
    test = [p for p in (replace(o, use=o.use & k) for o, k in zip(observations, kept, strict=True)) if p.count]
    if not (train and test):
        return None
    left = [
        pooled_rms(piece for o in test for piece in o.misfits(again.chain))
        for again in (fit(f.chain, train, centre_of(f, f.chain), fixed) for f in (found.straight, found.bent))
    ]
    return HeldOut(left[0], left[1], test[0].noise_v)


def in_form(model: Model, borders: Form | None) -> Model:
    """Return the model with straight borders to start from where ``borders`` names a form; None leaves it as it is.

    Raises ValueError where bent borders are asked for and F has none, or the rig file holds them.
    """
    if borders == "curved" and isinstance(model.f, LinearF):
        raise ValueError("F is linear in the rig file: without a backlash there are no borders to bend")
    if borders == "curved" and any(name.partition(".")[0] == "F" for name in model.fixed):
        raise ValueError("the rig file holds F or part of it under `fixed:`, so its borders cannot be bent")
    if borders is None or not isinstance(model.f, CurvedBacklash):
        return model
    return replace(model, f=_straightened(model.f))


def _straightened(f: CurvedBacklash) -> Backlash:
    """Return the straight borders nearest to bent ones."""
    stage = CurvedPlay(f)
    names = [p.name for p in stage.parameters()]
    return Backlash(*straight_lines(Chain((stage,), dict(zip(names, stage.start_values(), strict=True)))).tolist())

