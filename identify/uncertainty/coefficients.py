"""Which numbers is a model made of, by name: the values a covariance speaks of and a rig file holds?"""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

from identify.effects import owners
from identify.model import Backlash, CurvedBacklash, LinearF, Model, NonlinearF, Physics, Rational


def coefficients(model: Model) -> dict[str, float]:
    """Return every number of a model that a fit may move.

    Blocks are told by the coefficients of s, s^2, ... with constant terms of one, ``G1.den.s2``; their DC gains are
    assumed, not fitted. Physics go by ``id.value``; what is at
    a second place by ``id@stage.value``.
    """
    found: dict[str, float] = {}
    for name, block in (("G1", model.g1), ("G2", model.g2)):
        found |= {f"{name}.num.s{k}": b / block.num[-1] for k, b in _powers(block.num)}
        found |= {f"{name}.den.s{k}": a / block.den[-1] for k, a in _powers(block.den)}
        found[f"{name}.dead_time"] = block.dead_time_s
    found |= _of_f(model.f)
    for owner, piece in zip(owners(model.physics), model.physics, strict=True):
        found |= {f"{owner}.{name}": value for name, value in piece.values.items()}
    return found


def with_coefficients(model: Model, values: Mapping[str, float]) -> Model:
    """Return the model with some of its numbers replaced."""
    numbers = {**coefficients(model), **values}
    return replace(
        model, g1=_block(model.g1, "G1", numbers), g2=_block(model.g2, "G2", numbers),
        f=_f(model.f, numbers),
        physics=tuple(map(partial(_piece, numbers), owners(model.physics), model.physics)),
    )  # fmt: skip


def _of_f(f: NonlinearF | LinearF) -> dict[str, float]:
    """Return the values of F; a bent border by its levels ``F.loading.w1`` at the points it is given by."""
    if isinstance(f, LinearF):
        return {"F.gain": f.gain, "F.offset": f.offset_v}
    if isinstance(f, Backlash):
        return {"F.S_L": f.s_l, "F.D_L": f.d_l_v, "F.S_U": f.s_u, "F.D_U": f.d_u_v}
    sides = (("loading", f.loading), ("unloading", f.unloading))
    return {f"F.{side}.w{k}": w for side, points in sides for k, (_, w) in enumerate(points, start=1)}


def _f(f: NonlinearF | LinearF, numbers: Mapping[str, float]) -> NonlinearF | LinearF:
    values = [numbers[name] for name in _of_f(f)]
    if isinstance(f, LinearF):
        return LinearF(*values)
    if isinstance(f, Backlash):
        return Backlash(*values)
    levels = iter(values)
    loading, unloading = (tuple((v, next(levels)) for v, _ in side) for side in (f.loading, f.unloading))
    return CurvedBacklash(loading, unloading)


def _powers(side: tuple[float, ...]) -> list[tuple[int, float]]:
    """Return the coefficients of s and its powers, without the constant term."""
    return [(len(side) - 1 - i, value) for i, value in enumerate(side[:-1])]


def _block(block: Rational, name: str, numbers: Mapping[str, float]) -> Rational:
    sides = {}
    for side, old in (("num", block.num), ("den", block.den)):
        moved = [old[-1] * numbers[f"{name}.{side}.s{k}"] for k, _ in _powers(old)]
        sides[side] = (*moved, old[-1])
    return Rational(sides["num"], sides["den"], numbers[f"{name}.dead_time"])


def _piece(numbers: Mapping[str, float], owner: str, piece: Physics) -> Physics:
    return replace(piece, values={name: numbers[f"{owner}.{name}"] for name in piece.values})
