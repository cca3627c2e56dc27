"""How does the rig move between two samples? Every stage on a grid of sub-steps, first principles only.

A signal is an array at the nodes of the grid: node n is at n * step_s after the start of the run, shape (nodes,).
The linear blocks are stepped by the implicit trapezoidal rule: it is A-stable, so the poles of the op-amp rig at
-2e5 and -2e6 rad/s (half a sub-step or less) need no special care, and its error on the slow poles is (p h)^2 / 12.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
Coefficients = tuple[float, ...]


@dataclass(frozen=True)
class Grid:
    """The sub-steps of one run: ``samples`` DAC updates of ``substeps`` sub-steps, from ``start_s`` on the clock."""

    rate_hz: float
    samples: int
    substeps: int
    start_s: float = 0.0

    @property
    def step_s(self) -> float:
        """Return the length of a sub-step."""
        return 1.0 / (self.rate_hz * self.substeps)

    @property
    def run_s(self) -> Array:
        """Return the time of every node since the start of the run, shape (samples * substeps + 1,)."""
        return np.arange(self.samples * self.substeps + 1) * self.step_s

    @property
    def sample_s(self) -> Array:
        """Return the time of every reading since the start of the run, shape (samples,)."""
        return np.arange(self.samples) / self.rate_hz


def held(u: Array, grid: Grid) -> Array:
    """Return the mean drive of every sub-step under a DAC that holds u[k] over [t[k], t[k+1])."""
    return np.repeat(u, grid.substeps)


def between(nodes: Array) -> Array:
    """Return the mean drive of every sub-step of a continuous signal given at the nodes."""
    return 0.5 * (nodes[1:] + nodes[:-1])


def linear_block(drive: Array, num: Coefficients, den: Coefficients, step_s: float, rest: float = 0.0) -> Array:
    """Return the output at the nodes of num(s)/den(s), descending powers, that was settled under the drive ``rest``.

    ``drive`` is the mean input of every sub-step, shape (nodes - 1,). Raises ValueError unless num/den is strictly
    proper: an output that jumps has no single value at a node.
    """
    if len(num) >= len(den):
        raise ValueError(f"the block {num}/{den} is not strictly proper; the integrator needs a continuous output")
    system, inlet, outlet = _companion(num, den, step_s)
    half = np.eye(len(den) - 1) - 0.5 * system
    advance = np.linalg.solve(half, np.eye(len(den) - 1) + 0.5 * system)
    push = np.linalg.solve(half, inlet)
    settled = -np.linalg.solve(system, inlet) * rest
    return _trapezoid(drive, advance, push, outlet, settled)


def _companion(num: Coefficients, den: Coefficients, step_s: float) -> tuple[Array, Array, Array]:
    """Return A, b, c of the controllable form in units of the sub-step, where all entries are of order one."""
    order = len(den) - 1
    powers = np.arange(order, -1, -1)
    scaled = np.asarray(den, dtype=float) / step_s**powers
    padded = np.concatenate([np.zeros(order - len(num)), np.asarray(num, dtype=float)]) / step_s ** powers[1:]
    system = np.diag(np.ones(order - 1), 1)
    system[-1] = -scaled[:0:-1] / scaled[0]
    inlet = np.zeros(order)
    inlet[-1] = 1.0
    return system, inlet, padded[::-1] / scaled[0]


@njit(cache=True)
def _trapezoid(drive, advance, push, outlet, settled):  # type: ignore[no-untyped-def]  # compiled
    order = outlet.size
    state = settled.copy()
    following = np.empty(order)
    out = np.empty(drive.size + 1)
    out[0] = np.dot(outlet, state)
    for n in range(drive.size):
        for i in range(order):
            total = push[i] * drive[n]
            for j in range(order):
                total += advance[i, j] * state[j]
            following[i] = total
        level = 0.0
        for i in range(order):
            state[i] = following[i]
            level += outlet[i] * state[i]
        out[n + 1] = level
    return out


@njit(cache=True)
def play(lower, upper, start_v, keep, climb_v):  # type: ignore[no-untyped-def]  # compiled
    """Return w of a play between the borders lower(t) <= w <= upper(t), both at the nodes, shape (nodes,).

    Between the borders a hold capacitor carries w: in a sub-step it keeps the fraction ``keep`` and gains ``climb_v``
    (1 and 0 for the ideal operator); the borders hold it at every node. ``start_v`` is w before the run.
    """
    w = np.empty(lower.size)
    level = start_v
    for n in range(lower.size):
        if n > 0:
            level = level * keep + climb_v
        level = min(max(level, lower[n]), upper[n])
        w[n] = level
    return w


@njit(cache=True)
def leaning_play(lower, upper, target, follow):  # type: ignore[no-untyped-def]  # compiled
    """Return w of a play from rest that on a plateau runs towards ``target`` by the share ``follow`` a sub-step."""
    w = np.empty(lower.size)
    level = 0.0
    for n in range(lower.size):
        if n > 0:
            level += follow * (0.5 * (target[n - 1] + target[n]) - level)
        level = min(max(level, lower[n]), upper[n])
        w[n] = level
    return w


@njit(cache=True)
def absorbing_play(lower, upper, fraction, follow):  # type: ignore[no-untyped-def]  # compiled
    """Return w of a play from rest whose hold capacitor has a dielectric that takes ``follow`` of w - q a sub-step.

    On a plateau what it takes is missing from w, ``fraction`` times; on a border the source makes up for it.
    """
    w = np.empty(lower.size)
    level, absorbed = 0.0, 0.0
    for n in range(lower.size):
        taken = follow * (level - absorbed)
        absorbed += taken
        level = min(max(level - fraction * taken, lower[n]), upper[n])
        w[n] = level
    return w


@njit
def slewing(signal, rate, lag, step_s):  # type: ignore[no-untyped-def]  # compiled
    """Follow a signal by dw/dt = rate tanh((signal - w) / (rate lag)), by steps of Runge and Kutta's, from rest."""
    out, level, before = np.empty_like(signal), 0.0, 0.0
    for k in range(signal.size):
        middle = 0.5 * (before + signal[k])
        one = rate * np.tanh((before - level) / (rate * lag))
        two = rate * np.tanh((middle - level - 0.5 * step_s * one) / (rate * lag))
        three = rate * np.tanh((middle - level - 0.5 * step_s * two) / (rate * lag))
        four = rate * np.tanh((signal[k] - level - step_s * three) / (rate * lag))
        level += step_s * (one + 2.0 * two + 2.0 * three + four) / 6.0
        before = signal[k]
        out[k] = level
    return out


