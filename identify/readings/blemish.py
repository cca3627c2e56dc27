"""What is a blemish of the readings, so that one file holds all of it, as one file holds all of an effect?"""

from abc import ABC
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from identify.effects.effect import Confusion
from identify.interval import Interval
from identify.stage import Parameter, Place


@dataclass(frozen=True)
class Blemish(ABC):
    """Something found in the readings: its values with intervals, and how likely chance alone would show it.

    ``where`` says in which recordings, in words; ``p_value`` is that of readings not used to find it where there are
    such, with every place it was looked for at paid. ``span`` are the ends of the stretch of its axis where it is, and
    which share of it, where that is known.
    """

    values: Mapping[str, Interval]
    p_value: float
    where: str = ""
    span: tuple[float, float, float] | None = None

    id: ClassVar[str]
    title: ClassVar[str]
    form: ClassVar[str] = ""  # what kind of it, where the id does not say
    equation: ClassVar[str]
    sentence: ClassVar[str]  # what the operator reads; {} is filled with the values and where they are
    axis: ClassVar[str]
    fingerprint: ClassVar[str]
    places: ClassVar[tuple[Place, ...]] = (Place.SENSE,)
    declared: ClassVar[tuple[Parameter, ...]]
    confused_with: ClassVar[tuple[Confusion, ...]] = ()
    alone: ClassVar[bool] = False  # whether the readings alone tell of it, whatever the model

    @property
    def undone(self) -> tuple[object, ...]:
        """Return all on which it hangs how it is undone: what is alike in that leaves the same readings."""
        return (self.id, self.where, *(value.value for value in self.values.values()))
