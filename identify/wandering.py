"""How does w wander about its mean where noise in front of the gap carries it along?

The mean of w (identify.ratchet) is a law; what one course of the noise makes of it beside that is not, and may be
tens of times the noise of a reading. It has a structure, though. Where a border rests or runs within reach of w, w is
pushed now and then: from a height h above it the mean gain in a step is g(h), the chance of a push is p = -g'(h), and
pushes are nearly exponential, as what normal noise exceeds a high level by is, of mean g / p. To first order the
deviation of w from its mean thus fades with p and is pushed by 2 g^2 / p in variance in a step; away from both borders
it stays as it is.

Where it is the contact that is made elsewhere every time, that deviation is another at every new contact, and stays.
Where what holds w in the gap gathers noise, it grows there, and the next contact ends it.
"""

import numpy as np
from scipy.special import ndtr

from identify.blocks import LinearBlock
from identify.chain import Chain, grid_of, signals
from identify.innovations import Wander
from identify.observe import Observation
from identify.ratchet import HIGHEST, PER_Z, Kind, gains, renewal
from identify.stage import Grid, Place, Ramp
from identify.trace import Array, Mask

FADES = 6.0 / np.pi**2  # times p: so that it scatters as the highest of many does (E. J. Gumbel, 1958), not less
FORGETS: dict[Kind, float] = {"low-pass": 1.0, "white": 2.0}  # in its unit of time: no quicker than the noise itself
NEAR = 1e-9  # of how far w goes: it stands at a border that is no farther away
PUSHED = 0.25  # chance of a border that is anew elsewhere to push what rested at the other
NEVER = 1e-9  # chance of a push in a step below which there is none
REFLECTED = 1.0 - 2.0 / np.pi  # of the variance of a walk, that it has where a border keeps it on one side
FASTEST = 30.0  # steps of a walk, by which a border moves in one that forgets all before it


def wander_of(chain: Chain, observation: Observation, sd_v: float, kind: Kind, bandwidth_hz: float) -> Wander:
    """Return how w wanders in a run by noise in front of the gap, sd in V and bandwidth in Hz, of which a chain has
    the mean.

    Raises ValueError where the chain cannot be simulated.
    """
    o, (w, lower, upper) = observation, _borders(chain, observation)
    grid = grid_of(o.trace)
    renewed = renewal(kind, bandwidth_hz, grid.step_s)
    table, memory = gains(kind, renewed), float(np.exp(-FORGETS[kind] * renewed))
    before = np.concatenate((w[:1], w[:-1]))
    sizes = [abs(chain.values[f"F.{name}"]) * sd_v for name in ("S_L", "S_U")]
    keep_l, gain_l = _pushed((before - lower) / sizes[0], table, memory)
    keep_u, gain_u = _pushed((upper - before) / sizes[1], table, memory)
    gained = (sizes[0] ** 2 * gain_l + sizes[1] ** 2 * gain_u) / o.noise_v**2
    return _behind(chain, grid, keep_l * keep_u, gained, o)


def scattered_of(chain: Chain, observation: Observation, sd_v: float, at_turns: bool) -> Wander:
    """Return how w wanders in a run where every contact is made elsewhere by chance, by an sd in V of v.

    Where the gap is another already ``at_turns``, w may be pushed as it leaves a border. Raises ValueError where the
    chain cannot be simulated.
    """
    o, (w, lower, upper) = observation, _borders(chain, observation)
    away = _away(w, lower, upper)
    held = w[np.maximum(np.maximum.accumulate(np.where(away, np.arange(w.size), -1)), 0)]
    sizes = [abs(chain.values[f"F.{name}"]) * sd_v for name in ("S_L", "S_U")]
    met_l, met_u = _met((held - lower) / sizes[0]), _met((upper - held) / sizes[1])
    if at_turns:
        opens = away & ~np.concatenate((away[:1], away[:-1]))
        met_l, met_u = (np.where(opens, PUSHED, met) for met in (met_l, met_u))
    gained = (sizes[0] ** 2 * met_l + sizes[1] ** 2 * met_u) / o.noise_v**2
    return _behind(chain, grid_of(o.trace), (1.0 - met_l) * (1.0 - met_u), gained, o)


