"""Which numbers does an operator ask of a rig, and how do they move with the searched coordinates?

Borders, gains and phases rather than coefficients: a pole far above all that is played has no value of its own to be
sure of, while what it does to the response has. Phases count over G1 and G2 together, since a delay moves freely
between them (physics.md 1.1).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from identify.blocks import Gain, LinearBlock, Play
from identify.chain import Chain
from identify.coordinate import Coordinate
from identify.delay import delay_s
from identify.derivatives.sensitivities import DIFFERENCE
from identify.trace import Array


@dataclass(frozen=True)
class Quantity:
    """One number an operator asks for: its value, its unit, the size it is measured against, its slope along theta."""

    name: str
    unit: str
    value: float
    size: float
    slope: Array


def corners_hz(chain: Chain, rate_hz: float) -> tuple[float, ...]:
    """Return the slowest corners of G1 and G2 and what lies between, Hz: where gains and phases are asked for."""
    corners = set()
    for block in blocks_of(chain):
        poles = np.abs(np.roots(_rational(chain, block)[1])) / (2.0 * np.pi)
        corners |= {float(np.min(poles))} if poles.size else set()
    low, high = min(corners, default=0.0), max(corners, default=0.0)
    wanted = {0.5 * low, low, 2.0 * low} if high < 1.5 * low else {low, (low * high) ** 0.5, high}
    return tuple(sorted(float(f"{f:.3g}") for f in wanted if 0.0 < f < 0.25 * rate_hz))


def blocks_of(chain: Chain) -> tuple[LinearBlock, ...]:
    """Return G1 and G2."""
    return tuple(s for s in chain.stages if isinstance(s, LinearBlock) and s.name in ("G1", "G2"))


def _rational(chain: Chain, block: LinearBlock) -> tuple[tuple[float, ...], tuple[float, ...]]:
    found = block.rational(chain.of(block, ""))
    return found.num, found.den


def quantities(
    chain: Chain, coordinates: Sequence[Coordinate], frequencies_hz: Sequence[float]
) -> tuple[Quantity, ...]:
    """Return the borders (or the line) of F, gains of G1 and G2, and the phase of both together, with their slopes."""
    found = [q for stage in chain.stages if isinstance(stage, Play | Gain) for q in _of_f(chain, stage, coordinates)]
    dynamic = [block for block in blocks_of(chain) if block.coefficients()]
    found += [_gain(chain, block, coordinates, f) for block in dynamic for f in frequencies_hz]
    return (*found, *(_phase(chain, coordinates, f) for f in frequencies_hz))


def _of_f(chain: Chain, stage: Play | Gain, coordinates: Sequence[Coordinate]) -> list[Quantity]:
    """Return the parameters of F; a position in V counts against the width of the gap, or as it is."""
    values = chain.values
    width = abs(values["F.D_L"] - values["F.D_U"]) or 1.0 if isinstance(stage, Play) else 1.0
    found = []
    for p in stage.parameters():
        size = 0.5 * width if p.unit == "V" else abs(values[p.name]) or 1.0
        slope = np.array([c.slope(0.0) * (c.name == p.name) for c in coordinates])
        found.append(Quantity(p.name, p.unit, values[p.name], size, slope))
    return found


def _response(chain: Chain, block: LinearBlock, frequency_hz: float) -> complex:
    num, den = _rational(chain, block)
    s = 2j * np.pi * frequency_hz
    return complex(np.polyval(num, s) / np.polyval(den, s))


def _gain(chain: Chain, block: LinearBlock, coordinates: Sequence[Coordinate], f: float) -> Quantity:
    """Return the gain of a block at one frequency."""
    here = abs(_response(chain, block, f))
    slope = _slope(chain, coordinates, lambda c: abs(_response(c, block, f)))
    return Quantity(f"|{block.name}| at {f:g} Hz", "V/V", here, here, slope)


def _phase(chain: Chain, coordinates: Sequence[Coordinate], f: float) -> Quantity:
    """Return the phase of G1 and G2 together at one frequency, dead times included; it counts against 1 rad."""

    def turned(moved: Chain) -> complex:
        whole = np.prod([_response(moved, block, f) for block in blocks_of(moved)])
        return complex(whole * np.exp(-2j * np.pi * f * delay_s(moved)))

    here = turned(chain)
    slope = _slope(chain, coordinates, lambda c: float(np.angle(turned(c) / here)))
    return Quantity(f"phase at {f:g} Hz", "rad", float(np.angle(here)), 1.0, slope)


def _slope(chain: Chain, coordinates: Sequence[Coordinate], of: Callable[[Chain], float]) -> Array:
    """Return the derivative of a number made from a chain's values against every coordinate, shape (p,)."""
    here = of(chain)
    moved = [of(chain.with_values({c.name: c.value(DIFFERENCE)})) for c in coordinates]
    return np.array([(there - here) / DIFFERENCE for there in moved])
