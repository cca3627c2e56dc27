"""What does a rig file say of a block, or of F, whose values nobody knows?

``G1: {order: 2}`` or ``{order: 2, zeros: 1, gain: -1, dead_time: fit}`` in place of num and den, ``F: backlash`` (or
``F: {backlash: unknown}``) in place of its borders: the structure of the rig, whose values are found from the
recordings alone. ``order`` counts the poles, ``zeros`` the zeros (none if left out), ``gain`` is G(0) where its size or
sign is known (1 if left out; F carries the scale, and the sign of G2 is then found). ``dead_time`` is a starting value,
or ``fit`` (0 s if left out).
"""

from collections.abc import Sequence
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag

from identify.model import Backlash, Rational
from rig.errors import MisfitError
from rig.forms import Form, Gain, Seconds
from rig.units import exact

ORDERS_KEYS = ("order", "zeros", "gain")
MOST = 6  # poles of a block whose values are found from nothing
UNIT_BACKLASH = Backlash(1.0, 1.0, 1.0, -1.0)  # stands for borders that are not known
FIT = "fit"
TO_FIT_S = 1.0  # stands for a dead time that is not known


class OrdersForm(Form):
    """A linear block of which the structure is known."""

    order: Annotated[int, Field(ge=0, le=MOST)]
    zeros: Annotated[int, Field(ge=0)] = 0
    gain: Gain | None = None
    dead_time: Annotated[
        Annotated[Literal["fit"], Tag("fit")] | Annotated[Seconds, Tag("time")],
        Discriminator(lambda value: "fit" if value == FIT else "time"),
    ] = 0.0


def is_orders(node: Any) -> bool:
    """Return whether what stands in the file for a block gives its structure instead of its values."""
    return isinstance(node, dict) and bool(set(node) & set(ORDERS_KEYS)) and not {"num", "den"} & set(node)


def unvalued(name: str, form: OrdersForm) -> tuple[Rational, tuple[str, ...]]:
    """Return a block that stands for the orders, and what of it is unknown; raise MisfitError for what cannot be."""
    if form.zeros > form.order:
        raise MisfitError("more zeros than poles", value=f"{form.zeros} zeros over {form.order} poles",
                          allowed=f"zeros: 0 to {form.order}", do="add the pole that limits it")
    if form.gain == 0.0:
        raise MisfitError("no gain at 0 Hz", do="leave 'gain:' out: F carries the scale")
    if form.dead_time == FIT and name == "G1":
        raise MisfitError("only the sum of the dead times shows in a recording", value="dead_time: fit in G1",
                          do="write 'dead_time: fit' under G2")
    late = form.dead_time == FIT
    gain, delay_s = form.gain or 1.0, TO_FIT_S if late else float(form.dead_time)
    block = Rational((0.0,) * form.zeros + (gain,), (1.0,) * (form.order + 1), delay_s)
    unknown = [name] if form.order > 0 else []
    if name == "G2" and form.gain is None:
        unknown.append("G2.gain")
    return block, (*unknown, *([f"{name}.dead_time"] if late else []))


def owns(owner: str, name: str) -> bool:
    """Return whether ``name`` is ``owner`` or a part of it: G1 owns G1.den."""
    return name == owner or name.startswith(f"{owner}.")


def is_open(name: str, unknown: Sequence[str]) -> bool:
    """Return whether ``name``, or a part of it, has no value; a dead time may have one where its block has none."""
    if name.endswith(".dead_time"):
        return name in unknown
    return any(owns(name, other) or owns(other, name) for other in unknown)


def orders_dict(name: str, block: Rational, unknown: tuple[str, ...]) -> dict[str, Any]:
    """Return a block without values in the form of a rig file."""
    found: dict[str, Any] = {"order": len(block.den) - 1}
    if len(block.num) > 1:
        found["zeros"] = len(block.num) - 1
    if name != "G2" or "G2.gain" not in unknown:
        found["gain"] = block.dc_gain
    return {**found, "dead_time": FIT if f"{name}.dead_time" in unknown else exact(block.dead_time_s, "s")}
