"""How is the proof told: a short table beside what was asked for, a long one for every effect, and all that failed."""

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from tests.proof.outcome import Outcome
from tests.proof.tally import (
    Share,
    brier,
    confident_and_wrong,
    confusion,
    intervals,
    proven,
    reliability,
    share,
)
from tests.proof.trial import STRATA, UNKNOWN

BEGIN, END = "<!-- proof: begin -->", "<!-- proof: end -->"
FALSE_ALARM = "nothing missing: false alarms"
RIGHT = "one effect: right name first, no other"
WITHIN = "one effect: right name among at most 3"
WRONG = "one effect: a wrong name called likelier than not"
COVERED = "parameters within their 95 % interval"
AS_ONE = "names for exactly the same data taken as one"
BOTH = "two effects: both named"
BOTH_LISTED = "two effects: both named or listed"
MISNAMED = "two effects: a wrong name called likelier than not"
FOREIGN = "outside: a wrong name called likelier than not"
FREELY = "runs as an operator chose them"
COMPOSED = "laws put together by chance"
PLACED_AS_ONE = "right stage, or one told at which it is said to give exactly the same data"
FOREMOST = (FALSE_ALARM, RIGHT, WITHIN, WRONG, COVERED, BOTH, MISNAMED, FOREIGN)
WEAK = 0.8
Z_BANDS = (10.0, 30.0, 100.0, 1000.0, np.inf)
Rows = list[tuple[str, str, str]]
Twins = Mapping[str, Sequence[str]]
"""For an id, the ids that give the same data exactly."""


def short(outcomes: Sequence[Outcome], twins: Twins) -> str:
    """Return the table of what was asked for and what was measured."""
    return _table(outcomes, [*_asked(outcomes, twins), *_odds(outcomes), *_cost(outcomes)])


def shortest(outcomes: Sequence[Outcome], twins: Twins) -> str:
    """Return the lines of that table an operator asks for first."""
    return _table(outcomes, [row for row in _asked(outcomes, twins) if row[0] in FOREMOST])


def _table(outcomes: Sequence[Outcome], rows: Rows) -> str:
    return "\n".join([_head(outcomes), "", "| what | asked | measured |", "|---|---|---|", *map(_row, rows)])


def _asked(outcomes: Sequence[Outcome], twins: Twins) -> Rows:
    """Return what was asked for and what was measured."""
    strata = ([o for o in outcomes if o.stratum == s] for s in STRATA)
    null, single, pair, outside, composed, below, free_null, free = strata
    return [
        (FALSE_ALARM, "at most 1 %", str(share(null, lambda o: o.verdict != "consistent"))),
        (RIGHT, "90 %", str(share(single, lambda o: o.first))),
        ("the same, or a name for exactly the same data", "", str(share(single, lambda o: _alike(o, twins)))),
        (WITHIN, "97 %", str(share(single, lambda o: o.within))),
        ("one effect: right stage", "98 %", str(share(single, lambda o: o.placed))),
        (f"right stage, {AS_ONE}", "", str(share(single, lambda o: _placed_as_one(o, twins)))),
        (WRONG, "", str(share(single, confident_and_wrong))),
        (COVERED, "90 %", str(intervals(single))),
        ("`explained`: held-out residual at most 1.1 x noise", "all", str(proven(outcomes))),
        (BOTH, "80 %", str(share(pair, lambda o: set(o.ids) <= set(o.names)))),
        (f"both named, {AS_ONE}", "", str(share(pair, lambda o: _kinds(o.ids, twins) <= _kinds(o.names, twins)))),
        (BOTH_LISTED, "", str(share(pair, lambda o: o.within))),
        ("two effects: at least one, and no wrong name", "97 %", str(share(pair, _one_and_no_wrong))),
        ("at least one, and no wrong name without a right one in its set", "", str(share(pair, _one_in_every_set))),
        (f"one and no wrong name, {AS_ONE}", "", str(share(pair, lambda o: _one_and_none_else(o, twins)))),
        (MISNAMED, "", str(share(pair, confident_and_wrong))),
        ("outside the catalogue: right stage", "85 %", str(share(outside, lambda o: o.placed))),
        (PLACED_AS_ONE, "", str(share(outside, lambda o: o.placed_as_one))),
        (FOREIGN, "at most 5 %", str(share(outside, confident_and_wrong))),
        ("outside: no name at all", "", str(share(outside, lambda o: not o.names))),
        (f"{COMPOSED}: right stage", "", str(share(composed, lambda o: o.placed))),
        (f"{COMPOSED}: right, or told to be the same data", "", str(share(composed, lambda o: o.placed_as_one))),
        (f"{COMPOSED}: right stage told or listed", "", str(share(composed, lambda o: o.placed_or_listed))),
        (f"{COMPOSED}: a wrong name called likelier than not", "", str(share(composed, confident_and_wrong))),
        ("below detection (z 0.3-3): a wrong name", "", str(share(below, lambda o: bool(o.wrong)))),
        (f"{FREELY}, nothing missing: false alarms", "", str(share(free_null, lambda o: o.verdict != "consistent"))),
        (f"{FREELY}, one effect: right name first", "", str(share(free, lambda o: o.first))),
        (f"{FREELY}, one effect: right name among at most 3", "", str(share(free, lambda o: o.within))),
        (f"{FREELY}, one effect: a wrong name called likelier than not", "", str(share(free, confident_and_wrong))),
    ]


