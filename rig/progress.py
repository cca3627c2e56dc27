"""How does a long job say how far it is, to whoever listens?"""

from collections.abc import Callable, Iterable, Iterator, Sequence

Show = Callable[[str, float], None]
"""Told what is being done, and which share of the whole is over."""


def silent(sentence: str, share: float) -> None:
    """Tell nobody."""


def told(stretches: Iterable[tuple[int, int]], of: int, what: str, show: Show) -> Iterator[tuple[int, int]]:
    """Yield stretches [start, stop) of ``of`` samples, each told when it is begun."""
    for start, stop in stretches:
        show(f"{what}: {start} of {of} samples", start / max(of, 1))
        yield start, stop


def each(names: Sequence[str], show: Show) -> Iterator[tuple[str, Show]]:
    """Yield every name, which is told when it is begun, and what tells how far it is as a part of all."""
    for at, name in enumerate(names):
        show(name, at / len(names))
        yield name, _part(show, name, at, len(names))


def _part(show: Show, name: str, at: int, of: int) -> Show:
    return lambda sentence, share: show(f"{name}: {sentence}", (at + share) / of)