def gathered_of(chain: Chain, observation: Observation, sd_v: float) -> Wander:
    """Return how w wanders in a run where what holds it gathers noise: it walks in the gap, by an sd in V in a second.

    A border that moves by c in a step against a walk of s in one has w nearly exponentially within s^2 / 2 c of it, and
    that fades in some 2 s^2 / c^2 steps (J. M. Harrison, Brownian Motion and Stochastic Flow Systems, 1985). Raises
    ValueError where the chain cannot be simulated.
    """
    o, (w, lower, upper) = observation, _borders(chain, observation)
    grid, away = grid_of(o.trace), _away(w, lower, upper)
    step_v, at = sd_v * np.sqrt(grid.step_s), np.arange(w.size)
    walked = step_v * np.sqrt(np.maximum(at - np.maximum.accumulate(np.where(away, -1, at)), 1))
    met = 1.0 - (1.0 - _met((w - lower) / walked)) * (1.0 - _met((upper - w) / walked))
    speed = np.where(away, 0.0, np.abs(np.diff(w, prepend=w[:1]))) / step_v
    keeps = np.exp(-0.5 * np.square(np.minimum(speed, FASTEST)))
    near = np.where(speed > 0.0, 0.25 / np.square(np.maximum(speed, NEVER)) * (1.0 - np.square(keeps)), 1.0)
    gained = np.where(away, 1.0, np.minimum(near, REFLECTED)) * step_v**2 / o.noise_v**2
    return _behind(chain, grid, keeps * np.where(away, 1.0 - met, 1.0), gained, o)


def _borders(chain: Chain, observation: Observation) -> tuple[Array, Array, Array]:
    """Return w of a run, and where either border would have it, V."""
    passed = signals(chain, observation.trace)
    v, w = passed[chain.index(Place.G1) - 1], passed[chain.index(Place.F) - 1]
    s_l, d_l, s_u, d_u = (chain.values[f"F.{name}"] for name in ("S_L", "D_L", "S_U", "D_U"))
    return w, s_l * (v - d_l), s_u * (v - d_u)


def _away(w: Array, lower: Array, upper: Array) -> Mask:
    """Return where no border is at w."""
    reach = NEAR * float(np.max(np.abs(w)))
    return np.asarray((w - lower > reach) & (upper - w > reach))


def _met(height: Array) -> Array:
    """Return the chance that a border, somewhere by a normal law of sd 1, is met in a step, of heights above it."""
    last = np.concatenate((height[:1], height[:-1]))
    there, before = ndtr(-height), ndtr(-last)
    return np.clip((there - before) / np.maximum(1.0 - before, NEVER), 0.0, 1.0)


def _pushed(height: Array, table: Array, memory: float) -> tuple[Array, Array]:
    """Return the factor by which a deviation fades in a step, and the variance it gains, sd^2, from heights in sd.

    A border that has passed w takes it along: it then wanders as the noise itself does.
    """
    at = np.clip(height, 0.0, HIGHEST) * PER_Z
    i = np.minimum(at.astype(np.int64), table.size - 2)
    slope = table[i + 1] - table[i]
    gained, chance = (table[i] + (at - i) * slope) / PER_Z, np.clip(-slope, 0.0, 1.0)
    reached = (height < HIGHEST) & (chance > NEVER)
    keeps = np.where(reached, np.maximum(1.0 - FADES * chance, memory), 1.0)
    pushed = np.minimum(2.0 * np.square(gained) / np.maximum(chance, NEVER), 1.0 - np.square(keeps))
    return keeps, np.where(reached, pushed, 0.0)


def _behind(chain: Chain, grid: Grid, keeps: Array, gained: Array, observation: Observation) -> Wander:
    """Return what wanders in front of G2, as late as G2 is by whole steps."""
    block = next(s for s in chain.stages if isinstance(s, LinearBlock) and s.place is Place.G2)
    values = chain.of(block, grid.run)
    late, _ = block.late(values, grid)
    keeps = np.concatenate((np.ones(late), keeps))[: keeps.size]
    gained = np.concatenate((np.zeros(late), gained))[: gained.size]
    return Wander(keeps, gained, block.stepper(values, grid, Ramp()), observation.use)
