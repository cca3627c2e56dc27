"""How far does noise in front of a gap carry the level with it, on the average?

A border that shakes pushes w to the highest place it reaches, and w does not come back: on a plateau the mean of w is
that of the highest value the noise has had, which grows with time (E. J. Gumbel, Statistics of Extremes, 1958). A
border that runs on leaves behind what it pushed. The mean is followed by one number, the time in which a border at rest
pushes as far as w stands: exact at rest and where the border runs fast. Where it runs on evenly w rests above it.
"""

from collections.abc import Callable
from functools import cache, lru_cache
from typing import Literal

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.linalg import eigh_tridiagonal
from scipy.special import log_ndtr

from identify.trace import Array

Kind = Literal["white", "low-pass"]

Shaken = tuple[Array, Array, float, float]

HIGHEST = 6.0  # sd: further from w a border does not reach it
PER_Z, PER_AGE = 160.0, 160.0  # entries of the tables to a unit
YOUNGEST, OLDEST = -12.0, 22.0  # log of time: in the first nothing is pushed yet, in the last more than ``HIGHEST``
BROWNIAN = -3.0  # log of time up to which a low-passed noise is Brownian motion, to a hundredth
SPEEDS = 512  # entries of the table of rests
DEEPEST, NODES = -7.0, 160  # of the grid on which a low-passed noise moves, sd
LEVELS = np.concatenate((np.arange(-3.0, 6.6, 0.2), [7.0]))  # between which the chance of a push is interpolated


def renewal(kind: Kind, bandwidth_hz: float, step_s: float) -> float:
    """Return how far a noise is renewed in a step, in the unit of time of its kind."""
    return (1.0 if kind == "white" else 2.0 * np.pi) * bandwidth_hz * step_s


def shaken(kind: Kind, renewed: float) -> Shaken:
    """Return what ``noisy_plays`` asks of a noise that is ``renewed`` in a step: gains of half of it, and rests."""
    return gains(kind, 0.5 * renewed), rests(kind), PER_Z, renewed


@cache
def rests(kind: Kind) -> Array:
    """Return how high w rests above a border that runs on towards it, in sd / ``PER_Z``, shape (SPEEDS,), read-only.

    It gains there in a time what the border runs. Speeds x^4 / (1 - x)^4, in sd a unit of time, x even in [0, 1).
    """
    ages, heights = _heights(kind)
    rate = np.gradient(heights, ages) * np.exp(-ages)
    x = np.arange(SPEEDS) / SPEEDS
    found = PER_Z * np.interp((x / (1.0 - x)) ** 4, np.maximum.accumulate(rate[::-1]), heights[::-1])
    found.flags.writeable = False
    return found


@lru_cache(maxsize=64)
def gains(kind: Kind, later: float) -> Array:
    """Return how much the mean height of w above a border gains in a time, from heights 0, 1, 2 ... in sd / ``PER_Z``.

    ``later`` is counted in 1 / bandwidth for noise white up to there, in 1 / (2 pi bandwidth) for noise behind a
    first-order low-pass. Shape (N,), read-only; from beyond the last height nothing is gained.
    """
    ages, heights = _heights(kind)
    levels = np.arange(round(HIGHEST * PER_Z)) / PER_Z
    age = np.interp(levels, heights, ages)
    older = age + np.log1p(later * np.exp(-age))
    gained = np.append(PER_Z * (np.interp(older, ages, heights) - np.interp(age, ages, heights)), 0.0)
    gained.flags.writeable = False
    return gained


@cache
def _heights(kind: Kind) -> tuple[Array, Array]:
    """Return log of time, and the mean height pushed to by then."""
    law: dict[Kind, Callable[[Array], Array]] = {"white": highest_of_white, "low-pass": highest_of_low_passed}
    few = np.arange(YOUNGEST, OLDEST + 0.2, 0.2)
    ages = np.arange(YOUNGEST, OLDEST, 1.0 / PER_AGE)
    return ages, PchipInterpolator(few, law[kind](np.exp(few)))(ages)


def highest_of_white(times: Array) -> Array:
    """Return the mean highest of a normal noise, white up to a bandwidth, over ``times`` in 1 / bandwidth, in its sd.

    A level z is passed upward bandwidth / sqrt(3) exp(-z^2 / 2) times a second (S. O. Rice, Bell Syst. Tech. J. 24
    (1945) 46, section 3.3), counted here in the time that is spent below it, as passings come one by one from there.
    """
    z = np.linspace(-9.0, 9.0, 1801)
    below = log_ndtr(z)
    passed = np.exp(-0.5 * np.square(z) - below) / np.sqrt(3.0)
    return np.asarray(z[-1] - np.trapezoid(np.exp(below - times[:, None] * passed), z, axis=1))


def highest_of_low_passed(times: Array) -> Array:
    """Return the mean highest of dX = -X dt + sqrt(2) dW over ``times``, from its stationary normal distribution.

    It is the integral over levels of the chance to have passed them. At first it is that of Brownian motion, sqrt(4 t /
    pi): the grid of levels is too coarse for that.
    """
    below = np.array([_not_passed(level, times) for level in LEVELS])
    z = np.arange(LEVELS[0], LEVELS[-1], 0.02)
    logs = np.log(np.maximum(below, 1e-300))
    smooth = np.exp([np.interp(z, LEVELS, row) for row in logs.T])
    late = z[-1] - np.trapezoid(smooth, z, axis=1)
    return np.where(times < np.exp(BROWNIAN), np.sqrt(4.0 * times / np.pi), late)


def _not_passed(level: float, times: Array) -> Array:
    """Return the chance that X stays below a level for each of ``times``.

    X is taken to hop between neighbours of a grid at rates that keep its distribution, which makes the smallest rate of
    passing as accurate as the others; the chance is a sum over the modes of hopping with the level as its end.
    """
    y = np.linspace(DEEPEST, level, NODES, endpoint=False)
    step = level - y[-1]
    weights = np.exp(-0.5 * np.square(y)) * step / np.sqrt(2.0 * np.pi)
    away = np.exp(-0.5 * step * (y + 0.5 * step)) + np.exp(0.5 * step * (y - 0.5 * step))
    rates, modes = eigh_tridiagonal(away / step**2, np.full(NODES - 1, -(step**-2.0)))
    shares = np.square(modes.T @ np.sqrt(weights))
    return np.asarray(shares @ np.exp(-np.outer(np.maximum(rates, 0.0), times)))
