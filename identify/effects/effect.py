"""What is a piece of missing physics, so that one file holds all of it?

An effect is a stage with its story: equation, parameters with units and the value that means "absent", where it may
sit, how to start it from the evidence, what it is confused with, and its sentence for the operator. Fitting, the
catalogue, the README table and the tests follow from that file alone.
"""

from abc import abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar, Self

import numpy as np

from identify.chain import Chain
from identify.stage import Grid, Parameter, Place, Stage
from identify.trace import Array

if TYPE_CHECKING:
    from identify.evidence import Evidence
    from identify.innovations import Wander
    from identify.observe import Observation

SMALL = 0.1  # of a sample: a time that acts in proportion to itself
BESIDE = {  # where else a linear law may be with no F between: one that is put at F is behind it
    Place.SOURCE: (Place.G1,), Place.G1: (Place.SOURCE,), Place.F: (Place.G2, Place.SENSE), Place.G2: (Place.SENSE,),
    Place.SENSE: (Place.G2,),
}  # fmt: skip
STRONGER = {0.0: 2.0, float("inf"): 0.5}  # the factor by which a value that is absent there makes an effect stronger


@dataclass(frozen=True)
class Confusion:
    """An effect that looks nearly the same, and the experiment that would tell the two apart.

    ``exact``: behind a play operator the two give the same data, whatever is played. ``here`` and ``there`` are the
    places of this effect and of the other for which the sentence holds, where either may sit at several (None: any).
    """

    id: str
    would_separate: str
    exact: bool = False
    here: Place | None = None
    there: Place | None = None


