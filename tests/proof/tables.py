"""How is the proof told: a short table beside what was asked for, a long one for every effect, and all that failed."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from tests.proof.in_short import Twins, row, short
from tests.proof.outcome import Outcome
from tests.proof.tally import Share, confident_and_wrong, confusion, intervals, proven, reliability, share
from tests.proof.trial import UNKNOWN

BEGIN, END = "<!-- proof: begin -->", "<!-- proof: end -->"
WEAK = 0.8
Z_BANDS = (10.0, 30.0, 100.0, 1000.0, np.inf)


def by_z(outcomes: Sequence[Outcome]) -> str:
    """Return how the right name depends on how clearly the physics shows."""
    rows = []
    for low, high in pairwise(Z_BANDS):
        mine = [o for o in outcomes if o.stratum == "single" and low <= o.concealed[0].z < high]
        rights = (share(mine, right) for right in (lambda o: o.first, lambda o: o.within, lambda o: o.placed))
        rows.append((f"{low:.0f} to {high:.0f}" if np.isfinite(high) else f"{low:.0f} and more", *map(str, rights)))
    return "\n".join(["| z | first | in set | stage |", "|---|---|---|---|", *map(row, rows)])


def by_effect(outcomes: Sequence[Outcome], twins: Twins) -> str:
    """Return a row for every effect."""
    head = ("effect", "z", "first", "in set", "stage", "intervals", "held out", "same data as")
    single = [o for o in outcomes if o.stratum == "single"]
    rows = []
    for effect in sorted({o.ids[0] for o in single}):
        mine = [o for o in single if o.ids[0] == effect]
        z = sorted(o.concealed[0].z for o in mine)
        rows.append((
            f"`{effect}`", f"{z[0]:.0f}-{z[-1]:.0f}", _bare(share(mine, lambda o: o.first)),
            _bare(share(mine, lambda o: o.within)), _bare(share(mine, lambda o: o.placed)), _bare(intervals(mine)),
            _bare(proven(mine)), ", ".join(twins.get(effect, ())),
        ))  # fmt: skip
    return "\n".join([row(head), row(["---"] * len(head)), *map(row, rows)])


def _bare(counted: Share) -> str:
    return f"{counted.count}/{counted.total}" if counted.total else "-"


def outside_table(outcomes: Sequence[Outcome]) -> str:
    """Return a row for every physics that no catalogue has."""
    head = ("physics", "stage", "right stage", "listed", "named", "wrongly sure", "verdicts")
    outside = [o for o in outcomes if o.stratum == "outside"]
    rows = []
    for kind in sorted({o.ids[0] for o in outside}):
        mine = [o for o in outside if o.ids[0] == kind]
        verdicts = ", ".join(sorted({o.verdict for o in mine}))
        rows.append((
            kind, mine[0].concealed[0].stage, _bare(share(mine, lambda o: o.placed)),
            _bare(share(mine, lambda o: o.placed_or_listed)), _bare(share(mine, lambda o: bool(o.names))),
            _bare(share(mine, confident_and_wrong)), verdicts,
        ))  # fmt: skip
    return "\n".join([row(head), row(["---"] * len(head)), *map(row, rows)])


def composed_table(outcomes: Sequence[Outcome]) -> str:
    """Return a row for everything that laws put together by chance change, and one for all they change it by."""
    composed = [o for o in outcomes if o.stratum == "composed"]
    rows = []
    for word in range(2):
        for told in sorted({_words(o)[word] for o in composed}):
            mine = [o for o in composed if _words(o)[word] == told]
            rights = (lambda o: o.placed, lambda o: o.placed_as_one, lambda o: o.placed_or_listed, confident_and_wrong)
            rows.append((f"{'by ' * word}{told}", *(_bare(share(mine, right)) for right in rights)))
    head = ("what, or by what", "right stage", "same data", "listed", "wrongly sure")
    return "\n".join([row(head), row(["---"] * len(head)), *map(row, rows)])


def _words(outcome: Outcome) -> tuple[str, ...]:
    """Return what a law put together by chance changes, by what, and how."""
    what, _, rest = outcome.ids[0].partition(" by ")
    return what, *rest.split(", ")


def confusion_table(outcomes: Sequence[Outcome]) -> str:
    """Return what was named for every physics concealed alone, or for nothing: the right name first, then the rest."""
    alone = [o for o in outcomes if o.stratum in ("null", "single", "outside")]
    rows = []
    for truth, named in confusion(alone).items():
        others = ", ".join(f"{name} {count}" for name, count in named.most_common() if name != truth)
        rows.append((truth, str(sum(named.values())), str(named[truth] or ""), others))
    return "\n".join(["| concealed | trials | named so | named otherwise |", "|---|---|---|---|", *map(row, rows)])


def reliability_table(outcomes: Sequence[Outcome]) -> str:
    """Return the reliability curve: how sure, how often true."""
    claims = [claim for o in outcomes for claim in o.claims()]
    rows = [(f"{t.low:.1f}-{t.low + 0.1:.1f}", f"{t.said:.2f}", str(t.true)) for t in reliability(claims)]
    return "\n".join(["| stated | on average | true |", "|---|---|---|", *map(row, rows)])


def steps_table(outcomes: Sequence[Outcome]) -> str:
    """Return what each step of an answer costs, in the time of simulations."""
    spent: dict[str, list[float]] = {}
    for o in outcomes:
        for sentence, simulations in o.steps() if not o.failed else ():
            spent.setdefault(sentence, []).append(simulations)
    rows = [(s, str(len(v)), f"{np.median(v):,.0f}", f"{max(v):,.0f}") for s, v in spent.items()]
    return "\n".join(["| step | answers | median | most |", "|---|---|---|---|", *map(row, rows)])


def failures(outcomes: Sequence[Outcome]) -> str:
    """Return every trial that went wrong, in one line each."""
    return "\n".join(f"- {_why(o)}" for o in sorted(outcomes, key=lambda o: o.trial) if not _good(o))


def _good(outcome: Outcome) -> bool:
    """Return whether an outcome is all that was asked for."""
    if outcome.stratum in ("null", "free_null"):
        return outcome.verdict == "consistent"
    if outcome.stratum in UNKNOWN:
        return outcome.placed and not outcome.names
    if outcome.stratum == "below":
        return not outcome.failed and not outcome.wrong
    return outcome.first and outcome.placed


def _why(outcome: Outcome) -> str:
    """Return a trial with what was concealed and what was said."""
    concealed = " and ".join(f"{t.id}@{t.stage} (z {t.z:.0f})" for t in outcome.concealed) or "nothing"
    if outcome.failed:
        return f"`{outcome.trial}` {concealed}: failure, {outcome.reply['failure'].splitlines()[-1]}"
    said = ", ".join(f"{f['id']}@{f['stage']} {f['probability']:.2f}" for f in outcome.said["effects"]) or "nothing"
    stage = (outcome.said.get("location") or {}).get("stage")
    return f"`{outcome.trial}` {concealed}: {outcome.verdict} at {stage}, {said}"


def weak(outcomes: Sequence[Outcome], twins: Twins) -> str:
    """Return the effects that are named first in less than four trials of five, and what they are taken for."""
    single = [o for o in outcomes if o.stratum == "single"]
    lines = []
    for effect, named in confusion(single).items():
        mine = [o for o in single if o.ids[0] == effect]
        right = share(mine, lambda o: o.first)
        if right.ratio < WEAK:
            others = ", ".join(f"{name} {count}" for name, count in named.most_common() if name != effect)
            exact = f"; exactly the same data: {', '.join(twins[effect])}" if twins.get(effect) else ""
            lines.append(f"- `{effect}` {right}; instead {others or 'more names'}{exact}")
    return "\n".join(lines) or "None."


def report(outcomes: Sequence[Outcome], twins: Twins) -> str:
    """Return everything, as the README of the study holds it."""
    parts = {
        "In short": short(outcomes, twins),
        "How clearly must it show?": by_z(outcomes),
        "Every effect": by_effect(outcomes, twins),
        "Named first in less than 80 %": weak(outcomes, twins),
        "Outside the catalogue": outside_table(outcomes),
        "Laws put together by chance": composed_table(outcomes),
        "What was named": confusion_table(outcomes),
        "Are the odds true?": reliability_table(outcomes),
        "What an answer costs, in simulations": steps_table(outcomes),
        "What went wrong": failures(outcomes) or "Nothing.",
    }
    return "\n\n".join(f"## {title}\n\n{text}" for title, text in parts.items())


def between_marks(page: str, text: str, name: str = "proof") -> str:
    """Return a page with ``text`` between the two marks of this name; ValueError when it has none."""
    begin, end = (f"<!-- {name}: {word} -->" for word in ("begin", "end"))
    before, found, rest = page.partition(begin)
    _, closed, after = rest.partition(end)
    if not found or not closed:
        raise ValueError(f"the page has no {begin} ... {end}")
    return f"{before}{begin}\n{text}\n{end}{after}"
