"""How are the public names of a package loaded only when somebody asks for them?"""

from collections.abc import Callable, Mapping
from importlib import import_module


def offered(package: str, homes: Mapping[str, str]) -> tuple[Callable[[str], object], Callable[[], list[str]]]:
    """Return ``__getattr__`` and ``__dir__`` of a package whose public names live in ``homes``: ``module:name`` each.

    A name is looked for where it lives when it is asked for; any other raises AttributeError. What a notebook offers
    behind the dot are these names.
    """

    def get(name: str) -> object:
        if name not in homes:
            raise AttributeError(f"{package} has no {name!r}; it has {', '.join(sorted(homes))}")
        module, _, own = homes[name].partition(":")
        return getattr(import_module(module), own)

    return get, lambda: sorted(homes)
