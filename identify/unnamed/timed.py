"""Which free-form laws act by time: a drift of the offset, of the gain, of the gap, or of the dynamics?

Time is the clock, on which a table is straight between its knots, or holds from one knot to the next, as where somebody
touches a rig between runs; or it is counted from the start of every run, as where a rig warms up once it is on.
"""

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from identify.blocks import run_linear
from identify.discretise import stepper
from identify.stage import Block, Grid, Place, Run, Values
from identify.trace import Array
from identify.unnamed.correction import Correction
from identify.unnamed.what import Gain, Gap, Going, Lead, Offset


def passed_on(place: Place) -> tuple[Place, ...]:
    """Return the place in front of G1 or G2 for what is behind: a linear block passes on a gain that holds in a run."""
    return {Place.G1: (Place.SOURCE,), Place.SENSE: (Place.F,)}.get(place, ())


@dataclass(frozen=True)
class PassedOn(Gain):
    """A gain that holds in every run: it is the same in front of a linear block and behind it."""

    @property
    def same_at(self) -> tuple[Place, ...]:
        """Return the places at which this gives the same data, its own first."""
        return (*super().same_at, *passed_on(self.place))

    @property
    def nearly_at(self) -> tuple[Place, ...]:
        """Return no further place."""
        return ()


@dataclass(frozen=True)
class Timed(Going):
    """A course that is a table over time."""

    knot_unit = "s"
    counted: ClassVar[Literal["drifts", "holds", "in a run"]] = "drifts"

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return "time in a run" if self.counted == "in a run" else "clock time"

    @property
    def nearly_at(self) -> tuple[Place, ...]:
        """Return the place before G1 or G2: what is slow goes through them nearly as it is."""
        return passed_on(self.place)

    def only_knot(self, start_s: float, stop_s: float) -> int | None:
        """Return the index of the one knot that all between two clock times hangs on; None where several may be."""
        first, last = np.maximum(np.searchsorted(self.knots, (start_s, stop_s), side="right") - 1, 0).tolist()
        return first if self.counted == "holds" and first == last else None

    def course(self, weights: Values | Array, grid: Grid) -> Run:
        """Return the running table."""
        if self.counted == "in a run":
            return lambda block: np.interp(block.time_s() - block.grid.start_s, self.knots, weights)
        if self.counted == "drifts":
            return lambda block: np.interp(block.time_s(), self.knots, weights)
        at = np.array(weights)
        return lambda block: at[np.maximum(np.searchsorted(self.knots, block.time_s(), side="right") - 1, 0)]


@dataclass(frozen=True)
class OffsetOverClock(Timed, Offset):
    """A zero that drifts."""

    form = "drift of the offset"
    kind = "a drift of the offset"
    equation = "s' = s + c(t), c straight between the knots, t the clock"
    places = (Place.G1, Place.F, Place.SENSE)


@dataclass(frozen=True)
class Moments(OffsetOverClock):
    """A table over clock time that is zero but at single moments."""

    form = "single moments"
    kind = "something that happens at single moments"


@dataclass(frozen=True)
class OffsetSteps(OffsetOverClock):
    """An offset that is another from one run to the next."""

    form = "offset by runs"
    kind = "an offset that changes between runs"
    equation = "s' = s + c(t), c held from knot to knot, t the clock"
    counted = "holds"


@dataclass(frozen=True)
class OffsetInRun(OffsetOverClock):
    """An offset that goes with the time since a run began."""

    form = "offset within a run"
    kind = "an offset that comes anew in every run"
    equation = "s' = s + c(t), c straight between the knots, t from the start of a run"
    counted = "in a run"


@dataclass(frozen=True)
class GainOverClock(Timed, Gain):
    """A gain that drifts."""

    form = "drift of the gain"
    kind = "a drift of the gain"
    equation = "s' = s (1 + c(t)), c straight between the knots, t the clock"
    weights = (("grow", "V/V"),)
    places = (Place.G1, Place.F, Place.SENSE)


@dataclass(frozen=True)
class GainSteps(PassedOn, GainOverClock):
    """A gain that is another from one run to the next."""

    form = "gain by runs"
    kind = "a gain that changes between runs"
    equation = "s' = s (1 + c(t)), c held from knot to knot, t the clock"
    counted = "holds"


