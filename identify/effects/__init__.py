"""Which physics is known, and how does a model that names some of it become a chain?"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from inspect import isabstract
from pkgutil import iter_modules

from identify.chain import Chain, plain_chain
from identify.effects.effect import Effect, short
from identify.model import Model, Physics
from identify.stage import Place, Stage
from identify.trace import Intersample
from identify.unnamed import stored
from identify.unnamed.correction import Correction
from identify.unnamed.stored import KINDS, is_unnamed, kind_of, piece_of, with_unnamed

GROUP = "identify.effects"


@cache
def catalogue() -> dict[str, type[Effect]]:
    """Return every effect by id: those of this package, one a file, and those that are installed as plug-ins.

    Raises ValueError when a plug-in is not an effect, its name is not its id, or its id is taken.
    """
    modules = [import_module(f"{__name__}.{module.name}") for module in iter_modules(__path__)]
    found = {kind.id: kind for module in modules for kind in vars(module).values() if _is_own(kind, module.__name__)}
    for entry in entry_points(group=GROUP):
        effect = entry.load()
        if not (isinstance(effect, type) and issubclass(effect, Effect) and effect.id == entry.name):
            raise ValueError(f"entry point {entry.name} of group {GROUP} is {effect!r}, not the effect of that id")
        if effect.id in found:
            raise ValueError(f"entry point {entry.name} of group {GROUP}: the catalogue has an effect of that id")
        found[effect.id] = effect
    return dict(sorted(found.items()))


def _is_own(kind: object, module: str) -> bool:
    """Return whether ``kind`` is an effect that ``module`` defines, not one it imports."""
    return isinstance(kind, type) and issubclass(kind, Effect) and kind.__module__ == module and not isabstract(kind)


def effect_of(piece: Physics) -> Effect:
    """Return the effect a model names, at its place and in its form; ValueError for what the catalogue has not."""
    kind = catalogue().get(piece.id)
    if kind is None:
        raise ValueError(f"no effect {piece.id!r} in the catalogue ({', '.join(catalogue())})")
    place = Place.of(piece.stage) if piece.stage else kind.places[0]
    form = piece.form or kind.forms[0]
    if place not in kind.places or form not in kind.forms:
        known = ", ".join(p.label for p in kind.places)
        raise ValueError(
            f"{piece.id} has no form {form!r} at {place.label}; stages: {known}; forms: {', '.join(kind.forms)}"
        )
    return kind(place, form)


def would_separate(name: str, stage: str, other: str, there: str) -> str:
    """Return the experiment that tells two effects at their stages apart, whichever of them says so; empty for none."""
    for one, here, two, at in ((name, stage, other, there), (other, there, name, stage)):
        for c in catalogue()[one].confused_with if one in catalogue() else ():
            if c.id == two and all(p is None or p.label == s for p, s in ((c.here, here), (c.there, at))):
                return c.would_separate
    return ""


@dataclass(frozen=True)
class Choices:
    """The words a model may choose among: stages and forms, the first of each where it does not say."""

    stages: tuple[str, ...]
    forms: tuple[str, ...]


def choices(name: str, form: str = "") -> Choices:
    """Return where a piece of physics may be and which forms it may have; ValueError for what is not known."""
    if is_unnamed(name):
        return Choices(tuple(place.label for place in kind_of(form).places), tuple(KINDS))
    kind = effect_of(Physics(name, {})).__class__
    return Choices(tuple(place.label for place in kind.places), kind.forms)


def units_of(piece: Physics) -> dict[str, str]:
    """Return the SI unit of every value a piece of physics may have, by short name."""
    if is_unnamed(piece.id):
        return stored.units_of(piece)
    return {short(p.name): p.unit for p in effect_of(piece).parameters()}


def with_physics(chain: Chain, physics: Iterable[Physics]) -> Chain:
    """Return ``chain`` with pieces of physics put into it; ValueError for a value an effect does not have."""
    for piece in physics:
        if is_unnamed(piece.id):
            chain = with_unnamed(chain, piece)
            continue
        effect, others = effect_of(piece).told_apart(chain), [e for e in chain.added if isinstance(e, Effect)]
        if (other := effect.excluded(others)) is not None:
            raise ValueError(f"{piece.id} beside {other.id}: what one makes of the other is not modelled; give one")
        if not effect.fits(others):
            raise ValueError(f"{piece.id} at {effect.place.label} twice: put all of it into one")
        known = [short(p.name) for p in effect.parameters()]
        for name in piece.values:
            if name.partition("[")[0] not in known:
                raise ValueError(f"{piece.id} has no value {name!r}; its values: {', '.join(known)}")
        chain = effect.put_in(chain, piece.values)
    return chain


def whereabouts(piece: Physics) -> tuple[str, str]:
    """Return what a piece of physics is and at which stage, where it does not say: at the first it may be at."""
    return piece.id, piece.stage or choices(piece.id, piece.form).stages[0]


def owner_in(chain: Chain, piece: Physics) -> str:
    """Return after what the values of a piece of physics are named in a chain that has it."""
    effects = (e for e in chain.added if isinstance(e, Effect))
    return next((e.name for e in effects if (e.id, e.place.label) == whereabouts(piece)), piece.id)


def owners(physics: Iterable[Physics]) -> tuple[str, ...]:
    """Return after what the values of every piece are named: its id, or ``id@stage`` where that is taken."""
    found: list[str] = []
    for piece in physics:
        found.append("@".join(whereabouts(piece)) if piece.id in found else piece.id)
    return tuple(found)


def chain_of(model: Model, intersample: Intersample = "held") -> Chain:
    """Return the chain of a model: its blocks and the physics it already knows."""
    return with_physics(plain_chain(model, intersample), model.physics)


def physics_in(chain: Chain) -> tuple[Physics, ...]:
    """Return the physics put into a chain, with its values."""
    pieces = (piece_of(e, chain) if isinstance(e, Correction) else _physics(e, chain) for e in chain.added)
    return tuple(piece for piece in pieces if piece is not None)


def _physics(effect: Stage, chain: Chain) -> Physics | None:
    """Return one effect as a model keeps it, with the values some of its parameters have in single runs."""
    if not isinstance(effect, Effect):
        return None
    own = {p.name for p in effect.parameters()}
    values = {
        name.removeprefix(f"{effect.name}."): value
        for name, value in chain.values.items()
        if name.partition("[")[0] in own
    }
    return Physics(effect.id, values, effect.place.label, effect.form)
