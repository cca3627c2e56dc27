"""Which physics is known, and how does a model that names some of it become a chain?"""

from collections.abc import Iterable
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from inspect import isabstract
from pkgutil import iter_modules

from identify.chain import Chain, plain_chain
from identify.effects.effect import Effect, short
from identify.model import Model, Physics
from identify.stage import Place
from identify.trace import Intersample

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


def with_physics(chain: Chain, physics: Iterable[Physics]) -> Chain:
    """Return ``chain`` with pieces of physics put into it; ValueError for a value an effect does not have."""
    for piece in physics:
        effect = effect_of(piece)
        known = [short(p.name) for p in effect.parameters()]
        for name in piece.values:
            if name.partition("[")[0] not in known:
                raise ValueError(f"{piece.id} has no value {name!r}; its values: {', '.join(known)}")
        chain = effect.put_in(chain, piece.values)
    return chain


def chain_of(model: Model, intersample: Intersample = "held") -> Chain:
    """Return the chain of a model: its blocks and the physics it already knows."""
    return with_physics(plain_chain(model, intersample), model.physics)


def physics_in(chain: Chain) -> tuple[Physics, ...]:
    """Return the physics put into a chain, with its values."""
    return tuple(_physics(effect, chain) for effect in chain.added if isinstance(effect, Effect))


def _physics(effect: Effect, chain: Chain) -> Physics:
    """Return one effect as a model keeps it, with the values some of its parameters have in single runs."""
    own = {p.name for p in effect.parameters()}
    values = {
        name.removeprefix(f"{effect.id}."): value
        for name, value in chain.values.items()
        if name.partition("[")[0] in own
    }
    return Physics(effect.id, values, effect.place.label, effect.form)