@njit(cache=True)
def charging(signal, tau, k, step_s):  # type: ignore[no-untyped-def]  # compiled
    """Answer with C (1 - k v^2) where ``signal`` is with C: tau (1 - k v^2) dv/dt = tau ds/dt + s - v, from rest.

    By steps of Runge and Kutta's, the signal straight between the nodes.
    """
    out, level, before = np.empty_like(signal), 0.0, 0.0
    for n in range(signal.size):
        slope, middle = (signal[n] - before) / step_s, 0.5 * (before + signal[n])
        one = (slope + (before - level) / tau) / (1.0 - k * level**2)
        at = level + 0.5 * step_s * one
        two = (slope + (middle - at) / tau) / (1.0 - k * at**2)
        at = level + 0.5 * step_s * two
        three = (slope + (middle - at) / tau) / (1.0 - k * at**2)
        at = level + step_s * three
        four = (slope + (signal[n] - at) / tau) / (1.0 - k * at**2)
        level += step_s * (one + 2.0 * two + 2.0 * three + four) / 6.0
        before = signal[n]
        out[n] = level
    return out


@njit(cache=True)
def slewed(signal, largest_change):  # type: ignore[no-untyped-def]  # compiled
    """Return the signal followed by a stage that moves at most ``largest_change`` a sub-step."""
    out = np.empty(signal.size)
    out[0] = signal[0]
    for n in range(1, signal.size):
        change = min(max(signal[n] - out[n - 1], -largest_change), largest_change)
        out[n] = out[n - 1] + change
    return out


