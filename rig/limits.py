"""How far may the output go, where protocol and rig file both set limits?"""

from dataclasses import dataclass, field
from typing import Annotated

from pydantic import ConfigDict, Field, model_validator

from rig.errors import MisfitError
from rig.forms import Form, Volts, VoltsPerSecond, either


@dataclass(frozen=True)
class Limits:
    """What the rig can take at its input: levels in V, the slope in V/s where it matters.

    ``narrowed_by`` names who else than the protocol set any of them, for messages.
    """

    low_v: float
    high_v: float
    slew_v_per_s: float | None = None
    narrowed_by: str = field(default="", compare=False)

    @property
    def levels(self) -> str:
        """Return the levels as messages tell them."""
        return f"{self.low_v:g} to {self.high_v:g} V{self._whose}"

    @property
    def slope(self) -> str:
        """Return the steepest slope as messages tell it."""
        steepest = "any slope" if self.slew_v_per_s is None else f"at most {self.slew_v_per_s:g} V/s"
        return f"{steepest}{self._whose}"

    @property
    def _whose(self) -> str:
        return f" (narrowed by {self.narrowed_by})" if self.narrowed_by else ""

    def within(self, other: "Limits | None", whose: str) -> "Limits":
        """Return the narrower on each side, ``other`` being those of ``whose``; raise MisfitError when none is left."""
        if other is None:
            return self
        low_v, high_v = max(self.low_v, other.low_v), min(self.high_v, other.high_v)
        slews = [slew for slew in (self.slew_v_per_s, other.slew_v_per_s) if slew is not None]
        if low_v > high_v:
            raise MisfitError("protocol and rig allow no common level", value=self.levels,
                              allowed=f"{other.levels} in {whose}", do="correct the limits of either")
        both = Limits(low_v, high_v, min(slews, default=None))
        return self if both == self else Limits(low_v, high_v, both.slew_v_per_s, whose)


class LimitsForm(Form):
    """``level`` on both sides of 0 V, or ``low`` and ``high``."""

    model_config = ConfigDict(json_schema_extra=either(("level",), ("low", "high")))
    level: Annotated[Volts, Field(gt=0)] | None = None
    low: Volts | None = None
    high: Volts | None = None
    slew: VoltsPerSecond | None = None

    @model_validator(mode="after")
    def _one_way(self) -> "LimitsForm":
        sides = (self.low is not None, self.high is not None)
        if (self.level is None) == (not any(sides)) or any(sides) != all(sides):
            raise MisfitError("limits are given in one of two ways", allowed="level, or low and high")
        if self.low is not None and self.high is not None and self.low >= self.high:
            raise MisfitError("the limits are exchanged", value=f"low {self.low:g} V, high {self.high:g} V")
        return self

    def limits(self) -> Limits:
        """Return the limits as low and high."""
        if self.low is not None and self.high is not None:
            return Limits(self.low, self.high, self.slew)
        assert self.level is not None
        return Limits(-self.level, self.level, self.slew)
