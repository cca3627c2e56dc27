"""Did physics appear that was not there before - or would the earlier recording not have shown it?

Each side is explained by itself. What one names is tried on the other: a set of effects that does for both, if there
is one, so that two names for the same data are no change; else all of them. Of every effect each side is then asked
whether it needs it, and both together whether its values can be the same.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from scipy.stats import chi2

from identify.compared.change import FALSE_ALARMS
from identify.compared.together import Rise, Side, rise
from identify.effects import owner_in, whereabouts
from identify.explain.explanation import Explanation, Finding
from identify.identification import Identification
from identify.interval import number
from identify.model import Model, Physics
from identify.readings import blemishes

SLACK = 9.0  # of chi-squared, by which another set may fit worse and still do: no more than chance prefers a minimum by

State = Literal["appeared", "disappeared", "changed", "in both", "cannot tell"]
Pieces = tuple[Physics, ...]
Fitted = Callable[[Pieces], Identification]


@dataclass(frozen=True)
class PhysicsChange:
    """What became of one piece of physics; ``same`` asks whether both sides can have it alike (None: of readings)."""

    id: str
    stage: str
    state: State
    sentence: str
    same: Rise | None = None
    could_also_be: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, object]:
        """Return the form of ``rig compare --json``."""
        return {
            "id": self.id, "stage": self.stage, "state": self.state, "sentence": self.sentence,
            "p_same": number(self.same.p_value, 3) if self.same else None,
            "could_also_be": list(self.could_also_be),
        }  # fmt: skip


@dataclass(frozen=True)
class Explained:
    """One side: what explains it, and how it is identified with any set of effects in the model."""

    told: Explanation
    fitted: Fitted

    def own(self, model: Model) -> Pieces:
        """Return the physics found beyond that of the plain model."""
        known = {whereabouts(piece) for piece in model.physics}
        return tuple(piece for piece in self.told.model.physics if whereabouts(piece) not in known)

    def cost(self, pieces: Pieces) -> float:
        """Return chi-squared with a set of effects, prior included."""
        return self.fitted(pieces).fit.cost

    def does(self, pieces: Pieces, own: Pieces) -> bool:
        """Return whether a set of effects does as well as the side's own."""
        return self.cost(pieces) <= self.cost(own) + SLACK * Side.of(self.fitted(own)).wider ** 2

    def needs(self, pieces: Pieces, piece: Physics, tests: int) -> bool:
        """Return whether the data fit worse without one of the effects, by more than chance."""
        with_it = self.fitted(pieces)
        fall = (self.cost(without(pieces, piece)) - with_it.fit.cost) / Side.of(with_it).wider ** 2
        return fall > float(chi2.isf(FALSE_ALARMS / tests, max(len(_coordinates(with_it, piece)), 1)))


def without(pieces: Pieces, piece: Physics) -> Pieces:
    """Return a set of effects less one."""
    return tuple(other for other in pieces if whereabouts(other) != whereabouts(piece))


def with_pieces(model: Model, pieces: Pieces) -> Model:
    """Return the plain model with effects in it."""
    return replace(model, physics=(*model.physics, *pieces))


def sets_tried(before: Pieces, after: Pieces) -> list[Pieces]:
    """Return the sets of effects that may do for both sides, those with fewest effects first."""
    missing = tuple(piece for piece in before if whereabouts(piece) not in {whereabouts(other) for other in after})
    found = {ids_of(pieces): pieces for pieces in (before, after, (*after, *missing))}
    return sorted(found.values(), key=len)


def ids_of(pieces: Pieces) -> tuple[tuple[str, str, str], ...]:
    """Return what a set of effects is, whatever their values."""
    return tuple(sorted((piece.id, piece.stage, piece.form) for piece in pieces))


def shared_set(before: Explained, after: Explained, own: tuple[Pieces, Pieces]) -> Pieces:
    """Return the set of fewest effects that does for both sides; where none does, all of them."""
    options = sets_tried(*own)
    does = (p for p in options if before.does(p, own[0]) and after.does(p, own[1]))
    return next(does, options[-1])


def physics_changes(before: Explained, after: Explained, pieces: Pieces) -> tuple[PhysicsChange, ...]:
    """Return what became of every effect of a set that holds for both sides, then of what is wrong with readings."""
    tests = max(2 * len(pieces), 1)
    both = [_judged(before, after, pieces, piece, tests) for piece in pieces]
    return (*(c for c in both if c is not None), *_of_readings(before.told.effects, after.told.effects, pieces))


def kept(side: Explained, pieces: Pieces) -> Pieces:
    """Return those of a set that a side needs: its model has no others."""
    tests = max(2 * len(pieces), 1)
    return tuple(piece for piece in pieces if side.needs(pieces, piece, tests))


def _judged(
    before: Explained, after: Explained, pieces: Pieces, piece: Physics, tests: int
) -> PhysicsChange | None:
    """Return what became of one effect; None where neither side needs it."""
    needed = (before.needs(pieces, piece, tests), after.needs(pieces, piece, tests))
    if not any(needed):
        return None
    found = (before.fitted(pieces), after.fitted(pieces))
    same = rise((Side.of(found[0]), Side.of(found[1])), _coordinates(found[0], piece))
    state, sentence = _state(piece, needed, same.p_value < FALSE_ALARMS)
    others = _others(piece, (*after.told.effects, *before.told.effects))
    return PhysicsChange(piece.id, piece.stage, state, sentence, same, others)


def _state(piece: Physics, needed: tuple[bool, bool], differs: bool) -> tuple[State, str]:
    """Return what became of an effect, from which sides need it and whether both can have it alike."""
    name = f"{piece.id} in {piece.stage}"
    if all(needed):
        state: State = "changed" if differs else "in both"
        return state, f"{name} is in both, {'with other values' if differs else 'with the same values'}"
    seen, other = ("later", "earlier") if needed[1] else ("earlier", "later")
    if not differs:
        return "cannot tell", f"{name} is in the {seen} recording; the {other} one would not have shown it"
    word: State = "appeared" if needed[1] else "disappeared"
    return word, f"{name} {word}: the {other} recording would have shown it, and does not"


def _coordinates(found: Identification, piece: Physics) -> list[str]:
    """Return what is searched of an effect."""
    return [c.name for c in found.fit.coordinates if c.name.startswith(f"{owner_in(found.fit.chain, piece)}.")]


def _others(piece: Physics, findings: Sequence[Finding]) -> tuple[str, ...]:
    """Return what else an effect could be, as either side has it."""
    named = (f for f in findings if (f.id, f.stage) == (piece.id, piece.stage))
    return tuple(dict.fromkeys(f"{o.id} in {o.stage}" for f in named for o in f.could_also_be))


def _of_readings(before: Sequence[Finding], after: Sequence[Finding], pieces: Pieces) -> tuple[PhysicsChange, ...]:
    """Return what became of blemishes of the readings, which are seen there and not fitted."""
    fitted, kinds = {piece.id for piece in pieces}, blemishes()
    sides = [{f.id: f for f in findings if f.id in kinds and f.id not in fitted} for findings in (before, after)]
    found = []
    for name, finding in {**sides[0], **sides[1]}.items():
        there = (name in sides[0], name in sides[1])
        state: State = "in both" if all(there) else "appeared" if there[1] else "disappeared"
        where = "both recordings" if all(there) else f"the {'later' if there[1] else 'earlier'} recording alone"
        found.append(PhysicsChange(name, finding.stage, state, f"{name} is in the readings of {where}"))
    return tuple(found)
