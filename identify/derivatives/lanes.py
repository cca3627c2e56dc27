"""How do eight numbers travel through a compiled loop as one?

``Lanes`` is a vector of eight doubles that compiled code keeps in registers and adds and multiplies at once, whatever
the width of the processor's own vectors. What it holds differs by lane, what is done to it does not: eight derivatives
of one signal go through one filter together.
"""

from collections.abc import Callable
from operator import add, mul, sub, truediv
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic, models, overload, register_model

WIDTH = 8
_VECTOR = ir.VectorType(ir.DoubleType(), WIDTH)
_PLACE = ir.IntType(32)
_FUSED = ("contract",)  # a product and a sum become one step; the order of sums stays as it is written
_ANYTHING = ir.Constant(_VECTOR, ir.Undefined)

_TURNS = (  # rows so far apart exchange what is off the diagonal: of single numbers, of pairs, of fours
    (1, (0, 8, 2, 10, 4, 12, 6, 14), (1, 9, 3, 11, 5, 13, 7, 15)),
    (2, (0, 1, 8, 9, 4, 5, 12, 13), (2, 3, 10, 11, 6, 7, 14, 15)),
    (4, (0, 1, 2, 3, 8, 9, 10, 11), (4, 5, 6, 7, 12, 13, 14, 15)),
)


class Lanes(types.Type):
    """Numba's name for a vector of eight doubles."""

    def __init__(self) -> None:
        """Name the type."""
        super().__init__(name="Lanes")


LANES = Lanes()


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):
    """What LLVM holds for it."""

    def __init__(self, dmm: Any, fe_type: Any) -> None:
        super().__init__(dmm, fe_type, _VECTOR)  # type: ignore[no-untyped-call]


def _code(write: Any) -> Any:
    """Return what compiled code calls; it does so without the first argument, which no type can say."""
    return intrinsic(write)


def _address(context: Any, builder: Any, kind: Any, array: Any, row: Any) -> Any:
    """Return the address of eight numbers in a row of a contiguous array."""
    first = builder.mul(row, ir.Constant(row.type, WIDTH))
    return builder.bitcast(builder.gep(context.make_array(kind)(context, builder, array).data, [first]),
                           _VECTOR.as_pointer())  # fmt: skip


def _at(lane: int) -> Any:
    """Return the shuffle that puts one lane into all."""
    return ir.Constant(ir.VectorType(_PLACE, WIDTH), [lane] * WIDTH)


def _order(lanes: tuple[int, ...]) -> Any:
    """Return the shuffle that takes these lanes of two, those of the second counted on."""
    return ir.Constant(ir.VectorType(_PLACE, WIDTH), list(lanes))