@njit(cache=True)
def soft_play(v, s_l, d_l, s_u, d_u, width, count):  # type: ignore[no-untyped-def]  # compiled
    """Return the mean w of ``count`` plays whose crossings are spread evenly over ``width``, wide with wide."""
    w = np.zeros(v.size)
    for i in range(count):
        shift = width * ((i + 0.5) / count - 0.5)
        level = 0.0
        for n in range(v.size):
            level = min(max(level, s_l * (v[n] - d_l - shift)), s_u * (v[n] - d_u + shift))
            w[n] += level
    return w / count


@njit(cache=True)
def sticking_play(lower, upper, stuck_v):  # type: ignore[no-untyped-def]  # compiled
    """Return w of a play that, once it rested in its gap, must be pushed ``stuck_v`` past a border to break loose."""
    w = np.empty(lower.size)
    level, sliding = 0.0, False
    for n in range(lower.size):
        give = 0.0 if sliding else stuck_v
        if level < lower[n] - give:
            level, sliding = lower[n], True
        elif level > upper[n] + give:
            level, sliding = upper[n], True
        elif lower[n] < level < upper[n]:
            sliding = False
        w[n] = level
    return w


@njit(cache=True)
def diode_play(lower, upper, volts_l, volts_u, steps):  # type: ignore[no-untyped-def]  # compiled
    """Return w that diodes take along: the trapezoidal rule, its equation solved by Newton's method at every node.

    A border ahead of w by e moves it by volts ``steps`` exp(e / volts) from one node to the next.
    """
    w = np.empty(lower.size)
    level, flow = 0.0, 0.0
    for n in range(lower.size):
        before = level + 0.5 * flow
        level = min(max(before, lower[n] - 3.0 * volts_l), upper[n] + 3.0 * volts_u)
        for _ in range(100):
            pushed = steps * np.exp(min((lower[n] - level) / volts_l, 50.0))
            pulled = steps * np.exp(min((level - upper[n]) / volts_u, 50.0))
            flow = volts_l * pushed - volts_u * pulled
            step = (level - before - 0.5 * flow) / (1.0 + 0.5 * (pushed + pulled))
            level -= step
            if abs(step) < 1e-12 * (1.0 + abs(level)):
                break
        w[n] = level
    return w


@njit(cache=True)
def giving_play(lower, upper, steps):  # type: ignore[no-untyped-def]  # compiled
    """Return w of a play that in contact follows its border as a lag of 1 / ``steps`` nodes (implicit Euler)."""
    w = np.empty(lower.size)
    level, share = 0.0, steps / (1.0 + steps)
    for n in range(lower.size):
        level += share * (max(lower[n] - level, 0.0) + min(upper[n] - level, 0.0))
        w[n] = level
    return w


@njit(cache=True)
def kicking_play(lower, upper, kick_v):  # type: ignore[no-untyped-def]  # compiled
    """Return w of a play of which either border kicks w ``kick_v`` away, into the gap, as it leaves it."""
    w = np.empty(lower.size)
    level, touched = 0.0, 0.0
    for n in range(lower.size):
        if level <= lower[n]:
            level, touched = lower[n], 1.0
        elif level >= upper[n]:
            level, touched = upper[n], -1.0
        elif touched != 0.0 and min(level - lower[n], upper[n] - level) > 1e-9:  # rounding opens no contact
            level = min(max(level + touched * kick_v, lower[n]), upper[n])
            touched = 0.0
        w[n] = level
    return w


def read_when(nodes: Array, times_s: Array, step_s: float) -> Array:
    """Return a signal at any times since the start of the run; outside it rests at its first or last value."""
    return np.interp(times_s, np.arange(nodes.size) * step_s, nodes)


def read_at(nodes: Array, grid: Grid, delay_s: float = 0.0) -> Array:
    """Return the readings at the sample times, ``delay_s`` late; before the start the signal rests at its first value.

    A reading between two nodes lies on the line through them; the error is step_s**2 / 8 times the curvature.
    """
    if delay_s == 0.0:
        return nodes[: grid.samples * grid.substeps : grid.substeps].copy()
    return np.interp(grid.sample_s - delay_s, grid.run_s, nodes)
