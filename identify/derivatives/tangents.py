"""How does the answer of the plain chain change with every searched number, exactly and in one pass over the samples?

Derivatives travel beside the signals. Those of v by G1's values are outputs of its cascade (cascade); on a
border of F they are multiplied by its slope and joined by the border's own, on a plateau they stay as w does (eq. (7)
differentiated); G2 takes them as it takes w, and its own derivatives are outputs of its cascade on w. Two are had for
nothing: w is proportional to both slopes together, so S_L dy/dS_L + S_U dy/dS_U = y; and a dead time acts on what G2
puts out as minus its slope in time.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from identify.blocks import Gain, LinearBlock, Play, Source, delay_line
from identify.chain import Chain
from identify.derivatives import lane_kernels
from identify.derivatives.abreast import MOST_STATES, Answers, Through, ToW, pair_rows
from identify.derivatives.cascade import Cascade, Outputs, cascade, coefficient_slopes
from identify.derivatives.lanes import WIDTH
from identify.discretise import Matrix
from identify.stage import Block, Grid, Held, Ramp, Shape, Values
from identify.trace import Array

AT_ONCE = 1 << 12  # instants handled at once: what eight lanes of them need stays in the cache
Scales = Mapping[str, float]
T = TypeVar("T")


@dataclass(frozen=True)
class Tangents:
    """The plain chain at work with its derivatives: ``run`` turns a stretch of instants into (answer, rows).

    The answer in V, shape (n,), and rows, shape (n, width), are those of the n sample instants, ``samples`` of them at
    most, and valid until the next run. ``columns`` are the places in a row of the derivatives, in the order of the
    names asked for.
    """

    samples: int
    columns: tuple[int, ...]
    run: Callable[[Block], tuple[Array, Matrix]]


@dataclass(frozen=True)
class _Lane:
    """One derivative of w: an output of G1's cascade, and what F makes of it on either border (factor, constant)."""

    name: str
    output: Outputs
    loading: tuple[float, float]
    unloading: tuple[float, float]


@dataclass(frozen=True)
class _Law:
    """F as two straight lines (slope, w at v = 0), its own derivatives, and how its last follows from the others.

    ``own``: name, (factor on v, constant) on the loading border, the same on the unloading one; the first of them
    travels in the lane of v. ``last``: name, share of the answer, share of the first.
    """

    lines: tuple[float, float, float, float]
    own: tuple[tuple[str, tuple[float, float], tuple[float, float]], ...]
    last: tuple[str, float, float]


def tangents(chain: Chain, scales: Scales, grid: Grid) -> Tangents | None:
    """Return the plain chain at rest with its derivatives by the named values, each times its scale.

    None where the chain is another, or a block has more than ``MOST_STATES`` states. Raise ValueError for values no
    block can have.
    """
    parts = _parts(chain, scales)
    if parts is None:
        return None
    source, g1, f, g2 = parts
    law = _law(f, chain.of(f, grid.run), scales)
    shape = Held() if source.held else Ramp()
    one = _cascade(g1, chain.of(g1, grid.run), grid, shape)
    two = _cascade(g2, chain.of(g2, grid.run), grid, shape if one.order == 0 else Ramp())
    lanes = [*_of_block(g1, one, chain, scales, grid, law), *_of_law(law, one)]
    own = [("", two.answer), *_outputs(g2, two, chain, scales, grid)]
    own += [(p.name, two.rate.mixed(np.array([[-scales[p.name]]]))) for p in g2.delays if p.name in scales]
    whole, _ = g2.late(chain.of(g2, grid.run), grid)
    return _running(whole, scales, grid, law, one, lanes, two, own)


def _parts(chain: Chain, scales: Scales) -> tuple[Source, LinearBlock, Play | Gain, LinearBlock] | None:
    """Return the stages of a chain whose derivatives can be run, else None."""
    match chain.stages:
        case (Source() as source, LinearBlock() as g1, Play() | Gain() as f, LinearBlock() as g2):
            small = all(len(block.start.den) - 1 <= MOST_STATES for block in (g1, g2))
            known = {p.name for p in chain.parameters()}
            plain = type(f) in (Play, Gain)  # a leaking play is a play with values of its own
            steep = isinstance(f, Gain) or chain.values[f.parameters()[2].name] != 0.0
            return (source, g1, f, g2) if small and plain and steep and known >= set(scales) else None
        case _:
            return None


def _law(f: Play | Gain, values: Values, scales: Scales) -> _Law:
    """Return F's lines and derivatives."""
    names = [p.name for p in f.parameters()]
    size = [scales.get(name, 1.0) for name in names]
    none = (0.0, 0.0)
    if isinstance(f, Gain):
        gain, offset = values
        by_gain, by_offset = (size[0], 0.0), (0.0, size[1])
        own = ((names[0], by_gain, by_gain), (names[1], by_offset, by_offset))
        return _Law((gain, offset, gain, offset), own, ("", 0.0, 0.0))
    s_l, d_l, s_u, d_u = values
    by_s_l, by_d_l, by_d_u = (size[0], -size[0] * d_l), (0.0, -size[1] * s_l), (0.0, -size[3] * s_u)
    return _Law(
        (s_l, -s_l * d_l, s_u, -s_u * d_u),
        ((names[0], by_s_l, none), (names[1], by_d_l, none), (names[3], none, by_d_u)),
        (names[2], size[2] / s_u, -size[2] * s_l / (s_u * size[0])),
    )


