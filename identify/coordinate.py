"""In which coordinate is a value searched, how far may it go there, and which values are searched at all?"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import exp, inf, isfinite, log

from identify.chain import Chain, local_name
from identify.stage import Parameter, is_fixed

AT_BOUND = 1e-6  # half widths of what is allowed within which a value sits on its bound
WIDE = 3.0  # sd of the prior on a free log coordinate: a factor of 20
WIDE_LINEAR = 10.0  # sd of the prior on a linear coordinate, in units of its scale


@dataclass(frozen=True)
class Coordinate:
    """One searched number: the value's name, and how the search coordinate (0 at the centre) maps to it."""

    name: str
    parameter: Parameter
    centre: float

    def value(self, theta: float) -> float:
        """Return the parameter's value at search coordinate theta."""
        if self.parameter.coordinate == "log":
            return self.centre * exp(min(max(theta, -60.0), 60.0))
        return self.centre + self.parameter.scale * theta

    def theta(self, value: float) -> float:
        """Return the search coordinate of a value."""
        if self.parameter.coordinate == "log":
            return log(value / self.centre)
        return (value - self.centre) / self.parameter.scale

    def slope(self, theta: float) -> float:
        """Return d value / d theta."""
        return self.value(theta) if self.parameter.coordinate == "log" else self.parameter.scale

    @property
    def prior_sd(self) -> float:
        """Return the sd of the prior: weak, so that it only holds what the data say nothing about."""
        if self.parameter.coordinate == "linear":
            return WIDE_LINEAR
        return WIDE if self.parameter.within is None else 1.0

    @property
    def bounds(self) -> tuple[float, float]:
        """Return the least and the largest theta."""
        if self.parameter.within is not None:
            return -log(self.parameter.within), log(self.parameter.within)
        if self.parameter.coordinate == "log":
            return -inf, inf
        return self.theta(self.parameter.least), self.theta(self.parameter.most)

    def bounded(self, theta: float) -> float:
        """Return the theta nearest to ``theta`` that is allowed."""
        return min(max(theta, self.bounds[0]), self.bounds[1])

    def at_bound(self, theta: float, near: float = AT_BOUND) -> bool:
        """Return whether ``theta`` sits on a bound, within ``near`` half widths of what is allowed."""
        low, high = self.bounds
        half = 0.5 * (high - low) if isfinite(high - low) else 1.0
        return min(theta - low, high - theta) <= near * half


def is_absent(parameter: Parameter, value: float) -> bool:
    """Return whether ``value`` says that there is none: no rail at infinity, no delay of 0 s; no step leads from it."""
    return not isfinite(value) or (parameter.coordinate == "log" and value == 0.0)


def coordinates_of(
    chain: Chain, centre: Mapping[str, float], runs: Sequence[str], fixed: Sequence[str] = ()
) -> tuple[Coordinate, ...]:
    """Return what is searched: every parameter neither fixed, tied to another nor absent; local ones in every run."""
    found: list[Coordinate] = []
    held = (*fixed, *(follower for follower, _ in chain.tied))
    for parameter in chain.parameters():
        if is_fixed(parameter.name, held) or is_absent(parameter, centre[parameter.name]):
            continue
        names = [local_name(parameter.name, run) for run in runs] if parameter.local else [parameter.name]
        found += [Coordinate(n, parameter, centre.get(n, centre[parameter.name])) for n in names]
    return tuple(found)
