"""What becomes of the play operator where physics acts inside it?

Several pieces of physics may act at once: each changes the law it is given, and what they leave is run.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from identify import altered_kernels
from identify.blocks import Play
from identify.ratchet import Kind, shaken
from identify.stage import Block, Grid, Parameter, Run, Shape, Values
from identify.trace import Array

# A contact spread over a width is that of plays so much of it apart, with the variance of an even spread.
CONTACTS = ((np.arange(48) + 0.5) / 48 - 0.5) / np.sqrt(1.0 - 1.0 / 48**2)
SHAKEN_CONTACTS = np.array([-0.375, -0.125, 0.125, 0.375])  # the same where noise rounds each of them by itself
ALONE = np.zeros(1)
Hold = tuple[float, float, float, float, float]
Borders = Callable[[Block], tuple[Array, Array]]
DIODE_V_S = 100.0  # speed of v at which w follows right on its border: it is ahead of it below, behind it above


@dataclass(frozen=True)
class Law:
    """How a play moves: its borders, how far they are pushed apart by speed, how they shake, and how w is held.

    ``ripple`` pushes them apart by so many V at the instants of a block. In a step of holding w becomes keep w +
    climb + across s v, s the mean slope; then a charge q that was absorbed takes and gives: w gains ``to_w`` times
    q - w, q loses ``to_q`` times it. ``second`` is the full gap of a second operator in V and its weight. The borders
    are s x + bend[0] x^2 + bend[1] x^3, x = v - d; contact is made evenly over ``spread_v``, or through diodes
    whose current is exponential in ``diode_v``, which are all that rounds it then. ``bypass`` times v goes past it all.
    """

    s_l: float
    d_l_v: float
    s_u: float
    d_u_v: float
    late_s: float = 0.0
    noise_v: float = 0.0
    renewed: float = 0.0  # how far the noise is renewed in a step, in the unit of time of its kind
    kind: Kind = "white"
    ripple: Run | None = None
    keep: float = 1.0
    climb: float = 0.0
    across: float = 0.0
    to_w: float = 0.0
    to_q: float = 0.0
    second: tuple[float, float] | None = None
    bend: tuple[float, float] = (0.0, 0.0)
    spread_v: float = 0.0
    diode_v: float = 0.0
    bypass: float = 0.0

    def operators(self) -> Iterator[tuple[float, "Law"]]:
        """Yield the weight and the law of every gap."""
        if self.second is None:
            yield 1.0, self
            return
        gap_v, weight = self.second
        middle_v = 0.5 * (self.d_l_v + self.d_u_v)
        wider = replace(self, d_l_v=middle_v + 0.5 * gap_v, d_u_v=middle_v - 0.5 * gap_v)
        yield 1.0 - weight, self
        yield weight, wider


class Alteration(ABC):
    """Physics inside the play operator."""

    @abstractmethod
    def parameters(self) -> tuple[Parameter, ...]:
        """Return what can be fitted, in the order ``altered`` takes the values."""

    @abstractmethod
    def altered(self, law: Law, values: Values, grid: Grid) -> Law:
        """Return the law with this physics in it."""


@dataclass(frozen=True)
class AlteredPlay(Play):
    """The play operator with physics inside, in the order it was put in."""

    alterations: tuple[Alteration, ...] = ()

    def parameters(self) -> tuple[Parameter, ...]:
        """Return the borders, then what each alteration has."""
        return (*super().parameters(), *(p for a in self.alterations for p in a.parameters()))

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the running operator, or the sum of two."""
        s_l, d_l, s_u, d_u = values[:4]
        law, at = Law(s_l, d_l, s_u, d_u), 4
        for alteration in self.alterations:
            count = len(alteration.parameters())
            law, at = alteration.altered(law, values[at : at + count], grid), at + count
        parts = [(weight, _operator(part, grid)) for weight, part in law.operators()]
        if law.bypass != 0.0:
            parts.append((law.bypass, lambda block: block.signal))
        if len(parts) == 1:
            return parts[0][1], shape
        return (lambda block: np.asarray(sum(weight * run(block) for weight, run in parts))), shape


