"""What does an analyst read of two recordings compared: one page that opens with what changed?"""

from collections.abc import Sequence
from dataclasses import dataclass

from identify.compared.change import Change
from identify.compared.comparison import Comparison
from identify.compared.sentence import by_words, joint_words, probability
from identify.natural_units import shown_interval
from identify.page.drawing import AFTER, BEFORE, PALE, Picture, embedded, new_figure, page_style
from identify.page.report import Imprint, page

Rows = Sequence[tuple[str, ...]]
FURTHEST = 12.0  # standard errors drawn to either side; what changed by more is drawn at the edge


@dataclass(frozen=True)
class Beside:
    """What the files say beside their readings: rows (aspect, state, sentence), and (aspect, what, before, after)."""

    before: str
    after: str
    causes: Rows = ()
    differences: Rows = ()


def comparison_page(found: Comparison, beside: Beside, imprint: Imprint) -> str:
    """Return the page of ``rig compare``: HTML with its picture inside."""
    with page_style():
        drawn = _picture(found.changes)
    return page("comparison.html", imprint, {
        "title": f"{found.after.model.title}: {found.verdict}", "kicker": found.verdict,
        "mood": "good" if found.verdict == "no change seen" else "warn", "headline": found.sentence,
        "subline": f"{found.after.model.title}: from {beside.before} to {beside.after}", "before": beside.before,
        "after": beside.after, "rows": [_row(change) for change in found.changes], "joint": joint_words(found.joint),
        "drawn": drawn, "physics": found.physics, "causes": beside.causes, "differences": beside.differences,
        "warnings": found.warnings, "devices": [],
    })  # fmt: skip


def _row(change: Change) -> dict[str, str]:
    """Return a value's row of the table."""
    told, state = change.state != "not told", "" if change.state == "no change seen" else change.state
    return {
        "name": change.name, "before": shown_interval(change.before, change.unit),
        "after": shown_interval(change.after, change.unit), "state": state,
        "by": by_words(change.by, change.unit) if told else "", "p": probability(change.adjusted) if told else "",
        "errors": f"{change.standard_errors:+.1f}" if told else "",
    }  # fmt: skip


def _picture(changes: Sequence[Change]) -> Picture:
    """Draw what every value changed by, in its standard errors, with the interval of 95 %."""
    rows = [change for change in reversed(changes) if change.state != "not told"]
    figure, (ax,) = new_figure(1, 1, 0.8 + 0.3 * len(rows))
    ax.axvspan(-1.96, 1.96, color=PALE, alpha=0.4, lw=0.0)
    for i, change in enumerate(rows):
        at = min(max(change.standard_errors, -FURTHEST), FURTHEST)
        colour = BEFORE if change.state == "changed" else AFTER
        ax.plot([at - 1.96, at + 1.96], [i, i], color=colour)
        ax.plot([at], [i], "o" if abs(at) < FURTHEST else "D", color=colour)
    ax.set_yticks(range(len(rows)), [change.name for change in rows])
    ax.set(xlim=(-FURTHEST - 2.5, FURTHEST + 2.5), xlabel="change, in its standard errors")
    told = ", ".join(f"{change.name} {change.standard_errors:+.1f}" for change in reversed(rows))
    return Picture(
        "What changed, and how surely", embedded(figure), f"Change of every value in its standard errors: {told}",
        "Bars are 95 % intervals of the change; orange is what changed with all tests counted in. A diamond lies "
        "beyond the picture.",
    )  # fmt: skip
