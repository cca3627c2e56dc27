"""How is what the tool said of every circuit shown?"""

from collections.abc import Sequence
from typing import Any

from tests.proof.circuit.changes import PAIRS, Change, Circuit
from tests.proof.circuit.verdict import Answer, Outcome, Value, Verdict, judged

HEAD = ("| what was changed | what it must cause | by hand | told | held out, x noise | verdict | |\n"
        "|---|---|---|---|---|---|---|\n")
Told = Sequence[tuple[Circuit, Answer]]


def report(told: Told, commit: str) -> str:
    """Return the count and the table of circuits with one change."""
    verdicts = [judged(circuit, answer) for circuit, answer in told]
    named = [v for (c, _), v in zip(told, verdicts, strict=True) if c.changes[0].named]
    counts = counted(verdicts)
    rows = (row(circuit, answer, verdict) for (circuit, answer), verdict in zip(told, verdicts, strict=True))
    return (
        f"At commit `{commit}`: of {len(named)} changes with a name in the catalogue "
        f"{counted(named)['found']} were found; of all {len(verdicts)} circuits "
        f"{counts['found']} were answered rightly, {counts['missed']} missed, "
        f"{counts['wrong']} called by a wrong name.\n\n"
        + HEAD + "\n".join(rows) + "\n"
    )


def report_of_pairs(told: Told, commit: str) -> str:
    """Return the count of circuits with two changes, and the table of those that were not answered rightly."""
    verdicts = [judged(circuit, answer) for circuit, answer in told]
    counts = counted(verdicts)
    short = [row(c, answer, v) for (c, answer), v in zip(told, verdicts, strict=True) if v.outcome != "found"]
    return (
        f"At commit `{commit}`: of {len(verdicts)} circuits with two changes, of {len(PAIRS)} that there are, "
        f"{counts['found']} were answered rightly: both named first with the values by hand, and nothing else; "
        f"{counts['missed']} missed, {counts['wrong']} called by a wrong name."
        + (f" Those that were not:\n\n{HEAD}" + "\n".join(short) if short else "") + "\n"
    )


def counted(verdicts: Sequence[Verdict]) -> dict[Outcome, int]:
    """Return how many verdicts there are of each outcome."""
    words: tuple[Outcome, ...] = ("found", "missed", "wrong")
    return {word: sum(v.outcome == word for v in verdicts) for word in words}


def row(circuit: Circuit, answer: Answer, verdict: Verdict) -> str:
    """Return the line of one circuit."""
    changes = circuit.changes
    cells = (
        "; ".join(f"{c.name}: {c.done}" for c in changes), "; ".join(_must(c) for c in changes),
        ", ".join(f"{v.name} {v.by_hand:.4g}" for v in verdict.values), _said(answer, verdict.values),
        f"{verdict.before:.3g} → {verdict.after:.3g}", str(answer["verdict"]),
        f"**{verdict.outcome}**" + (f": {verdict.why}" if verdict.why else ""),
    )
    return "| " + " | ".join(cells) + " |"


def _must(change: Change) -> str:
    return f"`{change.effect}` at {change.stage}: {change.because}" if change.effect else (
        f"no missing physics: {change.because}"
    )


def _said(answer: Answer, values: Sequence[Value]) -> str:
    """Return names with their odds, and the values asked about."""
    names = [f"`{e['id']}` at {e['stage']} {e['probability']:.2f}{_others(e)}: {_all(e)}" for e in answer["effects"]]
    told = [_shown(value.name, value.told) for value in values if value.told is not None and value.interval is None]
    return "; ".join([*(names or ["no name"]), *told])


def _others(effect: Any) -> str:
    others = ", ".join(f"{o['id']} {o['probability']:.2f}" for o in effect["could_also_be"])
    return f" (or {others})" if others else ""


def _all(effect: Any) -> str:
    """Return every value of an effect with its interval."""
    told = effect["parameters"].items()
    return ", ".join(f"{_shown(name, p['value'])} [{', '.join(map(_end, p['ci95']))}]" for name, p in told)


def _end(value: float | None) -> str:
    return "?" if value is None else f"{value:.4g}"


def _shown(name: str, value: float) -> str:
    return f"{name} {value:.4g}"
