"""What does an analyst read of two recordings compared: one page that opens with what changed?"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from identify.compared.change import Change
from identify.compared.comparison import Comparison
from identify.compared.physics import PhysicsChange
from identify.compared.sentence import by_words, joint_words, probability
from identify.natural_units import shown_interval
from identify.page.document import NOTHING, Imprint, Page, begun
from identify.page.drawing import AFTER, BEFORE, PALE, Look, Panel, Picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Rows = Sequence[tuple[str, ...]]
FURTHEST = 12.0  # standard errors drawn to either side; what changed by more is drawn at the edge


@dataclass(frozen=True)
class Beside:
    """What the files say beside their readings: rows (aspect, state, sentence), and (aspect, what, before, after)."""

    before: str
    after: str
    causes: Rows = ()
    differences: Rows = ()


def comparison_page(found: Comparison, beside: Beside, imprint: Imprint = NOTHING) -> Page:
    """Return the page of ``rig compare``."""
    return Page("comparison.html", imprint, {
        "title": f"{found.after.model.title}: {found.verdict}", "kicker": found.verdict,
        "mood": "good" if found.verdict == "no change seen" else "warn", "headline": found.sentence,
        "subline": f"{found.after.model.title}: from {beside.before} to {beside.after}", "before": beside.before,
        "after": beside.after, "rows": [_row(change) for change in found.changes],
        "joint": begun(joint_words(found.joint)),
        "drawn": _picture(found.changes), "physics": [_piece(piece) for piece in found.physics],
        "causes": beside.causes, "differences": beside.differences, "warnings": found.warnings, "devices": [],
    })  # fmt: skip


def _row(change: Change) -> tuple[str, ...]:
    """Return a value's row of the table."""
    told = change.state != "not told"
    return (
        change.name, shown_interval(change.before, change.unit), shown_interval(change.after, change.unit),
        by_words(change.by, change.unit) if told else "", f"{change.standard_errors:+.1f}" if told else "",
        probability(change.adjusted) if told else "", "" if change.state == "no change seen" else change.state,
    )  # fmt: skip


def _piece(piece: PhysicsChange) -> tuple[str, str, str, str]:
    """Return a row on physics that one side has."""
    return piece.id.replace("_", " "), piece.stage, piece.sentence, ", ".join(piece.could_also_be)


def _picture(changes: Sequence[Change]) -> Picture:
    """Draw what every value changed by, in its standard errors, with the interval of 95 %."""
    rows = [change for change in changes if change.state != "not told"]
    told = ", ".join(f"{change.name} {change.standard_errors:+.1f}{' (changed)' * _moved(change)}" for change in rows)
    words = f"Change of every value in its standard errors: {told}."
    return Picture(
        "Change of every value, and how sure it is", (Panel(partial(_draw, rows), words, 0.8 + 0.26 * len(rows)),),
        "Bars are 95 % intervals of the change; squares and arrows are what changed with all tests "
        "counted in. An arrow points to a value beyond the picture, which stands beside it.",
    )  # fmt: skip


def _moved(change: Change) -> bool:
    return change.state == "changed"


def _draw(rows: Sequence[Change], ax: "Axes") -> None:
    ax.axvspan(-1.96, 1.96, color=PALE, alpha=0.5, lw=0.0)
    for i, change in enumerate(reversed(rows)):
        _draw_change(ax, i, change.standard_errors, BEFORE if _moved(change) else AFTER)
    ax.set_yticks(range(len(rows)), [change.name for change in reversed(rows)])
    ax.set(xlim=(-FURTHEST - 2.5, FURTHEST + 2.5), xlabel="change, in its standard errors")


def _draw_change(ax: "Axes", row: int, errors: float, look: Look) -> None:
    """Draw a value's change with its interval, or beyond the end an arrow with the number."""
    if abs(errors) < FURTHEST:
        ax.plot([errors - 1.96, errors + 1.96], [row, row], color=look.colour)
        ax.plot([errors], [row], look.marker, color=look.colour)
        return
    end, side, marker = (FURTHEST, "right", ">") if errors > 0.0 else (-FURTHEST, "left", "<")
    ax.plot([end], [row], marker, color=look.colour)
    ax.annotate(f"{errors:+.3g}", (end, row), xytext=(-6 if side == "right" else 6, 0), textcoords="offset points",
                ha=side, va="center")  # fmt: skip
