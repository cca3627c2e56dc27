"""What changed between two recordings? Explain and identify each, ask whether they can share their values, say it."""

from collections.abc import Callable, Sequence
from dataclasses import replace

from threadpoolctl import threadpool_limits

from identify.compared.account import Moved, accounted, moved
from identify.compared.change import FALSE_ALARMS, NOISE, Change, changes
from identify.compared.comparison import Comparison, Verdict, overall
from identify.compared.device import by_device
from identify.compared.physics import (
    Explained,
    Fitted,
    PhysicsChange,
    Pieces,
    ids_of,
    kept,
    physics_changes,
    shared_set,
    with_pieces,
)
from identify.compared.sentence import verdict_sentence, warnings_of
from identify.compared.together import Side, rise
from identify.compared.unproven import unproven
from identify.explain import explain
from identify.explain.explanation import Explanation
from identify.identification import Identification
from identify.joint import identify
from identify.model import Model
from identify.trace import Trace

Note = Callable[[str, float], None]
NEW = ("appeared", "disappeared", "changed")


def compare(
    model: Model, before: Sequence[Trace], after: Sequence[Trace], progress: Note | None = None, physics: bool = True
) -> Comparison:
    """Return what changed from the recordings ``before`` to those ``after``; runs have distinct names.

    Without ``physics`` none beyond the model's own is looked for. Raises ValueError with one sentence when either side
    cannot be identified.
    """
    note = progress or _silent
    with threadpool_limits(1, "blas"):
        fitted = _identified(model, before), _identified(model, after)
        if physics:
            return _with_physics(model, (before, after), fitted, note)
        note("identifying what was before", 0.02)
        first = fitted[0](())
        note("identifying what came after", 0.4)
        return _compared(first, fitted[1](()), None, (), note)


def _silent(sentence: str, share: float) -> None:
    """Show nothing."""


def _identified(model: Model, traces: Sequence[Trace]) -> Fitted:
    """Return how one side is identified with any set of effects; what was asked before is remembered."""
    known: dict[object, Identification] = {}

    def fitted(pieces: Pieces) -> Identification:
        key = ids_of(pieces)
        if key not in known:
            known[key] = identify(with_pieces(model, pieces), traces)
        return known[key]

    return fitted


def _with_physics(
    model: Model, traces: tuple[Sequence[Trace], Sequence[Trace]], fitted: tuple[Fitted, Fitted], note: Note
) -> Comparison:
    """Explain either side, try on each what the other shows, and compare what is left."""
    sides = []
    for number, (runs, way, name) in enumerate(zip(traces, fitted, ("was before", "came after"), strict=True)):
        note(f"explaining what {name}", 0.02 + 0.4 * number)
        sides.append(Explained(explain(model, runs), way))
    note("trying the physics of each on the other", 0.8)
    own = sides[0].own(model), sides[1].own(model)
    pieces = shared_set(sides[0], sides[1], own)
    found = physics_changes(sides[0], sides[1], pieces)
    first, second = (side.fitted(kept(side, pieces)) for side in sides)
    return _compared(first, second, (sides[0].told, sides[1].told), found, note)


def _compared(
    before: Identification, after: Identification, told: tuple[Explanation, Explanation] | None,
    physics: tuple[PhysicsChange, ...], note: Note,
) -> Comparison:  # fmt: skip
    """Write the answer."""
    note("asking whether both can share their values", 0.9)
    sides = Side.of(before), Side.of(after)
    joint = rise(sides)
    found = changes(before, after)
    moves = overall(joint, found) < FALSE_ALARMS
    why_not = unproven(sides, searched=told is not None) if moves else ""
    if why_not:
        found = tuple(replace(c, state="cannot tell") if c.state == "changed" else c for c in found)
    told_of = _moved(before, after, found) if moves else None
    account = accounted(told_of) if told_of else None
    device = by_device(told_of) if told_of else None
    verdict = _verdict(physics, moves, why_not)
    sentence = verdict_sentence(overall(joint, found), found, physics, account, moves, why_not)
    warnings = warnings_of(before, after)
    note("done", 1.0)
    return Comparison(verdict, sentence, joint, found, physics, account, device, before, after, told, why_not,
                      warnings)  # fmt: skip


def _verdict(physics: Sequence[PhysicsChange], moves: bool, why_not: str) -> Verdict:
    """Return whether anything changed; ``why_not``: why values that moved prove nothing."""
    states = {piece.state for piece in physics}
    if states & set(NEW) or (moves and not why_not):
        return "changed"
    return "cannot tell" if moves or "cannot tell" in states else "no change seen"


def _moved(before: Identification, after: Identification, found: tuple[Change, ...]) -> Moved | None:
    """Return how the numbers moved that both sides tell by their curvature; None for none."""
    certain = (before.certainty, after.certainty)
    told = tuple(
        c.name for c in found if c.state != "not told" and c.name != NOISE
        and all(side is not None and c.name in side.names and c.name not in side.profiled for side in certain)
    )  # fmt: skip
    return moved(before, after, told) if told else None