def altered(play: Play, alteration: Alteration) -> AlteredPlay:
    """Return a play operator with one more piece of physics inside."""
    before = play.alterations if isinstance(play, AlteredPlay) else ()
    return AlteredPlay(play.start, alterations=(*before, alteration))


def _operator(law: Law, grid: Grid) -> Run:
    """Return one running operator, from w = 0 with nothing absorbed."""
    borders, hold = _borders(law, grid), _holding(law)
    if law.diode_v > 0.0:
        return _through_diodes(law, grid, borders, hold)
    noise = shaken(law.kind, law.renewed) if law.noise_v > 0.0 else None
    contacts = ALONE if law.spread_v == 0.0 else CONTACTS if noise is None else SHAKEN_CONTACTS
    spread = law.spread_v * contacts
    later_l, later_u = law.s_l * spread, law.s_u * spread
    levels, charges = np.zeros(spread.size), np.zeros(spread.size)
    state: tuple[float, float] = (0.0, 0.0) if noise is None else (np.nan, np.nan)

    def run(block: Block) -> Array:
        nonlocal state
        (lower, upper), out = borders(block), np.empty_like(block.signal)
        if noise is not None:
            sd = (abs(law.s_l) * law.noise_v, abs(law.s_u) * law.noise_v)
            state = altered_kernels.noisy_plays(
                lower, upper, later_l, later_u, sd, noise, hold, state, levels, charges, out
            )
        elif law.spread_v > 0.0:
            altered_kernels.plays_abreast(lower, upper, later_l, later_u, hold, levels, charges, out)
        else:
            state = altered_kernels.held_play(lower, upper, hold, state, out)
        return out

    return run


def _through_diodes(law: Law, grid: Grid, borders: Borders, hold: Hold) -> Run:
    """Return one running operator whose borders act through diodes: they alone make contact soft."""
    volts, steps = (abs(law.s_l) * law.diode_v, abs(law.s_u) * law.diode_v), DIODE_V_S * grid.step_s / law.diode_v
    state = (0.0, 0.0, np.nan, np.nan)

    def run(block: Block) -> Array:
        nonlocal state
        (lower, upper), out = borders(block), np.empty_like(block.signal)
        state = altered_kernels.conducting_play(lower, upper, volts, steps, hold, state, out)
        return out

    return run


def _holding(law: Law) -> Hold:
    """Return how w is held, as the kernels take it."""
    past = 0.5 * (law.s_l * law.d_l_v + law.s_u * law.d_u_v)  # from the middle between the borders to s v
    return law.keep, law.climb + law.across * past, law.across, law.to_w, law.to_q


def _borders(law: Law, grid: Grid) -> Borders:
    """Return what makes both borders of a block of v, as far apart as speed and ripple push them."""
    widening = _widening(law.late_s, grid)

    def borders(block: Block) -> tuple[Array, Array]:
        v = block.signal
        apart = widening(v) if law.late_s != 0.0 else 0.0
        apart = apart + law.ripple(block) if law.ripple is not None else apart
        lower = _border(v - apart - law.d_l_v, law.s_l, law.bend)
        return lower, _border(v + apart - law.d_u_v, law.s_u, law.bend)

    return borders


def _border(x: Array, slope: float, bend: tuple[float, float]) -> Array:
    """Return a border at a distance x from where it crosses the v axis."""
    if bend == (0.0, 0.0):
        return slope * x
    return np.asarray(x * (slope + x * (bend[0] + x * bend[1])))


def _widening(late_s: float, grid: Grid) -> Callable[[Array], Array]:
    """Return what makes of v by how many V its speed pushes each border away.

    As ``widened`` has it: behind a block of first order the slope jumps with its input, and what a jump would add to
    it once w, which keeps the most that a border pushed it, would keep. Where v has turned round in between, its speed
    was zero there, and the border stood where v turned: close to the instant before.
    """
    past = np.zeros(0)

    def run(v: Array) -> Array:
        nonlocal past
        known = np.concatenate((past if past.size else np.full(3, v[0]), v))
        past = known[-3:]
        out = np.empty_like(v)
        altered_kernels.widened(late_s / grid.step_s, known, out)
        return out

    return run