def _alike(outcome: Outcome, twins: Twins) -> bool:
    """Return whether the one name given is the right one, or one that no experiment tells from it."""
    (true,) = outcome.ids
    return len(outcome.names) == 1 and outcome.names[0] in (true, *twins.get(true, ()))


def _placed_as_one(outcome: Outcome, twins: Twins) -> bool:
    """Return whether the right stage is told, or listed beside that of what no experiment tells apart."""
    return outcome.placed or (_alike(outcome, twins) and outcome.placed_or_listed)


def _kinds(names: Sequence[str], twins: Twins) -> set[str]:
    """Return names, each of those that no experiment tells apart by the first of them."""
    return {min((name, *twins.get(name, ()))) for name in names}


def _one_and_none_else(outcome: Outcome, twins: Twins) -> bool:
    return bool(outcome.names) and _kinds(outcome.names, twins) <= _kinds(outcome.ids, twins)


def _one_and_no_wrong(outcome: Outcome) -> bool:
    return bool(outcome.names) and not outcome.wrong


def _one_in_every_set(outcome: Outcome) -> bool:
    """Return whether something is named, and a true name is in every set of those that cannot be told apart."""
    sets = [{f["id"], *(told["id"] for told in f["could_also_be"])} for f in outcome.findings]
    return bool(sets) and all(names & set(outcome.ids) for names in sets)


def _head(outcomes: Sequence[Outcome]) -> str:
    commits = ", ".join(f"`{c}`" for c in sorted({o.commit for o in outcomes}))
    failed = sum(o.failed for o in outcomes)
    return f"{len(outcomes)} sealed trials at commit {commits}; {failed} ended in a failure of the tool."


def _row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _odds(outcomes: Sequence[Outcome]) -> Rows:
    """Return how true the stated probabilities are."""
    claims = [claim for o in outcomes for claim in o.claims()]
    off = [abs(tenth.said - tenth.true.ratio) for tenth in reliability(claims)]
    return [
        ("stated probabilities: largest gap to the truth in a filled tenth", "0.1", f"{max(off, default=0.0):.2f}"),
        ("Brier score of the stated probabilities", "", f"{brier(claims):.3f} ({len(claims)} claims)"),
    ]


def _cost(outcomes: Sequence[Outcome]) -> Rows:
    """Return what an answer costs."""
    answered = [o for o in outcomes if not o.failed]
    if not answered:
        return []
    seconds = [o.reply["seconds"] for o in answered]
    simulations = [o.simulations for o in answered]
    samples = np.median([o.reply["samples"] for o in answered])
    return [
        (f"seconds an answer (median; most), {samples:,.0f} samples", "30", _middle_and_most(seconds)),
        ("simulations' time an answer (median; most)", "5,000", _middle_and_most(simulations)),
    ]


def _middle_and_most(values: Sequence[float]) -> str:
    return f"{np.median(values):,.0f}; {max(values):,.0f}"


def by_z(outcomes: Sequence[Outcome]) -> str:
    """Return how the right name depends on how clearly the physics shows."""
    rows = []
    for low, high in pairwise(Z_BANDS):
        mine = [o for o in outcomes if o.stratum == "single" and low <= o.concealed[0].z < high]
        rights = (share(mine, right) for right in (lambda o: o.first, lambda o: o.within, lambda o: o.placed))
        rows.append((f"{low:.0f} to {high:.0f}" if np.isfinite(high) else f"{low:.0f} and more", *map(str, rights)))
    return "\n".join(["| z | first | in set | stage |", "|---|---|---|---|", *map(_row, rows)])


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
    return "\n".join([_row(head), _row(["---"] * len(head)), *map(_row, rows)])


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
    return "\n".join([_row(head), _row(["---"] * len(head)), *map(_row, rows)])


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
    return "\n".join([_row(head), _row(["---"] * len(head)), *map(_row, rows)])


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
    return "\n".join(["| concealed | trials | named so | named otherwise |", "|---|---|---|---|", *map(_row, rows)])


def reliability_table(outcomes: Sequence[Outcome]) -> str:
    """Return the reliability curve: how sure, how often true."""
    claims = [claim for o in outcomes for claim in o.claims()]
    rows = [(f"{t.low:.1f}-{t.low + 0.1:.1f}", f"{t.said:.2f}", str(t.true)) for t in reliability(claims)]
    return "\n".join(["| stated | on average | true |", "|---|---|---|", *map(_row, rows)])


def steps_table(outcomes: Sequence[Outcome]) -> str:
    """Return what each step of an answer costs, in the time of simulations."""
    spent: dict[str, list[float]] = {}
    for o in outcomes:
        for sentence, simulations in o.steps() if not o.failed else ():
            spent.setdefault(sentence, []).append(simulations)
    rows = [(s, str(len(v)), f"{np.median(v):,.0f}", f"{max(v):,.0f}") for s, v in spent.items()]
    return "\n".join(["| step | answers | median | most |", "|---|---|---|---|", *map(_row, rows)])


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
