"""Which rig does chance put on the bench, what is played to it, and what does its rig file wrongly say?

Times are counted in the slowest time constant of the rig, ``SLOWEST_S``. Nothing here knows the product.
"""

from dataclasses import dataclass, replace

import numpy as np

from tests.proof.integrator import Array, Grid, between, held, linear_block, play, read_at
from tests.proof.stimuli import Segment, Stimulus

SLOWEST_S = 0.02
RATE_HZ = 40.0 / SLOWEST_S  # the fastest pole drawn is 15 times the slowest
SUBSTEPS = 64  # of a sample
THIRD = 1.0 / 3.0
OFF = 0.3  # every value of the rig file is off by this share, up or down by the toss of a coin
MOST = 10.0  # amplitude of a sine, in peaks of the staircase
SINES = (0.15, 0.5, 1.5, 4.0)  # angular frequencies played, in 1 / SLOWEST_S
LINES = (1, 2, 3, 5, 7, 11, 17, 25, 36)  # of the multisine, in its own period of 50 SLOWEST_S

Coefficients = tuple[float, ...]


@dataclass(frozen=True)
class Block:
    """num(s)/den(s), descending powers."""

    num: Coefficients
    den: Coefficients


@dataclass(frozen=True)
class RandomRig:
    """G1 -> play -> G2 -> delay: borders w = s (v - d), slopes in V/V, d in V."""

    g1: Block
    g2: Block
    s_l: float
    d_l_v: float
    s_u: float
    d_u_v: float
    delay_s: float
    noise_v: float = 0.0


@dataclass(frozen=True)
class Bench:
    """A rig, the values its file gives, what is played, and the noisy readings of every run, V."""

    rig: RandomRig
    nominal: RandomRig
    stimuli: tuple[Stimulus, ...]
    readings: tuple[Array, ...]


def drawn(seed: int, number: int) -> Bench:
    """Return the bench of one rig of a study."""
    rng = np.random.default_rng([seed, number])
    rig = random_rig(rng)
    stimuli = protocol(rig)
    clean = tuple(answer(rig, stimulus.u) for stimulus in stimuli)
    share = float(rng.uniform(0.005, 0.01))
    rig = replace(rig, noise_v=share * float(np.std(np.concatenate(clean))))
    readings = tuple(y + rng.normal(0.0, rig.noise_v, y.size) for y in clean)
    return Bench(rig, off(rig, rng), stimuli, readings)


def random_rig(rng: np.random.Generator) -> RandomRig:
    """Draw a stable rig: complex poles in a third, unequal slopes in a third, a dead time in a third."""
    ringing, skewed, late = rng.uniform(size=3) < THIRD
    orders = rng.integers(1, 5, size=2)
    rings = ringing & (rng.uniform(size=2) < 0.5)
    if ringing:
        surely = int(rng.integers(2))
        rings[surely], orders[surely] = True, max(orders[surely], 2)
    slowest = int(rng.integers(2))
    g1, g2 = (_block(rng, int(orders[i]), i == slowest, bool(rings[i])) for i in range(2))
    slope, middle, half = rng.uniform(0.5, 5.0), rng.uniform(-0.3, 0.3), rng.uniform(0.4, 1.6)
    ratio = float(np.exp(rng.uniform(0.05, 0.2) * rng.choice((-1.0, 1.0)))) if skewed else 1.0
    delay_s = float(SLOWEST_S * np.exp(rng.uniform(np.log(0.05), np.log(2.0)))) if late else 0.0
    half *= abs(g1.num[-1] / g1.den[-1])
    return RandomRig(
        g1, g2, float(slope), float(half * (1.0 + middle)), float(slope * ratio), float(-half * (1.0 - middle)), delay_s
    )


def _block(rng: np.random.Generator, order: int, slowest: bool, rings: bool) -> Block:
    """Draw a block of either sign whose poles lie between 1 and 15, one of them at 1 where it is the slowest."""
    sizes = np.exp(rng.uniform(0.0, np.log(15.0), size=order))
    if slowest:
        sizes[0] = 1.0
    poles = (-sizes).astype(np.complex128)
    if rings and order >= 2:
        damping = rng.uniform(0.15, 0.9)
        size = np.exp(rng.uniform(np.log(max(0.8 / damping, 1.0)), np.log(15.0)))
        poles[-2:] = size * (-damping + np.array((1j, -1j)) * np.sqrt(1.0 - damping**2))
    den, num = np.poly(poles).real, np.ones(1)
    if order >= 2 and rng.uniform() < THIRD:
        num = np.array([rng.choice((1.0, -1.0), p=(0.75, 0.25)) / rng.uniform(1.0, 10.0), 1.0])
    gain = float(rng.choice((1.0, -1.0), p=(0.8, 0.2)) * np.exp(rng.uniform(np.log(0.5), np.log(2.0))))
    powers = SLOWEST_S ** np.arange(order, -1, -1.0)
    return Block(tuple((gain * num * powers[-num.size :]).tolist()), tuple((den / den[-1] * powers).tolist()))


