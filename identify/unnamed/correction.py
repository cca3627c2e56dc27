"""What is a piece of physics whose place and shape are known, but not its name?

A correction is a stage of free form: a sum of fixed shapes, each times a weight. The shapes belong to knots along the
coordinate on which it acts, so knots and weights are all there is to store.
"""

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from identify.blocks import Play
from identify.chain import Chain
from identify.stage import Grid, Parameter, Place, Run, Shape, Stage, Values
from identify.trace import Array

UNNAMED = "unnamed"


@dataclass(frozen=True)
class Correction(Stage):
    """Something free added at a place; ``knots`` are in ``knot_unit`` along the coordinate it acts on, rising."""

    place: Place
    knots: tuple[float, ...] = ()
    name: str = UNNAMED
    sums = True
    form: ClassVar[str]  # what it is called in a stored model
    kind: ClassVar[str]  # what it is, as a sentence needs it
    equation: ClassVar[str]
    knot_unit: ClassVar[str]
    weights: ClassVar[tuple[tuple[str, str], ...]] = (("add", "V"),)  # what belongs to every knot, and its unit
    places: ClassVar[tuple[Place, ...]]
    constants: ClassVar[tuple[tuple[str, str], ...]] = ()  # fields beside the knots that are not fitted; their units
    local: ClassVar[bool] = False  # whether every run has weights of its own
    curved: ClassVar[bool] = True  # whether weights against knots draw its shape
    least: ClassVar[int] = 2  # knots
    even: ClassVar[bool] = False  # whether the knots must be evenly spaced
    plainly: ClassVar[str] = ""  # the form of what it nearly is where it does not depend on what it might
    single: ClassVar[bool] = False  # whether one knot that is sought may do in the place of several
    jumps: ClassVar[bool] = False  # whether what it does jumps as that one knot moves: it switches there
    dynamics: ClassVar[bool] = False  # whether it is what a linear block is made of, and first of all of its own
    searched: ClassVar[bool] = False  # whether the knot is the one frequency of all at which most is seen
    at_once: ClassVar[bool] = False  # whether what it does to v it does to both borders: F compares at once

    @property
    @abstractmethod
    def axis(self) -> str:
        """Return the coordinate along which it acts."""

    def parameters(self) -> tuple[Parameter, ...]:
        """Return the weights: ``NAME.add1``, ``NAME.add2`` ... in the order of the knots."""
        return tuple(
            Parameter(f"{self.name}.{word}{i}", unit, local=self.local)
            for word, unit in self.weights for i in self.numbers
        )  # fmt: skip

    @property
    def numbers(self) -> range:
        """Return the numbers of the knots, from 1."""
        return range(1, len(self.knots) + 1)

    @property
    def absent(self) -> dict[str, float]:
        """Return the weights that change nothing, by full name."""
        return {p.name: 0.0 for p in self.parameters()}

    @property
    def same_at(self) -> tuple[Place, ...]:
        """Return the places at which this gives the same data, its own first: what G2 puts out is what is read."""
        alike = {Place.G2: (Place.SENSE,), Place.SENSE: (Place.G2,), Place.G1: (Place.F,) if self.at_once else ()}
        return (self.place, *alike.get(self.place, ()))

    @property
    def nearly_at(self) -> tuple[Place, ...]:
        """Return further places at which this gives nearly the same data."""
        return ()

    @property
    def like_at(self) -> tuple[Place, ...]:
        """Return the places at which this gives the same data or nearly so, its own first."""
        return (*self.same_at, *self.nearly_at)

    def applicable(self, chain: Chain) -> bool:
        """Return whether there is something in ``chain`` to put it on."""
        return True

    def only_knot(self, start_s: float, stop_s: float) -> int | None:
        """Return the index of the one knot that all between two clock times hangs on; None where several may be."""
        return None

    def put_in(self, chain: Chain, values: Mapping[str, float] | None = None) -> Chain:
        """Return ``chain`` with this correction in it; ``values`` by full name, those not given change nothing."""
        return chain.with_stage(self, self.absent | dict(values or {})).crediting(self)

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the running sum; absent weights cost nothing."""
        if not any(values):
            return (lambda block: block.signal), shape
        return self.summed(values, grid), shape

    def summed(self, values: Values, grid: Grid) -> Run:
        """Return the running signal plus the weighted shapes."""
        raise NotImplementedError(f"{self.form} has no stage of its own")

    def split(self, values: Values) -> list[Array]:
        """Return the weights of every word at all knots, shape (knots,) each."""
        return list(np.array(values).reshape(len(self.weights), len(self.knots)))


@dataclass(frozen=True)
class PlayCorrection(Correction):
    """A correction of how the play operator itself works: it takes the operator's place."""

    places: ClassVar[tuple[Place, ...]] = (Place.F,)

    @property
    def axis(self) -> str:
        """Return the coordinate: the branch, for what goes with nothing else."""
        return "branch"

    def applicable(self, chain: Chain) -> bool:
        """Return whether F is the plain play operator."""
        return type(chain.stage_of(Play)) is Play

    def put_in(self, chain: Chain, values: Mapping[str, float] | None = None) -> Chain:
        """Return ``chain`` with its play operator corrected; ValueError when it has none."""
        play = chain.stage_of(Play)
        if play is None:
            raise ValueError(f"{self.form}: it needs a backlash in F")
        corrected = CorrectedPlay(play.start, correction=self)
        return chain.with_replaced(play, corrected, self.absent | dict(values or {})).crediting(self)

    @abstractmethod
    def played(self, borders: Values, values: Values, grid: Grid) -> Run:
        """Return the running operator with borders S_L, D_L, S_U, D_U and the weights of the correction."""


@dataclass(frozen=True)
class CorrectedPlay(Play):
    """The play operator with a correction in it."""

    correction: PlayCorrection | None = None

    def parameters(self) -> tuple[Parameter, ...]:
        """Return the borders, then the weights."""
        assert self.correction is not None
        return (*super().parameters(), *self.correction.parameters())

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the running operator; absent weights leave the plain one."""
        assert self.correction is not None
        if not any(values[4:]):
            return Play(self.start).begin(values[:4], grid, shape)
        return self.correction.played(values[:4], values[4:], grid), shape