@_code
def load(typing: Any, array: Any, row: Any) -> Any:
    """Return the eight numbers from index 8 * row on of a contiguous array of doubles."""

    def write(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.load(_address(context, builder, signature.args[0], *arguments), align=8)

    return LANES(array, types.intp), write


@_code
def store(typing: Any, array: Any, row: Any, lanes: Any) -> Any:
    """Put the eight numbers to index 8 * row on of a contiguous array of doubles."""

    def write(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        builder.store(arguments[2], _address(context, builder, signature.args[0], *arguments[:2]), align=8)
        return context.get_dummy_value()

    return types.void(array, types.intp, LANES), write


@_code
def spread(typing: Any, number: Any) -> Any:
    """Return lanes that all hold one number."""

    def write(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        first = builder.insert_element(_ANYTHING, arguments[0], ir.Constant(_PLACE, 0))
        return builder.shuffle_vector(first, _ANYTHING, _at(0))

    return LANES(types.float64), write


@_code
def last(typing: Any, lanes: Any) -> Any:
    """Return the number in the last lane."""

    def write(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.extract_element(arguments[0], ir.Constant(_PLACE, WIDTH - 1))

    return types.float64(LANES), write


@_code
def each(typing: Any, lanes: Any) -> Any:
    """Return eight lanes, the k-th of which hold nothing but the k-th number."""

    def write(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        spread_out = [builder.shuffle_vector(arguments[0], _ANYTHING, _at(lane)) for lane in range(WIDTH)]
        return context.make_tuple(builder, signature.return_type, spread_out)

    return types.UniTuple(LANES, WIDTH)(LANES), write  # type: ignore[no-untyped-call]


@_code
def turned(typing: Any, rows: Any) -> Any:
    """Return eight lanes of eight numbers with row and lane exchanged."""

    def write(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        rows = [builder.extract_value(arguments[0], i) for i in range(WIDTH)]
        for apart, first, second in _TURNS:
            for i in (i for i in range(WIDTH) if not i & apart):
                one, other = rows[i], rows[i + apart]
                rows[i], rows[i + apart] = (builder.shuffle_vector(one, other, _order(at)) for at in (first, second))
        return context.make_tuple(builder, signature.return_type, rows)

    return types.UniTuple(LANES, WIDTH)(rows), write  # type: ignore[no-untyped-call]


@_code
def _sum(typing: Any, one: Any, other: Any) -> Any:
    """Return the sum, lane by lane."""
    return LANES(LANES, LANES), lambda context, builder, signature, arguments: builder.fadd(*arguments, flags=_FUSED)


@_code
def _product(typing: Any, one: Any, other: Any) -> Any:
    """Return the product, lane by lane."""
    return LANES(LANES, LANES), lambda context, builder, signature, arguments: builder.fmul(*arguments, flags=_FUSED)


@_code
def _less(typing: Any, one: Any, other: Any) -> Any:
    """Return the first less the second, lane by lane."""
    return LANES(LANES, LANES), lambda context, builder, signature, arguments: builder.fsub(*arguments, flags=_FUSED)


@_code
def _quotient(typing: Any, one: Any, other: Any) -> Any:
    """Return the first over the second, lane by lane."""
    return LANES(LANES, LANES), lambda context, builder, signature, arguments: builder.fdiv(*arguments)


@_code
def where_same(typing: Any, one: Any, other: Any, lanes: Any) -> Any:
    """Return the third where the first two are the same, and zero elsewhere."""

    def write(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        same = builder.fcmp_ordered("==", *arguments[:2])
        return builder.select(same, arguments[2], ir.Constant(_VECTOR, [0.0] * WIDTH))

    return LANES(LANES, LANES, LANES), write


@_code
def any_larger(typing: Any, one: Any, other: Any) -> Any:
    """Return whether the first is larger than the second in any lane; what is no number is not."""

    def write(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        bits = builder.bitcast(builder.fcmp_ordered(">", *arguments), ir.IntType(WIDTH))
        return builder.icmp_unsigned("!=", bits, ir.Constant(ir.IntType(WIDTH), 0))

    return types.boolean(LANES, LANES), write


def _chosen(order: str) -> Any:
    """Return what keeps of two numbers in every lane the one that is first in an order."""

    def choose(typing: Any, one: Any, other: Any) -> Any:
        def write(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return builder.select(builder.fcmp_ordered(order, *arguments), *arguments)

        return LANES(LANES, LANES), write

    return _code(choose)


larger, smaller = _chosen(">"), _chosen("<")


@overload(add, strict=False)
def _add(one: Any, other: Any) -> Callable[..., Any] | None:
    if isinstance(one, Lanes) and isinstance(other, Lanes):
        return lambda one, other: _sum(one, other)  # noqa: PLW0108
    return None


@overload(sub, strict=False)
def _subtract(one: Any, other: Any) -> Callable[..., Any] | None:
    if isinstance(one, Lanes) and isinstance(other, Lanes):
        return lambda one, other: _less(one, other)  # noqa: PLW0108
    return None


@overload(truediv, strict=False)
def _divide(one: Any, other: Any) -> Callable[..., Any] | None:
    if isinstance(one, Lanes) and isinstance(other, Lanes):
        return lambda one, other: _quotient(one, other)  # noqa: PLW0108
    return None


@overload(mul, strict=False)
def _multiply(one: Any, other: Any) -> Callable[..., Any] | None:
    if isinstance(one, Lanes) and isinstance(other, Lanes):
        return lambda one, other: _product(one, other)  # noqa: PLW0108
    if isinstance(one, types.Float) and isinstance(other, Lanes):
        return lambda one, other: _product(spread(one), other)
    return None