def _cascade(block: LinearBlock, values: Values, grid: Grid, shape: Shape) -> Cascade:
    """Return the cascade of a block at fitted values, late by a fraction of a step."""
    fitted, (_, fraction) = block.rational(values), block.late(values, grid)
    if isinstance(shape, Held):
        return cascade(fitted.num, fitted.den, grid.step_s, "held", shape.fraction, fraction)
    return cascade(fitted.num, fitted.den, grid.step_s, "ramp", late=fraction)


def _outputs(
    block: LinearBlock, at: Cascade, chain: Chain, scales: Scales, grid: Grid
) -> list[tuple[str, Outputs]]:
    """Return the derivatives of a block's answer by those of its values that are searched."""
    parameters, values = block.coefficients(), chain.of(block, grid.run)[: len(block.coefficients())]
    alone = replace(block, delays=())
    slopes = coefficient_slopes(alone.rational, values, tuple(p.scale for p in parameters))
    return [
        (p.name, at.coefficients.mixed(scales[p.name] * row[None, :]))
        for p, row in zip(parameters, slopes, strict=True) if p.name in scales
    ]  # fmt: skip


def _of_block(
    g1: LinearBlock, one: Cascade, chain: Chain, scales: Scales, grid: Grid, law: _Law
) -> list[_Lane]:
    """Return the lanes of G1's values."""
    low, high = (law.lines[0], 0.0), (law.lines[2], 0.0)
    return [_Lane(n, output, low, high) for n, output in _outputs(g1, one, chain, scales, grid)]


def _of_law(law: _Law, one: Cascade) -> list[_Lane]:
    """Return the lanes of F's values; that of v is the last."""
    lanes = [_Lane(name, one.answer, low, high) for name, low, high in law.own]
    return [*lanes[1:], lanes[0]]


def _running(
    whole: int, scales: Scales, grid: Grid, law: _Law, one: Cascade, lanes: Sequence[_Lane],
    two: Cascade, own: Sequence[tuple[str, Outputs]],
) -> Tangents:  # fmt: skip
    """Return the compiled loops at work: the lanes in eights, each with v as its last, then the outputs of G2."""
    eights = _cut(lanes[:-1], WIDTH - 1)
    before = [(_to_w(one, part, lanes[-1], law), Through(two)) for part in eights]
    after = [Answers(two, [output for _, output in part]) for part in _cut(own, WIDTH)]
    at_answer = WIDTH * len(before)
    w, dw, answer = np.empty(AT_ONCE), np.empty((AT_ONCE, WIDTH)), np.empty(AT_ONCE)
    rows, late = np.empty((AT_ONCE, at_answer + WIDTH * len(after))), delay_line(whole)

    def run(block: Block) -> tuple[Array, Matrix]:
        u = late(block)  # what G2 is late by whole steps commutes with all before it
        u, n, every = u if u.flags.writeable else u.copy(), u.size, grid.substeps
        out, y = rows[: n // every], answer[: n // every]
        for i, (to_w, through) in enumerate(before):
            to_w.run(u, w[:n], dw[:n])
            dw[: max(whole - block.first, 0)] = 0.0  # and there was nothing before the run
            through.run(dw[:n], every, i, out)
        w[: max(whole - block.first, 0)] = 0.0
        for i, answers in enumerate(after, start=len(before)):
            answers.run(w[:n], every, i, out)
        lane_kernels.take_answer(out, at_answer, *law.last[1:], WIDTH - 1, y)
        return y, out

    places = {lane.name: WIDTH * i + k for i, part in enumerate(eights) for k, lane in enumerate(part)}
    places |= {name: at_answer + k for k, (name, _) in enumerate(own)}
    places |= {lanes[-1].name: WIDTH - 1, law.last[0]: at_answer}
    return Tangents(AT_ONCE // grid.substeps, tuple(places[name] for name in scales), run)


def _to_w(one: Cascade, lanes: Sequence[_Lane], v: _Lane, law: _Law) -> ToW:
    """Return G1 and F at work with some lanes, and that of v as the last."""
    places = [*range(len(lanes)), WIDTH - 1]
    rest = np.zeros((4, WIDTH))
    for place, lane in zip(places, (*lanes, v), strict=True):
        rest[:, place] = (*lane.loading, *lane.unloading)
    pair = pair_rows(one, [lane.output for lane in (*lanes, v)], places)
    return ToW(np.concatenate((pair, rest)), law.lines)


def _cut(items: Sequence[T], size: int) -> list[Sequence[T]]:
    """Return a sequence in parts, one at least."""
    return [items[i : i + size] for i in range(0, max(len(items), 1), size)]
