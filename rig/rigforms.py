"""Which keys does a rig file have, and what may stand under them?"""

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, ConfigDict, Discriminator, Field, Tag

from rig.amplifier import Amplifier
from rig.errors import MisfitError
from rig.forms import BY_SHAPE, Form, Gain, Seconds, Volts, either, shape_of
from rig.limits import LimitsForm
from rig.orders import OrdersForm, is_orders

Coefficients = Annotated[list[float], Field(min_length=1, max_length=30)]


class BlockForm(Form):
    """A linear block in descending powers of s."""

    num: Coefficients
    den: Coefficients
    dead_time: Seconds = 0.0


class BordersForm(Form):
    """The play operator: slopes in V/V, crossings of the v axis with their unit."""

    S_L: Gain
    D_L: Volts
    S_U: Gain
    D_U: Volts


class OneSlopeForm(Form):
    """The play operator whose borders have one slope by construction: one stage of the circuit makes both."""

    S: Gain
    D_L: Volts
    D_U: Volts


Curve = Annotated[list[Annotated[list[Volts], Field(min_length=2, max_length=2)]], Field(min_length=2, max_length=100)]


class CurvesForm(Form):
    """The play operator between bent borders: points [v, w], each with its unit."""

    L: Curve
    U: Curve


class LineForm(Form):
    """A straight line in place of the backlash."""

    gain: Gain = 1.0
    offset: Volts = 0.0


def _amplifies(gain: float) -> float:
    """Return a gain that is not nothing; raise MisfitError."""
    if gain == 0.0:
        raise MisfitError("an amplifier amplifies", value="0 V/V", allowed="any other gain")
    return gain


class AmplifierForm(Form):
    """An amplifier between the device's output and the rig: its gain in V/V, and where its output ends."""

    gain: Annotated[Gain, AfterValidator(_amplifies)]
    range: Annotated[Volts, Field(gt=0)]

    def amplifier(self) -> Amplifier:
        """Return the amplifier."""
        return Amplifier(self.gain, self.range)


def _has_one_slope(node: object) -> bool:
    """Return whether a backlash is given with one slope for both borders."""
    return isinstance(node, OneSlopeForm) or (isinstance(node, dict) and "S" in node)


class NonlinearityForm(Form):
    """F: one of its kinds."""

    model_config = ConfigDict(json_schema_extra=either(("backlash",), ("curved_backlash",), ("linear",)))
    backlash: Annotated[
        Annotated[Literal["unknown"], Tag("plain")] | Annotated[BordersForm, Tag("mapping")]
        | Annotated[OneSlopeForm, Tag("one slope")],
        Discriminator(lambda node: "one slope" if _has_one_slope(node) else shape_of(node)),
    ] | None = None
    curved_backlash: CurvesForm | None = None
    linear: LineForm | None = None


AnyBlock = Annotated[
    Annotated[BlockForm, Tag("values")] | Annotated[OrdersForm, Tag("orders")],
    Discriminator(lambda node: "orders" if is_orders(node) else "values"),
]


FForm = Literal["linear", "backlash"] | NonlinearityForm


class RigForm(Form):
    """The top of a rig file."""

    spec: Literal[1]
    rig: str = Field(min_length=1)
    G1: AnyBlock
    F: Annotated[
        Annotated[Literal["linear", "backlash"], Tag("plain")] | Annotated[NonlinearityForm, Tag("mapping")], BY_SHAPE]
    G2: AnyBlock
    noise: Annotated[Volts, Field(ge=0)] | None = None
    limits: LimitsForm | None = None
    amplifier: AmplifierForm | None = None
    fixed: list[str] = Field(default_factory=list)
    physics: dict[str, dict[str, Any]] = Field(default_factory=dict)
    concealed: dict[str, dict[str, Any]] = Field(default_factory=dict)