def off(rig: RandomRig, rng: np.random.Generator) -> RandomRig:
    """Return the rig with every value off by OFF, up or down."""

    def share(value: float) -> float:
        return value * (1.0 + OFF * float(rng.choice((-1.0, 1.0))))

    def block(truth: Block) -> Block:
        return Block(tuple(map(share, truth.num)), tuple(map(share, truth.den)))

    return RandomRig(block(rig.g1), block(rig.g2), share(rig.s_l), share(rig.d_l_v), share(rig.s_u),
                     share(rig.d_u_v), share(rig.delay_s), rig.noise_v)  # fmt: skip


def response(block: Block, omega: float) -> complex:
    """Return the block at s = j omega."""
    return complex(np.polyval(block.num, 1j * omega) / np.polyval(block.den, 1j * omega))


def protocol(rig: RandomRig) -> tuple[Stimulus, ...]:
    """Return what suits the rig: staircases of two step sizes, sines of two amplitudes, a multisine.

    The gap is crossed widely at the staircases, and by factors of 1.6 and 3 at every frequency at which MOST allows
    at least the first.
    """
    half_v = 0.5 * (rig.d_l_v - rig.d_u_v)
    peak_v = 4.0 * half_v / abs(response(rig.g1, 0.0).real)
    runs = [_staircase("stairs coarse", peak_v, 4), _staircase("stairs fine", 0.8 * peak_v, 7)]
    for share in SINES:
        size = half_v / abs(response(rig.g1, share / SLOWEST_S))
        if 1.6 * size <= MOST * peak_v:
            runs += [_sine(share, min(factor * size, MOST * peak_v)) for factor in (1.6, 3.0)]
    return (*runs, _multisine(1.2 * peak_v))


def _staircase(name: str, peak_v: float, steps: int) -> Stimulus:
    """Return a walk from rest down to -peak, up to peak and down again."""
    walk = np.arange(-steps, steps + 1) / steps * peak_v
    levels = np.concatenate([walk, walk[-2::-1]])
    return _stimulus(name, "staircase", np.repeat(levels, round(10.0 * SLOWEST_S * RATE_HZ)), 1)


def _sine(share: float, amplitude_v: float) -> Stimulus:
    period = round(2.0 * np.pi * SLOWEST_S * RATE_HZ / share)
    periods = max(2, round(1500 / period))
    once = amplitude_v * np.sin(2.0 * np.pi * np.arange(period * periods) / period)
    return _stimulus(f"sine {share:g} at {amplitude_v:.3g} V", "sine", once, 2)


def _multisine(peak_v: float) -> Stimulus:
    period = round(50.0 * SLOWEST_S * RATE_HZ)
    angles = 2.0 * np.pi * np.outer(np.arange(period) / period, LINES) - np.pi * np.arange(len(LINES)) ** 2 / len(LINES)
    once = np.sin(angles).sum(axis=1)
    return _stimulus("multisine", "multisine", once * peak_v / np.abs(once).max(), 3)


def _stimulus(name: str, kind: str, once: Array, repeats: int) -> Stimulus:
    segments = tuple(Segment(name, kind, r * once.size, (r + 1) * once.size, r) for r in range(repeats))
    return Stimulus(name, np.tile(once, repeats), segments, RATE_HZ)


def answer(rig: RandomRig, u: Array, substeps: int = SUBSTEPS) -> Array:
    """Return the readings without noise, V, shape (samples,), from rest."""
    grid = Grid(RATE_HZ, u.size, substeps)
    v = linear_block(held(u, grid), rig.g1.num, rig.g1.den, grid.step_s)
    w = play(rig.s_l * (v - rig.d_l_v), rig.s_u * (v - rig.d_u_v), 0.0, 1.0, 0.0)
    x = linear_block(between(w), rig.g2.num, rig.g2.den, grid.step_s, rest=float(w[0]))
    return read_at(x, grid, rig.delay_s)
