"""What are G1 and G2 at the frequencies played, whatever their form: no orders, no poles, harmonics only (eq. 36)?

All sines are taken together by weighted least squares. The phases are known up to one delay for every set of sines that
have harmonics in common (physics.md 1.1); it is taken from the assumption that G1 is rational without dead time, as the
fit of all runs has it at one frequency of the set. What the sines cannot separate has no number, but a reason.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.harmonic.equations import BORDERS, SAME, Equations, amplitude_v, equations, frequency_of
from identify.harmonic.harmonics import threshold_v
from identify.harmonic.newton import UNTOLD, least_squares, variances
from identify.harmonic.periods import Period
from identify.interval import Interval, number
from identify.model import Backlash, Model
from identify.natural_units import shown
from identify.trace import Array

Matrix = NDArray[np.float64]
WIDEST = 0.2  # standard deviation of a log gain or of a phase in rad beyond which a point is not determined
DIM = 1.0  # the same beyond which noise is no longer the reason
SIGNIFICANT = 3.0  # standard deviations by which slopes differ before their difference may separate anything
EXACT = 1e-9  # relative width of what is known exactly
EVEN = "the backlash makes no even harmonic that stands above the noise; equal slopes make none at all"
INSEPARABLE = (
    "|G1| and |G2| are not separated: one amplitude, and no harmonic of another sine that would tell; a second "
    "amplitude at the sine's frequency, or a sine at 3 times or a third of it, would"
)
NO_DEAD_TIME = "the delay between G1 and G2 is fixed by G1 being rational without dead time"


@dataclass(frozen=True)
class MeasuredPoint:
    """A linear block at one frequency as measured: gain in V/V, phase in rad; None with the reason in ``because``."""

    frequency_hz: float
    gain: Interval | None
    phase_rad: Interval | None
    origin: str
    because: str = ""
    assumed: str = ""

    def to_dict(self) -> dict[str, object]:
        """Return the form of the JSON answer."""
        told = {key: text for key, text in (("because", self.because), ("assumed", self.assumed)) if text}
        return {
            "frequency_hz": number(self.frequency_hz), "gain": self.gain.to_dict() if self.gain else None,
            "phase_rad": self.phase_rad.to_dict() if self.phase_rad else None, "from": self.origin, **told,
        }  # fmt: skip


@dataclass(frozen=True, eq=False)
class Known:
    """What is known before the harmonics are looked at: a model, and how sure its borders and phases of G1 are.

    ``covariance`` (4 + K, 4 + K) belongs to S_L, D_L, S_U, D_U and the phase of G1 at every one of ``phases_hz`` (K,);
    zero where something is known exactly.
    """

    model: Model
    phases_hz: Array
    covariance: Matrix


@dataclass(frozen=True)
class Measured:
    """The points of G1 and G2, and by how much the equations are missed: chi-squared over its degrees of freedom."""

    g1: tuple[MeasuredPoint, ...] = ()
    g2: tuple[MeasuredPoint, ...] = ()
    chi_squared: float = 0.0
    freedom: int = 0


def exactly(model: Model, sines: Sequence[Period]) -> Known:
    """Return a model whose borders, and phases of G1, are taken as exact."""
    at = frequencies_of(sines)
    return Known(model, at, np.zeros((BORDERS + at.size, BORDERS + at.size)))


def frequencies_of(sines: Sequence[Period]) -> Array:
    """Return the frequencies of some sines, Hz, each once."""
    return np.unique([frequency_of(period) for period in sines])


def measured(sines: Sequence[Period], known: Known, wider: float = 1.0) -> Measured:
    """Return G1 at the frequencies of the sines and G2 at their harmonics, with 95 % intervals.

    ``wider`` stretches the intervals where the model as a whole misses the recordings; the misfit of the equations
    themselves stretches them further.
    """
    system, stuck = equations(sines, known.model)
    still = [_stuck(period, known.model) for period in stuck if not _moves(system, frequency_of(period))]
    if not system.sines:
        return Measured(tuple(_ordered(still)))
    anchor = _Anchor.of(system, known)
    x, chi_squared, count = _solved(system, anchor)
    variance = variances(anchor.curvature + _curvature(system, x, known))
    sd = np.sqrt(variance)
    freedom = count - round(float(np.sum(1.0 - variance / UNTOLD**2)))
    stretch = max(wider, np.sqrt(chi_squared / freedom) if freedom > 0 else 1.0)
    one, two = _points(system, x, sd, float(stretch))
    return Measured(tuple(_ordered([*one, *still])), tuple(_ordered([*two, *_missing(system)])), chi_squared, freedom)


@dataclass(frozen=True, eq=False)
class _Anchor:
    """The knowledge of the borders and of one phase of G1 in every set of linked sines, as rows of least squares."""

    rows: Matrix
    at: Array

    @property
    def curvature(self) -> Matrix:
        return np.asarray(self.rows.T @ self.rows)

    def residual(self, x: Array) -> Array:
        return np.asarray(self.rows @ (x - self.at))

    @classmethod
    def of(cls, system: Equations, known: Known) -> "_Anchor":
        """Return the rows: the joint covariance of what is anchored, square root inverted."""
        start = system.start(known.model)
        _, phase1, _, _, f = system.places
        sets = linked(system)
        chosen = [_surest(system.g1_hz, members, known) for members in sets]
        unknowns = [*range(f.start, f.stop), *(phase1.start + i for i, _ in chosen)]
        picked = [*range(BORDERS), *(BORDERS + k for _, k in chosen)]
        covariance = known.covariance[np.ix_(picked, picked)]
        floor = EXACT * np.maximum(np.abs(start[unknowns]), 1e-3)
        whitened = np.linalg.inv(np.linalg.cholesky(covariance + np.diag(floor**2)))
        rows = np.zeros((len(unknowns), start.size))
        rows[:, unknowns] = whitened
        return cls(rows, start)


def _solved(system: Equations, anchor: _Anchor) -> tuple[Array, float, int]:
    """Return the unknowns of least squares, what is left in chi-squared, and the number of rows."""

    def missed(x: Array) -> Array:
        return np.concatenate((system.residual(x), anchor.residual(x)))

    def rows(x: Array) -> Matrix:
        return np.concatenate((system.jacobian(x), anchor.rows))

    x, left = least_squares(missed, rows, anchor.at)
    return x, float(left @ left), left.size


def _surest(g1_hz: Array, members: Sequence[int], known: Known) -> tuple[int, int]:
    """Return the member of a set whose phase tells the delay best, and its place among the known phases."""
    places = [int(np.argmin(np.abs(known.phases_hz - g1_hz[i]))) for i in members]
    spread = [known.covariance[BORDERS + k, BORDERS + k] / g1_hz[i] ** 2 for i, k in zip(members, places, strict=True)]
    best = int(np.argmin(spread))
    return members[best], places[best]


def linked(system: Equations) -> list[list[int]]:
    """Return the frequencies of G1 in sets within which harmonics coincide, by index."""
    sets: list[tuple[set[int], set[int]]] = []
    for sine in system.sines:
        ones, twos = {sine.g1}, set(sine.g2[sine.g2 >= 0].tolist())
        for other in [s for s in sets if s[0] & ones or s[1] & twos]:
            sets.remove(other)
            ones, twos = ones | other[0], twos | other[1]
        sets.append((ones, twos))
    return [sorted(ones) for ones, _ in sets]


def _curvature(system: Equations, x: Array, known: Known) -> Matrix:
    """Return the curvature the data give at the answer.

    Slopes that differ by no more than chance do not separate anything: their curvature is that of equal ones.
    """
    f = system.places[-1]
    s_l, _, s_u, _ = x[f]
    spread = known.covariance[0, 0] + known.covariance[2, 2] - 2.0 * known.covariance[0, 2]
    if abs(s_l - s_u) <= SIGNIFICANT * np.sqrt(max(spread, 0.0)) + 1e-6 * abs(s_l):
        x = x.copy()
        x[[f.start, f.start + 2]] = 0.5 * (s_l + s_u)
    rows = system.jacobian(x)
    return np.asarray(rows.T @ rows)


def _points(system: Equations, x: Array, sd: Array, wider: float) -> tuple[list[MeasuredPoint], list[MeasuredPoint]]:
    """Return the points of G1 and of G2 that the equations hold."""
    gain1, phase1, gain2, phase2, _ = system.places
    one, two = (
        [
            point(f, (x[gain][i], x[phase][i]), (sd[gain][i], sd[phase][i]), "harmonics", wider)
            for i, f in enumerate(frequencies.tolist())
        ]
        for frequencies, gain, phase in ((system.g1_hz, gain1, phase1), (system.g2_hz, gain2, phase2))
    )
    return one, two


def point(
    frequency_hz: float, value: tuple[float, float], sd: tuple[float, float], origin: str, wider: float
) -> MeasuredPoint:
    """Return a point from log gain and phase (rad) and what noise makes of them, ``wider`` for what the model misses.

    A gain or phase whose standard deviation then reaches ``WIDEST`` has no number.
    """
    size, phase = float(np.exp(value[0])), float(np.angle(np.exp(1j * value[1])))
    half, turn = 1.96 * wider * float(sd[0]), 1.96 * wider * float(sd[1])
    known = [wider * s < WIDEST for s in sd]
    gain = Interval(size, size * float(np.exp(-half)), size * float(np.exp(half))) if known[0] else None
    spread = Interval(phase, phase - turn, phase + turn) if known[1] else None
    told = [_why(what, s, wider) for what, s, k in zip(("gain", "phase"), sd, known, strict=True) if not k]
    return MeasuredPoint(frequency_hz, gain, spread, origin, "; ".join(told), NO_DEAD_TIME if spread else "")


def _why(what: str, sd: float, wider: float) -> str:
    """Return why a gain or a phase has no number."""
    if sd < WIDEST:
        return f"the model misses the recordings by {wider:.3g} times the noise, which leaves the {what} open"
    if sd < DIM:
        return f"the {what} hardly stands out of the noise: its standard deviation is {sd:.2g}"
    return INSEPARABLE if what == "gain" else "the phase hangs on that gain, or on a delay that nothing tells"


def _moves(system: Equations, frequency_hz: float) -> bool:
    """Return whether another sine at this frequency moves F."""
    return bool(np.any(np.abs(system.g1_hz - frequency_hz) < SAME * frequency_hz))


def _stuck(period: Period, model: Model) -> MeasuredPoint:
    """Return the point of a sine that never crosses the gap, with the amplitude that would."""
    assert isinstance(model.f, Backlash)
    played = float(abs(period.drive(period.played)[0]))
    level = model.g1.dc_gain * period.mean_u_v
    needed = threshold_v(replace(model.f, d_l_v=model.f.d_l_v - level, d_u_v=model.f.d_u_v - level))
    raised = played * needed / amplitude_v(period, model)
    return MeasuredPoint(
        frequency_of(period), None, None, "harmonics",
        f"the gap is stuck at U = {shown(played, 'V', 3)}, the output does not move; raise it above "
        f"{shown(raised, 'V', 3)}",
    )  # fmt: skip


def _missing(system: Equations) -> list[MeasuredPoint]:
    """Return the harmonics between those used that nothing tells of, with the reason."""
    found: dict[float, MeasuredPoint] = {}
    for sine in system.sines:
        for n in range(1, int(sine.orders[-1])):
            f = n * sine.frequency_hz
            if np.min(np.abs(system.g2_hz - f)) > SAME * f:
                because = f"harmonic {n} of {sine.name}: {EVEN if n % 2 == 0 else 'below the noise'}"
                found[round(f, 9)] = MeasuredPoint(f, None, None, "harmonics", because)
    return list(found.values())


def _ordered(points: Sequence[MeasuredPoint]) -> list[MeasuredPoint]:
    return sorted(points, key=lambda point: point.frequency_hz)

