"""What a rig is made of: G1, F, G2, noise, and the physics added to them, as plain data."""

from dataclasses import dataclass, field, replace


@dataclass(frozen=True)
class Rational:
    """A linear block num(s)/den(s) exp(-s dead_time_s); coefficients in descending powers of s (paper eq. 46)."""

    num: tuple[float, ...]
    den: tuple[float, ...]
    dead_time_s: float = 0.0

    @property
    def dc_gain(self) -> float:
        """Return G(0), dimensionless."""
        return self.num[-1] / self.den[-1]


@dataclass(frozen=True)
class Backlash:
    """The play operator of eqs. (6)-(7): slopes in V/V, crossings of the v axis in V.

    ``tied``: one slope by construction, s_u = s_l. Where the two slopes are merely the same numbers, each is a start.
    """

    s_l: float
    d_l_v: float
    s_u: float
    d_u_v: float
    tied: bool = field(default=False, kw_only=True)

    def widened(self, times: float) -> "Backlash":
        """Return borders of the same middle, so many times as far apart."""
        more = 0.5 * (times - 1.0) * (self.d_l_v - self.d_u_v)
        return replace(self, d_l_v=self.d_l_v + more, d_u_v=self.d_u_v - more)


Points = tuple[tuple[float, float], ...]
"""Pairs (v, w) in V, rising in both."""


@dataclass(frozen=True)
class CurvedBacklash:
    """The play operator of eq. (7) between borders of any rising shape, each a monotone cubic through its points.

    ``loading`` bounds w from below, ``unloading`` from above; beyond its first and last point a border is straight.
    """

    loading: Points
    unloading: Points


NonlinearF = Backlash | CurvedBacklash


@dataclass(frozen=True)
class LinearF:
    """F without memory: w = gain * v + offset_v."""

    gain: float = 1.0
    offset_v: float = 0.0


@dataclass(frozen=True)
class Physics:
    """One piece of physics beyond the plain model, with its values in the units its effect declares.

    ``stage`` and ``form`` choose among the places and the laws an effect knows; empty means its first.
    """

    id: str
    values: dict[str, float]
    stage: str = ""
    form: str = ""


@dataclass(frozen=True)
class Model:
    """The signal path source -> G1 -> F -> G2 -> sense; ``fixed`` lists parameter names that are not refitted.

    ``unknown`` lists what has no values yet (G1, F, G2, G2.dead_time, and G2.gain where its sign is open): the numbers
    given for it only tell the orders.
    """

    title: str
    g1: Rational
    f: NonlinearF | LinearF
    g2: Rational
    noise_v: float | None = None
    fixed: tuple[str, ...] = ()
    physics: tuple[Physics, ...] = field(default=())
    unknown: tuple[str, ...] = ()


@dataclass(frozen=True)
class Doubt:
    """How sure the values of a model are: the covariance of ``names`` (identify.uncertainty.coefficients), SI units."""

    names: tuple[str, ...]
    matrix: tuple[tuple[float, ...], ...]
