"""Which levels does a staircase visit, and how long does it dwell on each?"""

from typing import Annotated

import numpy as np
from pydantic import Field, Tag, model_validator

from rig import stimuli
from rig.errors import MisfitError
from rig.forms import BY_SHAPE, Form, Fraction, PositiveSeconds, Seconds, Volts

MOST_LEVELS = 100_000


class SettleForm(Form):
    """A dwell that lasts until the rig has settled to a fraction of its step, and ``hold`` longer."""

    settle: Fraction
    hold: Seconds = 0.0


class RangeForm(Form):
    """Levels from one to another, both included, in equal steps."""

    start: Volts = Field(alias="from")
    stop: Volts = Field(alias="to")
    step: Annotated[Volts, Field(gt=0)]

    @model_validator(mode="after")
    def _fits(self) -> "RangeForm":
        if abs(self.stop - self.start) > MOST_LEVELS * self.step:
            raise MisfitError("the range has too many levels", value=f"{self.step:g} V a step",
                              allowed=f"up to {MOST_LEVELS} levels", do="take larger steps, or a triangle")
        if not stimuli.is_whole(abs(self.stop - self.start) / self.step):
            raise MisfitError("the range is no whole number of steps", value=f"{self.step:g} V",
                              allowed=f"a step that divides {abs(self.stop - self.start):g} V")
        return self

    def levels(self) -> list[float]:
        """Return the levels in V, each a whole number of steps from the first."""
        count = round(abs(self.stop - self.start) / self.step)
        return [float(level) for level in np.linspace(self.start, self.stop, count + 1)]


Levels = Annotated[Annotated[RangeForm, Tag("mapping")] | Annotated[Volts, Tag("plain")], BY_SHAPE]
Dwell = Annotated[Annotated[SettleForm, Tag("mapping")] | Annotated[PositiveSeconds, Tag("plain")], BY_SHAPE]
