"""How is what changed said in one sentence, and what must be said beside it?"""

from collections.abc import Sequence

from identify.compared.account import Account
from identify.compared.change import Change
from identify.compared.physics import PhysicsChange
from identify.compared.together import Rise
from identify.identification import Identification
from identify.interval import Interval
from identify.natural_units import shown

FITS = 1.1  # residual over noise up to which a model follows a recording
LEAST = 1e-9  # probability told as a number
MOST = 4  # changes told by name in a sentence


def verdict_sentence(
    p_value: float, changes: Sequence[Change], physics: Sequence[PhysicsChange], account: Account | None, moves: bool,
    why_not: str,
) -> str:  # fmt: skip
    """Return what changed in one sentence; ``why_not``: why values that moved prove no change of the rig."""
    told = ("appeared", "disappeared") if moves else ("appeared", "disappeared", "changed")
    parts = [piece.sentence for piece in physics if piece.state in told]
    if moves and why_not:
        parts += [f"values differ by more than both doubts, but whether the rig's changed cannot be told: {why_not}"]
    elif moves:
        parts += [_values(changes, account)]
    if parts:
        return f"{_capital('; '.join(parts))}."
    open_ = [piece.sentence for piece in physics if piece.state == "cannot tell"]
    count = sum(change.state != "not told" for change in changes)
    same = f"the {count} values told agree within their doubt (p {probability(p_value)})"
    if open_:
        return f"Whether anything changed cannot be told: {'; '.join([*open_, same])}."
    return f"No change seen: {same}."


def _values(changes: Sequence[Change], account: Account | None) -> str:
    """Return which values changed: those that are sure by themselves, and which few account for it all."""
    sure = sorted((c for c in changes if c.state == "changed"), key=lambda c: c.adjusted)
    names = ", ".join(moved_words(c) for c in sure[:MOST])
    if len(sure) > MOST:
        names += f" and {len(sure) - MOST} more"
    if not sure:
        return f"the values together changed, none surely by itself{account_words(account)}"
    return f"changed by more than both doubts: {names}{account_words(account)}"


def account_words(account: Account | None) -> str:
    """Return which numbers account for a change, behind a comma; empty where none do."""
    if account is None or not account.names or not account.is_whole:
        return ""
    instead = f" (or {' or '.join(account.instead[:3])} in place of {account.names[0]})" if account.instead else ""
    many = len(account.names) > 1
    return f"; {' and '.join(account.names)} alone account{'' if many else 's'} for all of it{instead}"


def joint_words(joint: Rise) -> str:
    """Return the test of all values together."""
    return (f"together, their correlation counted in: chi-squared {joint.chi2:.4g} at {joint.freedom:.3g} degrees of "
            f"freedom, p {probability(joint.p_value)}")  # fmt: skip


def probability(p_value: float) -> str:
    """Return ``= 0.032``, or a bound below which nobody counts."""
    return f"= {p_value:.2g}" if p_value >= LEAST else f"< {LEAST:g}"


def moved_words(change: Change) -> str:
    """Return a change with its interval: ``F.D_L by 12 mV ± 3 mV``."""
    return f"{change.name} by {by_words(change.by, change.unit)}"


def by_words(by: Interval, unit: str) -> str:
    """Return what a number changed by, its sign shown, with half of its 95 % interval."""
    half = 0.5 * (by.high - by.low)
    return f"{'+' if by.value >= 0.0 else ''}{shown(by.value, unit, 3)} ± {shown(half, unit, 2)}"


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def warnings_of(before: Identification, after: Identification) -> tuple[str, ...]:
    """Return what makes a comparison less sure than its numbers say."""
    found = []
    for name, side in (("earlier", before), ("later", after)):
        over = side.rms_v / side.noise.rms_v
        if over > FITS:
            found.append(f"the model leaves {over:.3g} times the noise in the {name} recording: its values also hold "
                         "what is lacking, and another stimulus would move them")  # fmt: skip
        if not side.fit.converged:
            found.append(f"the fit to the {name} recording did not settle ({side.fit.sentence}): its values are "
                         "provisional")  # fmt: skip
    return tuple(found)
