"""What a stage of the signal path is: the one idea behind simulation, fit and explanation.

A chain runs on instants t[j] = start + j * step. A signal is its value just before each instant. A stage is asked once
to begin and then turns block after block of its input into its output, keeping its own memory between blocks.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from math import inf
from typing import ClassVar, Literal

import numpy as np

from identify.trace import Array


class Place(IntEnum):
    """Where a stage sits on the way from source to sense."""

    SOURCE = 0
    G1 = 1
    F = 2
    G2 = 3
    SENSE = 4

    def __bool__(self) -> bool:
        """Return True: that of the source, too, is a place."""
        return True

    @property
    def label(self) -> str:
        """Return the name used in reports."""
        return self.name.lower() if self in (Place.SOURCE, Place.SENSE) else self.name

    @classmethod
    def of(cls, label: str) -> "Place":
        """Return the place a report calls ``label``; ValueError for another word."""
        for place in cls:
            if place.label == label:
                return place
        raise ValueError(f"no stage {label!r}: source, G1, F, G2, sense")


@dataclass(frozen=True)
class Parameter:
    """One number of a stage: its full name, its SI unit, and the coordinate in which it is searched.

    ``log`` parameters stay positive; ``scale`` is the natural size of a linear one, in its unit.
    ``within`` bounds a log parameter to a factor around its start (None: no bound), ``least`` and ``most`` a linear one
    to what its physics allows.
    ``local`` parameters take a value of their own in every run (the phase of the mains, say).
    ``label`` is what reports call it when the name would not say enough.
    """

    name: str
    unit: str
    coordinate: Literal["log", "linear"] = "linear"
    scale: float = 1.0
    within: float | None = None
    local: bool = False
    label: str = ""
    least: float = -inf
    most: float = inf


@dataclass(frozen=True)
class Grid:
    """The instants of one run: ``substeps`` steps of ``step_s`` to a sample, the first at ``start_s``.

    By ``late_s`` the device reads late whatever the rig does; it is taken with the delay of G2.
    """

    run: str
    step_s: float
    substeps: int = 1
    start_s: float = 0.0
    late_s: float = 0.0


@dataclass(frozen=True)
class Held:
    """A signal constant between instants, whose change arrives ``fraction`` of a step late."""

    fraction: float = 0.0


@dataclass(frozen=True)
class Ramp:
    """A continuous signal, taken as straight between instants."""


Shape = Held | Ramp


@dataclass(frozen=True)
class Block:
    """A stretch of instants on its way down the chain: the signal so far and the source voltage beside it."""

    signal: Array
    source: Array
    first: int
    grid: Grid

    def holding(self, signal: Array) -> "Block":
        """Return the same stretch with another signal."""
        return Block(signal, self.source, self.first, self.grid)

    def time_s(self) -> Array:
        """Return the clock time of every instant in s."""
        instants = np.arange(self.first, self.first + self.signal.size, dtype=np.float64)
        return self.grid.start_s + self.grid.step_s * instants


Run = Callable[[Block], Array]
Values = tuple[float, ...]


class Stage(ABC):
    """One block of the signal path. ``name`` is the owner of its parameters: G1, F, G2 or an effect's id."""

    name: str
    place: Place
    quick: ClassVar[bool] = False  # whether what it does is over within a few samples, and means of them would hide it
    sums: ClassVar[bool] = False  # whether it puts out its input plus shapes of it, each times a value

    @abstractmethod
    def parameters(self) -> tuple[Parameter, ...]:
        """Return what can be fitted, in the order ``begin`` takes the values."""

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Return the names of the parameters: they are asked for at every simulation."""
        return tuple(p.name for p in self.parameters())

    @cached_property
    def local_names(self) -> frozenset[str]:
        """Return the names of those of which every run has its own."""
        return frozenset(p.name for p in self.parameters() if p.local)

    @abstractmethod
    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the running stage, at rest, and the shape of what it puts out."""


def is_fixed(name: str, fixed: Sequence[str]) -> bool:
    """Return whether ``name`` or an owner of it is listed: G1 covers G1.den.s2."""
    return any(name == item or name.startswith(item + ".") for item in fixed)


@dataclass(frozen=True)
class Memoryless:
    """A running stage that applies ``law`` to every value on its own."""

    law: Callable[[Array], Array]

    def __call__(self, block: Block) -> Array:
        """Return the signal behind it."""
        return self.law(block.signal)


class Eightfold(ABC):
    """A running stage, at rest, that can go on eight signals at once, every one with values of its own."""

    @abstractmethod
    def __call__(self, block: Block) -> Array:
        """Return the signal behind it."""

    @staticmethod
    @abstractmethod
    def abreast(runs: "Sequence[Eightfold]") -> Callable[[Array], None]:
        """Return what turns eight signals, shape (8, 8 n), into those behind eight runs of this kind, in their place.
        """


def memoryless(law: Callable[[Array], Array], shape: Shape) -> tuple[Run, Shape]:
    """Return a running stage that applies ``law`` to every value on its own."""
    return Memoryless(law), shape
