"""What was asked for and what was measured, in one table: of all answers, and of the newest alone?"""

from collections.abc import Callable, Mapping, Sequence
from itertools import zip_longest

import numpy as np

from tests.proof.outcome import Outcome
from tests.proof.tally import brier, confident_and_wrong, intervals, proven, reliability, share
from tests.proof.trial import STRATA

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
NEWEST = 200  # seed from which answers are of code near to this
Rows = list[tuple[str, str, str]]
Twins = Mapping[str, Sequence[str]]
"""For an id, the ids that give the same data exactly."""


def short(outcomes: Sequence[Outcome], twins: Twins) -> str:
    """Return the table of what was asked for and what was measured."""
    return _table(outcomes, lambda some: [*_asked(some, twins), *_odds(some), *_cost(some)])


def shortest(outcomes: Sequence[Outcome], twins: Twins) -> str:
    """Return the lines of that table an operator asks for first."""
    return _table(outcomes, lambda some: [line for line in _asked(some, twins) if line[0] in FOREMOST])


def _table(outcomes: Sequence[Outcome], rows: Callable[[Sequence[Outcome]], Rows]) -> str:
    """Return a table of all outcomes; of some that are newer than others, beside them of those alone."""
    newest = [o for o in outcomes if o.seed >= NEWEST]
    lines: Sequence[Sequence[str]] = [("what", "asked", "measured"), *rows(outcomes)]
    if 0 < len(newest) < len(outcomes):
        lines = [(*line, new) for line, new in zip_longest(lines, _newer(rows(newest)), fillvalue="-")]
    return "\n".join([_head(outcomes), "", row(lines[0]), "|---" * len(lines[0]) + "|", *map(row, lines[1:])])


def _newer(rows: Rows) -> list[str]:
    """Return the column of what the newest outcomes measure."""
    return [f"seeds from {NEWEST} on", *(measured for *_, measured in rows)]


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


def row(cells: Sequence[str]) -> str:
    """Return a line of a table."""
    return f"| {' | '.join(cells)} |"


def _odds(outcomes: Sequence[Outcome]) -> Rows:
    """Return how true the stated probabilities are."""
    claims = [claim for o in outcomes for claim in o.claims()]
    off = [(abs(tenth.said - tenth.true.ratio), tenth) for tenth in reliability(claims)]
    gap, worst = max(off, key=lambda pair: pair[0], default=(0.0, None))
    there = f" ({worst.true.count} of {worst.true.total} said {worst.said:.2f})" if worst else ""
    return [
        ("stated probabilities: largest gap to the truth in a filled tenth", "0.1", f"{gap:.2f}{there}"),
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