@dataclass(frozen=True)
class Effect(Stage):
    """One piece of physics at one place in one form; the class carries what is true of it everywhere.

    ``placed`` says that its place is part of its name: the chain has the same law at another place, too.
    """

    place: Place
    form: str = ""
    placed: bool = False

    id: ClassVar[str]
    title: ClassVar[str]
    equation: ClassVar[str]
    sentence: ClassVar[str]  # what the operator reads; {names} of parameters are filled with value and unit
    axis: ClassVar[str]  # the coordinate along which it acts, as in "level of w"
    fingerprint: ClassVar[str]
    places: ClassVar[tuple[Place, ...]]
    brings: ClassVar[tuple[str, ...]] = ()  # ids of blemishes of the readings that are its own doing
    elsewhere: ClassVar[Mapping[Place, str]] = {}  # where the same law would be other physics, and its id if it has one
    by_chance: ClassVar[bool] = False  # whether its law is only the mean of what it does, and ``course`` one of many
    excludes: ClassVar[tuple[str, ...]] = ()  # ids of physics beside which nothing is known of what it does
    compared: ClassVar[bool] = False  # whether no slope leads from one size of it to another: all are compared
    linear: ClassVar[bool] = False  # whether it is a linear block that stays what it is
    shapeless: ClassVar[bool] = False  # whether what it does may show to no correction of free form
    forms: ClassVar[tuple[str, ...]] = ("",)
    declared: ClassVar[tuple[Parameter, ...]]
    absent: ClassVar[Mapping[str, float]]  # by short name
    confused_with: ClassVar[tuple[Confusion, ...]] = ()
    example: ClassVar[Mapping[str, float]]  # values on the op-amp rig that must be found, by short name

    @property
    def name(self) -> str:  # type: ignore[override]  # the id owns the parameters
        """Return the owner of the parameters: the id, or ``id@stage`` of a second one."""
        return f"{self.id}@{self.place.label}" if self.placed else self.id

    @property
    def shows_at(self) -> Place:
        """Return the place behind which the signal is another: its own, unless the effect shows only further on."""
        return self.place

    @property
    def along(self) -> str:
        """Return the coordinate along which it acts at its place: ``axis``, unless that names the signal of another."""
        return self.axis

    def parameters(self) -> tuple[Parameter, ...]:
        """Return the declared parameters as its own; forms with fewer override this."""
        return self.own(self.declared)

    def own(self, parameters: Iterable[Parameter]) -> tuple[Parameter, ...]:
        """Return parameters under the name of their owner."""
        return tuple(replace(p, name=self.called(p)) if self.placed else p for p in parameters)

    def called(self, parameter: Parameter) -> str:
        """Return the full name that a declared parameter has in a chain."""
        return f"{self.name}.{short(parameter.name)}"

    def freedom(self, runs: int) -> int:
        """Return how many numbers noise alone could use in as many runs: of most laws as many as they have."""
        return sum(runs if p.local else 1 for p in self.parameters())

    @classmethod
    def variants(cls) -> Iterator[Self]:
        """Yield the effect at every place in every form."""
        for place in cls.places:
            for form in cls.forms:
                yield cls(place, form)

    def fuller(self) -> list[Self]:
        """Return the forms at the same place that have all parameters of this one and more."""
        return [form for form in self._forms() if form._contains(self)]

    def simpler(self) -> list[Self]:
        """Return the forms at the same place that have some of the parameters of this one and no others."""
        return [form for form in self._forms() if self._contains(form)]

    def _forms(self) -> list[Self]:
        """Return all forms at this place."""
        return [replace(one, placed=self.placed) for one in self.variants() if one.place == self.place]

    def _contains(self, other: Self) -> bool:
        own, others = set(self.parameters()), set(other.parameters())
        return others < own and _words(other.form) <= _words(self.form)

    def named(self, values: Mapping[str, float]) -> dict[str, float]:
        """Return ``values`` by full name, absent ones filled in from the value that means absent."""
        shared = {p.name: values.get(short(p.name), self.absent[short(p.name)]) for p in self.parameters()}
        return shared | {f"{self.name}.{key}": value for key, value in values.items() if "[" in key}

    @property
    def equals(self) -> tuple[Confusion, ...]:
        """Return what gives the same data as this at its place behind a play operator, whatever is played."""
        return tuple(c for c in self.confused_with if c.exact and c.here in (None, self.place))

    @property
    def same_at(self) -> tuple[Place, ...]:
        """Return the places at which this law gives the same data, its own first: linear blocks may change places."""
        return (self.place, *BESIDE[self.place]) if self.linear else (self.place,)

    def applicable(self, chain: Chain) -> bool:
        """Return whether the effect can be put into ``chain``: not twice at a place, nor where it has no meaning."""
        return self.fits(effect for effect in chain.added if isinstance(effect, Effect))

    def fits(self, others: "Iterable[Effect]") -> bool:
        """Return whether a chain can have this effect beside others: each once at a place, under a name of its own.

        Nor where one of the two excludes the other.
        """
        known = list(others)
        alone = all(e.name != self.name and (e.id, e.place) != (self.id, self.place) for e in known)
        return alone and self.excluded(known) is None

    def excluded(self, others: "Iterable[Effect]") -> "Effect | None":
        """Return the first of others that this one excludes, or that excludes it; None where they may stand together.
        """
        return next((e for e in others if e.id in self.excludes or self.id in e.excludes), None)

    def told_apart(self, chain: Chain) -> Self:
        """Return the effect under the name it has in ``chain``: with its place where that has the same law elsewhere.
        """
        taken = any(e.name == self.name and e.place != self.place for e in chain.added if isinstance(e, Effect))
        return replace(self, placed=True) if taken else self

    def plausible(self, chain: Chain, observations: "Sequence[Observation]") -> bool:
        """Return whether a part could be as the values in a chain say, where the recordings go."""
        return True

    def ordinary(self, chain: Chain) -> bool:
        """Return whether this law, as a chain has it, is also that of much that no catalogue lists."""
        return False

    def put_in(self, chain: Chain, values: Mapping[str, float]) -> Chain:
        """Return ``chain`` with this effect in it; ``values`` by short name."""
        return chain.with_stage(self, self.named(values)).crediting(self)

    def upright(self, chain: Chain) -> Chain:
        """Return ``chain`` with this effect's values in their one form, where several say the same; itself if so."""
        return chain

    def resettled(self, chain: Chain, observations: "Sequence[Observation]") -> Chain:
        """Return ``chain`` with values of this effect to which no slope leads looked for anew, beside all the rest.

        Itself where there are none.
        """
        return chain

    def leaps(self, chain: Chain, observations: "Sequence[Observation]") -> list[Chain]:
        """Return ``chain`` with values of this effect to which no slope leads, to be fitted together with all the rest.

        Where the rest takes up most of what such a value changes, it must move to tell whether that is better.
        """
        return []

    def completed(self, chain: Chain, evidence: "Evidence") -> Chain:
        """Return ``chain`` with this effect's values that say there is none put where a search may begin; else itself.

        A form with fewer parameters has left them there, and no step leads away.
        """
        return chain

    def plainer(self, chain: Chain) -> "tuple[Effect, dict[str, float]] | None":
        """Return another law with fewer numbers, and its values by full name, that this one hardly differs from there.

        None where the values of ``chain`` are not near such a limit.
        """
        return None

    @property
    def lags(self) -> bool:
        """Return whether it makes quick signals late: plain time constants and delays stand in for that."""
        return self.quick and any("s" in p.unit and self._vanishes(p) for p in self.parameters())

    def _vanishes(self, parameter: Parameter) -> bool:
        """Return whether a parameter says at one end that there is no such effect, and is the stronger to the other."""
        return parameter.coordinate == "log" and self.absent[short(parameter.name)] in STRONGER

    def doubled(self, chain: Chain) -> Chain:
        """Return ``chain`` with this effect's lags twice as long (its corners half as high); itself if it has none."""
        logs = [p for p in self.parameters() if self._vanishes(p)]
        values = {p.name: STRONGER[self.absent[short(p.name)]] * chain.values[p.name] for p in logs}
        return chain.with_values(values) if values else chain

    def course(self, values: Sequence[float], grid: Grid, size: int, rng: np.random.Generator) -> Array:
        """Return one course that physics ruled by chance may take, V, shape (size,): noise behind its place."""
        raise NotImplementedError(f"{self.id} is not ruled by chance")

    def wander(self, chain: Chain, observation: "Observation") -> "Wander":
        """Return how what physics ruled by chance does wanders in a run, of which a chain has the mean."""
        raise NotImplementedError(f"{self.id} is not ruled by chance")

    @abstractmethod
    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the values, by short name, from which a search may begin; empty when nothing speaks for the effect."""

    def timed(self, evidence: "Evidence", name: str, tried: Sequence[float]) -> list[dict[str, float]]:
        """Return the time that explains most: one of those tried, in samples, or one that a small one points to.

        A small one acts in proportion to itself: its best size is known from one trial. Empty where there is none.
        """
        return self.likeliest(evidence, name, SMALL * evidence.sample_s, [n * evidence.sample_s for n in tried])

    def likeliest(
        self, evidence: "Evidence", name: str, small: float, tried: Sequence[float]
    ) -> list[dict[str, float]]:
        """Return the value that explains most: one of those tried, or the one that a ``small`` one points to."""
        found = evidence.proportion(self, name, small)
        options = [found] if found and found[name] > 0.0 else []
        best = evidence.best(self, [*options, *({name: float(value)} for value in tried)])
        return [best] if best else []


def short(name: str) -> str:
    """Return a parameter's name without its owner."""
    return name.rpartition(".")[2]


def _words(form: str) -> set[str]:
    """Return the words of a form; what is on both sides is on either."""
    words = set(form.replace(",", "").split())
    return words | {"upper", "lower"} if "both" in words else words