@dataclass(frozen=True)
class GainInRun(GainOverClock):
    """A gain that goes with the time since a run began."""

    form = "gain within a run"
    kind = "a gain that drifts anew in every run"
    equation = "s' = s (1 + c(t)), c straight between the knots, t from the start of a run"
    counted = "in a run"


@dataclass(frozen=True)
class GapOverClock(Timed, Gap):
    """A gap that grows or shrinks with time: wear, warmth."""

    form = "drift of the gap"
    kind = "a drift of the gap"
    equation = "D_L + c_L(t), D_U - c_U(t), both straight between the knots, t the clock"
    weights = (("L", "V"), ("U", "V"))


@dataclass(frozen=True)
class GapSteps(GapOverClock):
    """A gap that is another from one run to the next."""

    form = "gap by runs"
    kind = "a gap that changes between runs"
    equation = "D_L + c_L(t), D_U - c_U(t), both held from knot to knot, t the clock"
    counted = "holds"


@dataclass(frozen=True)
class GapInRun(GapOverClock):
    """A gap that goes with the time since a run began."""

    form = "gap within a run"
    kind = "a gap that drifts anew in every run"
    equation = "D_L + c_L(t), D_U - c_U(t), both straight between the knots, t from the start of a run"
    counted = "in a run"


@dataclass(frozen=True)
class LeadOverClock(Timed, Lead):
    """A delay that wanders, as where the clock of the readings does."""

    form = "drift of the delay"
    kind = "a delay that wanders"
    equation = "s'(t) = s(t + c(t)), c straight between the knots, t the clock"
    weights = (("lead", "s"),)
    places: ClassVar[tuple[Place, ...]] = (Place.SENSE,)

    @property
    def nearly_at(self) -> tuple[Place, ...]:
        """Return no other place: what G2 puts out is what is read, and in front of it a delay is another."""
        return ()


@dataclass(frozen=True)
class LeadSteps(LeadOverClock):
    """Dynamics that are others from one run to the next: as far as a delay stands for them, which all lags do."""

    form = "delay by runs"
    kind = "dynamics that change between runs"
    equation = "s'(t) = s(t + c(t)), c held from knot to knot, t the clock"
    counted: ClassVar[Literal["drifts", "holds", "in a run"]] = "holds"
    places = (Place.G1, Place.G2)

    @property
    def same_at(self) -> tuple[Place, ...]:
        """Return the places at which this gives the same data, its own first: linear blocks pass a delay on."""
        return (self.place, Place.SOURCE if self.place is Place.G1 else Place.SENSE)


@dataclass(frozen=True)
class LeadInRun(LeadSteps):
    """Dynamics that go with the time since a run began: of a rig that warms up once it is on."""

    form = "delay within a run"
    kind = "dynamics that drift anew in every run"
    equation = "s'(t) = s(t + c(t)), c straight between the knots, t from the start of a run"
    counted = "in a run"


@dataclass(frozen=True)
class Ageing(Correction):
    """Dynamics that drift with the clock: high-passes whose weights grow with it; the last knot is the time it takes.

    What is there from the beginning is dynamics that stay, and of another kind.
    """

    form = "drift of the dynamics"
    kind = "dynamics that drift"
    equation = "s' = s + t / T sum of a_k s tau_k / (1 + s tau_k), T the last knot, t the clock"
    quick = True
    knot_unit = "s"
    weights = (("drift", "V/V"),)
    places = (Place.G1, Place.G2)
    dynamics = True
    curved = False

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return "clock time"

    @property
    def same_at(self) -> tuple[Place, ...]:
        """Return the places at which this gives the same data, its own first: linear blocks pass lags on."""
        return (self.place, Place.SOURCE if self.place is Place.G1 else Place.SENSE)

    @property
    def numbers(self) -> range:
        """Return the numbers of the time constants."""
        return range(1, len(self.knots))

    def grown(self, block: Block) -> Array:
        """Return how far it has come at every instant, 1 at the last knot."""
        return block.time_s() / self.knots[-1]

    def summed(self, values: Values, grid: Grid) -> Run:
        """Return the signal plus the high-passes that grow."""
        passed = [
            (a, run_linear(stepper((tau, 0.0), (tau, 1.0), grid.step_s, "ramp")))
            for a, tau in zip(values, self.knots[:-1], strict=True) if a
        ]  # fmt: skip

        def run(block: Block) -> Array:
            return np.asarray(block.signal + self.grown(block) * sum(a * high(block) for a, high in passed))

        return run
