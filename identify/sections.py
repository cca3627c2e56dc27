"""How is a denominator written as sections of first and second order, which keep it stable whatever their values?

1 + a s + b s^2 with positive a and b has both poles left of 0: real ones where b < a^2 / 4, a complex pair where it is
larger, and the two pass smoothly into each other. A product of sections is badly conditioned only where two of them
share a pole, so real poles that lie close together go into one section.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from identify.model import Rational

Section = tuple[float, ...]
"""(b, a) of 1 + a s + b s^2, or (a,) of 1 + a s: coefficients by falling power of s, the constant term one."""
EDGE = 1e-9  # damping ratio that is nothing but rounding
LEAST_DAMPING = 0.2  # damping ratio a mirrored pole has at least: its own is hardly known, and a start rings little


def sections(den: Sequence[float]) -> tuple[Section, ...]:
    """Return the sections of a stable denominator, slowest first, one of first order last where the order is odd.

    Raises ValueError for a pole that is not left of 0.
    """
    if len(den) <= 3:
        return (tuple(float(a / den[-1]) for a in den[:-1]),) if len(den) > 1 else ()
    poles = _poles(den)
    if not is_stable(den):
        worst = poles[int(np.argmax(poles.real))]
        raise ValueError(f"the denominator {tuple(den)} is not stable: a pole at {worst:.4g}/s")
    pairs = [_pair(p, p.conjugate()) for p in poles[poles.imag > 0.0]]
    real = sorted(poles[poles.imag == 0.0].real.tolist(), reverse=True)
    while len(real) > 1:
        closest = int(np.argmin(np.diff(np.log(np.abs(real)))))
        pairs.append(_pair(real.pop(closest + 1), real.pop(closest)))
    return (*sorted(pairs, reverse=True), *((-1.0 / p,) for p in real))


def _pair(one: complex, other: complex) -> Section:
    """Return the section with two poles, conjugate or both real."""
    product = (one * other).real
    return (1.0 / product, -(one + other).real / product)


def product(parts: Iterable[Section]) -> tuple[float, ...]:
    """Return the denominator that sections multiply to, its constant term one."""
    den = np.ones(1)
    for part in parts:
        den = np.convolve(den, (*part, 1.0))
    return tuple(den.tolist())


def is_stable(den: Sequence[float]) -> bool:
    """Return whether every pole lies left of 0."""
    poles = _poles(den)
    return bool(np.all(poles.real < -EDGE * np.abs(poles)))


def mirrored(block: Rational) -> Rational:
    """Return the block with its poles mirrored into the left half plane; a stable one as it is."""
    if is_stable(block.den):
        return block
    poles = _poles(block.den)
    left = -np.maximum(np.abs(poles.real), LEAST_DAMPING * np.abs(poles)) + 1j * poles.imag
    den = np.poly(left).real
    return replace(block, den=tuple((den * (block.den[-1] / den[-1])).tolist()))


def _poles(den: Sequence[float]) -> np.ndarray:
    """Return the roots, found in a time scale in which the coefficients are near one."""
    order = len(den) - 1
    if order < 1:
        return np.empty(0, dtype=np.complex128)
    scale = abs(den[-1] / den[0]) ** (1.0 / order)
    return np.asarray(np.roots(np.asarray(den) * scale ** np.arange(order, -1, -1.0)) * scale, dtype=np.complex128)
