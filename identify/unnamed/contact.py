"""Which free-form laws change how contact is made: one that sticks, gives way, kicks, rings, is struck?"""

from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from identify import contact_kernels
from identify.blocks import run_play
from identify.stage import Block, Grid, Place, Run, Values
from identify.trace import Array
from identify.unnamed.correction import PlayCorrection
from identify.unnamed.maps import RATES


@dataclass(frozen=True)
class Contact(PlayCorrection):
    """A contact of another kind: the difference that plays of it make, one for every knot, each times a weight."""

    curved = False
    least = 1
    single = True

    def played(self, borders: Values, values: Values, grid: Grid) -> Run:
        """Return the operator with a share of every one of another contact."""
        plain = run_play(borders)
        used = [
            (weight, self.of(knot, borders, grid)) for weight, knot in zip(values, self.knots, strict=True) if weight
        ]

        def run(block: Block) -> Array:
            w = plain(block)
            return np.asarray(w + sum(weight * (other(block) - w) for weight, other in used))

        return run

    @abstractmethod
    def of(self, knot: float, borders: Values, grid: Grid) -> Run:
        """Return the operator of one such contact alone."""


@dataclass(frozen=True)
class Sticking(Contact):
    """A contact that sticks once it rested, and jumps when it is pushed farther than a knot past a border."""

    form = "stick and slip"
    kind = "a contact that sticks and slips"
    equation = "w' = w + sum of a_k (S_k - w), S_k the play that breaks loose r_k past a border"
    knot_unit = "V"
    weights = (("stick", "V/V"),)

    def of(self, knot: float, borders: Values, grid: Grid) -> Run:
        """Return the operator that breaks loose ``knot`` V past a border."""
        s_l, d_l, s_u, d_u = borders
        level, slides = 0.0, False

        def run(block: Block) -> Array:
            nonlocal level, slides
            out = np.empty_like(block.signal)
            level, slides = contact_kernels.sticking_play(s_l, d_l, s_u, d_u, knot, level, slides, block.signal, out)
            return out

        return run


@dataclass(frozen=True)
class Giving(Contact):
    """A contact that gives way: in contact w follows its border through a lag, a knot, in the gap it stays.

    So does a capacitor that holds and is charged through a resistance.
    """

    form = "contact that gives way"
    kind = "a contact that follows late"
    equation = "w' = w + sum of a_k (C_k - w), tau_k dC_k/dt = border - C_k where that moves C_k away from the other"
    quick = True
    knot_unit = "s"
    weights = (("give", "V/V"),)

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return RATES[Place.F]

    def of(self, knot: float, borders: Values, grid: Grid) -> Run:
        """Return the operator whose contact lags by ``knot`` s."""
        state: tuple[float, float, float] | None = None

        def run(block: Block) -> Array:
            nonlocal state
            lower, upper = _followed(borders, block.signal)
            start = (float(lower[0]), float(upper[0]), 0.0) if state is None else state
            state = contact_kernels.giving_play(lower, upper, grid.step_s / knot, start, lower)
            return np.asarray(lower)

        return run


def _followed(borders: Values, v: Array) -> tuple[Array, Array]:
    """Return the levels of w on the borders S_L, D_L and S_U, D_U, V, shape (N,) each."""
    s_l, d_l, s_u, d_u = borders
    return s_l * (v - d_l), s_u * (v - d_u)


@dataclass(frozen=True)
class Kicking(PlayCorrection):
    """A contact that kicks w away as it opens: the charge of a switch that lets go of a capacitor, say.

    A kick towards the border that w leaves is none: that border is in its way.
    """

    form = "kick at opening"
    kind = "a contact that kicks as it opens"
    equation = "w jumps up by c_L(w) as it leaves border L, down by c_U(w) as it leaves U, straight between the knots"
    knot_unit = "V"
    weights = (("L", "V"), ("U", "V"))

    @property
    def nearly_at(self) -> tuple[Place, ...]:
        """Return G1: what pushes v as it turns pushes w."""
        return (Place.G1,)

    def played(self, borders: Values, values: Values, grid: Grid) -> Run:
        """Return the operator whose contacts kick."""
        at, kicks = np.array(self.knots), np.array(self.split(values))
        state = 0.0, -1

        def run(block: Block) -> Array:
            nonlocal state
            lower, upper = _followed(borders, block.signal)
            state = contact_kernels.kicking_play(lower, upper, at, kicks, state, lower)
            return np.asarray(lower)

        return run


@dataclass(frozen=True)
class AfterContact(PlayCorrection):
    """What goes on once contact is made, whatever v does meanwhile: it rings, or bounces, or creeps home."""

    form = "after contact"
    kind = "something that goes on after contact is made"
    equation = "w' = w + c(t) after contact with border L, w - c(t) after that with U, t since then, straight between"
    quick = True
    knot_unit = "s"
    weights: ClassVar[tuple[tuple[str, str], ...]] = (("after", "V"),)

    def played(self, borders: Values, values: Values, grid: Grid) -> Run:
        """Return the operator with what goes on after contact."""
        after = self.split(values)
        state = 0.0, -1, 0.0

        def run(block: Block) -> Array:
            nonlocal state
            (lower, upper), since = _followed(borders, block.signal), np.empty_like(block.signal)
            state = contact_kernels.timed_play(lower, upper, state, since, lower)
            ago_s = (np.abs(since) - 1.0) * grid.step_s
            for sign, each in ((1.0, after[0]), (-1.0, after[-1])):
                lower += sign * np.where(sign * since > 0.0, np.interp(ago_s, self.knots, each), 0.0)
            return np.asarray(lower)

        return run


@dataclass(frozen=True)
class AfterEither(AfterContact):
    """The same, by a law of its own on either side: one contact of two that is loose, say."""

    form = "after either contact"
    equation = "w' = w + c_L(t) after contact with border L, w - c_U(t) after that with U, t since then"
    weights = (("L", "V"), ("U", "V"))


@dataclass(frozen=True)
class AfterImpact(AfterContact):
    """The same, in proportion to how fast contact is made: what strikes harder rings and bounces more, and what closes
    late has farther to go.
    """

    form = "after impact"
    kind = "something that goes on after contact is made, the more the faster"
    equation = "w' = w + |dw/dt| c(t) after contact with border L, less it after that with U, t since, dw/dt then"
    weights = (("after", "s"),)

    def played(self, borders: Values, values: Values, grid: Grid) -> Run:
        """Return the operator with what goes on after contact, as fast as that was made."""
        knots, after = np.array(self.knots), np.array(self.split(values)[0])
        state, struck = (0.0, -1, 0.0), None

        def run(block: Block) -> Array:
            nonlocal state, struck
            v, since = block.signal, np.empty_like(block.signal)
            lower, upper = _followed(borders, v)
            state = contact_kernels.timed_play(lower, upper, state, since, lower)
            slopes, before = (borders[0], borders[2]), struck or (float(v[0]), 0.0)
            struck = contact_kernels.struck(since, v, slopes, grid.step_s, knots, after, before, lower)
            return lower

        return run
