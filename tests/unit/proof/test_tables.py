"""Is a study counted as it happened? Answers made up by hand, whose tables are known."""

import json
from dataclasses import replace

import pytest

from tests.proof.in_short import short
from tests.proof.narration import shown
from tests.proof.outcome import opened
from tests.proof.seal import Sealed
from tests.proof.tables import between_marks, by_effect, by_z, failures, report, weak
from tests.proof.tally import Share, brier, confusion, reliability
from tests.proof.tally import intervals as held

NAMED = {"saturation": ("F", {"upper": 9.0}), "hum": ("sense", {"amplitude": 0.02}), "echo": ("G2", {"share": 0.1})}


def entry(stratum, concealed, *found, verdict="explained", stage=None, after=0.0101, number=0, z=50.0):
    """Return an entry of a study: the ids concealed, and (id, stage, probability, alternatives) of every finding."""
    pieces = [{"id": i, "stage": NAMED[i][0], "parameters": NAMED[i][1]} for i in concealed]
    outside = stratum == "outside"
    truth = json.dumps({
        "stratum": stratum, "rig": {}, "laws": [{"name": i, "values": NAMED[i][1]} for i in concealed],
        "z": [z] * len(concealed), "named": [] if outside else pieces, "unheard": pieces if outside else [],
    })  # fmt: skip
    effects = [
        {
            "id": i, "stage": at, "probability": p,
            "parameters": {k: {"value": v, "ci95": [0.99 * v, 1.01 * v]} for k, v in NAMED.get(i, ("", {}))[1].items()},
            "could_also_be": [{"id": j, "stage": at, "probability": q} for j, q in others],
        }
        for i, at, p, others in found
    ]  # fmt: skip
    said = {
        "verdict": verdict, "effects": effects, "location": {"stage": stage, "alternatives": ["G1"]} if stage else None,
        "fit": {"held_out": {"before": 0.03, "after": after, "noise": 0.01}},
    }  # fmt: skip
    reply = {
        "said": said, "failure": "", "seconds": 4.0, "processor_s": 3.0, "simulation_s": 0.002, "samples": 1000,
        "steps": [["fitting", 0.0], ["trying", 1.0]],
    }  # fmt: skip
    sealed = Sealed(truth, "salt")
    return {
        "trial": f"1/{stratum}/{number}", "commit": "abc", "seal": sealed.seal, "salt": "salt", "truth": truth,
        "reply": reply,
    }  # fmt: skip


RIGHT = entry("single", ["saturation"], ("saturation", "F", 0.9, [("hum", 0.1)]), stage="F")
SWAPPED = entry("single", ["saturation"], ("hum", "sense", 0.6, [("saturation", 0.3)]), stage="sense", number=1)
QUIET = entry("null", [], verdict="consistent")
ALARM = entry("null", [], ("hum", "sense", 0.7, []), stage="sense", number=1)
UNHEARD = entry("outside", ["echo"], verdict="unexplained", stage="G2")
FOOLED = entry("outside", ["echo"], ("hum", "sense", 0.8, []), stage="sense", number=1)
PAIR = entry("pair", ["saturation", "hum"], ("saturation", "F", 0.9, []), verdict="partly_explained", stage="F")
ALL = [opened(e) for e in (RIGHT, SWAPPED, QUIET, ALARM, UNHEARD, FOOLED, PAIR)]


def test_the_newest_answers_are_counted_beside_all_of_them():
    newer = replace(ALL[0], trial="204/single/saturation/0")
    lines = short([*ALL, newer], {}).splitlines()
    (right,) = (line for line in lines if line.startswith("| one effect: right name first"))
    assert right.endswith("| 90 % | 2 of 3 (67 %) | 1 of 1 (100 %) |")
    assert "| what | asked | measured | seeds from 200 on |" in lines
    assert "seeds from" not in short(ALL, {}) + short([newer], {})  # of one age there is one column


def test_a_truth_that_was_changed_after_sealing_is_refused():
    with pytest.raises(ValueError, match="1/single/0: the truth is not what was sealed"):
        opened(RIGHT | {"truth": RIGHT["truth"].replace("9.0", "9.1")})


def test_a_right_name_a_swapped_one_and_a_wrong_one_are_told_apart():
    right, swapped, _, alarm, unheard, fooled, pair = ALL
    assert (right.first, right.within, right.placed, right.wrong) == (True, True, True, ())
    assert (swapped.first, swapped.within, swapped.placed, swapped.wrong) == (False, True, False, ("hum",))
    assert alarm.wrong == fooled.wrong == ("hum",)
    assert (unheard.placed, unheard.wrong, unheard.first) == (True, (), False)
    assert (pair.first, pair.within, pair.placed, pair.wrong) == (False, False, True, ())


def test_a_name_beside_the_right_one_is_not_right():
    both = opened(entry("single", ["saturation"], ("saturation", "F", 0.9, []), ("hum", "sense", 0.9, []), stage="F"))
    assert not both.first
    assert both.wrong == ("hum",)


def test_intervals_are_those_of_right_names_at_their_stage():
    assert held(ALL) == Share(2, 2)
    elsewhere = opened(entry("single", ["saturation"], ("saturation", "G2", 0.9, [])))
    assert held([elsewhere]) == Share(0, 0)
    off = json.loads(json.dumps(RIGHT))
    off["reply"]["said"]["effects"][0]["parameters"]["upper"]["ci95"] = [9.01, None]
    assert held([opened(off)]) == Share(0, 1)


def test_the_short_table_counts_what_was_asked_for():
    table = short(ALL, {"saturation": ("hum",)}).splitlines()
    told = dict(line.strip("| ").split(" | ")[::2] for line in table if line.startswith("| "))
    assert told["nothing missing: false alarms"] == "1 of 2 (50 %)"
    assert told["one effect: right name first, no other"] == "1 of 2 (50 %)"
    assert told["the same, or a name for exactly the same data"] == "2 of 2 (100 %)"
    assert told["one effect: right name among at most 3"] == "2 of 2 (100 %)"
    assert told["two effects: both named"] == "0 of 1 (0 %)"
    assert told["two effects: at least one, and no wrong name"] == "1 of 1 (100 %)"
    assert told["two effects: a wrong name called likelier than not"] == "0 of 1 (0 %)"
    assert told["outside: a wrong name called likelier than not"] == "1 of 2 (50 %)"
    assert told["simulations' time an answer (median; most)"] == "1,500; 1,500"


def test_of_two_effects_both_are_listed_where_each_is_first_or_an_alternative():
    listed = entry("pair", ["saturation", "hum"], ("echo", "G2", 0.5, [("saturation", 0.4)]), ("hum", "sense", 0.9, []))
    table = short([opened(listed), opened(PAIR)], {})
    assert "| two effects: both named or listed |  | 1 of 2 (50 %) |" in table
    assert "| two effects: both named | 80 % | 0 of 2 (0 %) |" in table


@pytest.mark.parametrize(("probability", "sure"), [(0.5, "0 of 1 (0 %)"), (0.6, "1 of 1 (100 %)")])
def test_of_two_effects_a_wrong_name_is_counted_where_it_is_sure(probability, sure):
    mistaken = entry("pair", ["saturation", "hum"], ("echo", "G2", probability, []), ("hum", "sense", 0.9, []))
    assert f"| two effects: a wrong name called likelier than not |  | {sure} |" in short([opened(mistaken)], {})


def test_of_two_effects_a_name_for_exactly_the_same_data_is_counted_apart():
    swapped = entry("pair", ["saturation", "hum"], ("echo", "G2", 0.5, []), ("hum", "sense", 0.9, []))
    table = short([opened(swapped)], {"saturation": ("echo",), "echo": ("saturation",)}).splitlines()
    told = dict(line.strip("| ").split(" | ")[::2] for line in table if line.startswith("| "))
    rows = ("two effects: both named", "two effects: at least one, and no wrong name")
    assert [told[row] for row in rows] == ["0 of 1 (0 %)"] * 2
    alike = "names for exactly the same data taken as one"
    assert [told[f"{what}, {alike}"] for what in ("both named", "one and no wrong name")] == ["1 of 1 (100 %)"] * 2


def test_the_stage_of_a_name_for_exactly_the_same_data_is_right_where_the_true_one_is_listed_beside_it():
    """RIGHT is where it is; of two that are named by their twin, one lists the true stage and one does not."""
    listed = entry("single", ["saturation"], ("echo", "G2", 0.5, []), stage="G2")
    listed["reply"]["said"]["location"]["alternatives"] = ["F"]
    silent = entry("single", ["saturation"], ("echo", "G2", 0.5, []), stage="G2")
    table = short([opened(e) for e in (RIGHT, listed, silent)], {"saturation": ("echo",)}).splitlines()
    told = dict(line.strip("| ").split(" | ")[::2] for line in table if line.startswith("| "))
    assert told["one effect: right stage"] == "1 of 3 (33 %)"
    assert told["right stage, names for exactly the same data taken as one"] == "2 of 3 (67 %)"


def test_outside_a_stage_that_is_said_to_give_exactly_the_same_data_is_counted_beside_the_one_told():
    """Not in its place: G2 alone is right for what was there, and another that is only listed is not."""
    same, listed = (entry("outside", ["echo"], verdict="unexplained", stage="sense", number=n) for n in (2, 3))
    same["reply"]["said"]["location"]["same_data"] = ["G2"]
    listed["reply"]["said"]["location"]["alternatives"] = ["G2"]
    table = short([opened(e) for e in (UNHEARD, same, listed)], {}).splitlines()
    told = dict(line.strip("| ").split(" | ")[::2] for line in table if line.startswith("| "))
    assert told["outside the catalogue: right stage"] == "1 of 3 (33 %)"
    alike = "right stage, or one told at which it is said to give exactly the same data"
    assert told[alike] == "2 of 3 (67 %)"


def test_odds_are_compared_with_what_was_true():
    claims = [claim for o in ALL for claim in o.claims()]
    assert [(c.probability, c.true) for c in claims] == [
        (0.9, True), (0.1, False), (0.6, False), (0.3, True), (0.7, False), (0.8, False), (0.9, True),
    ]  # fmt: skip
    top = reliability(claims)[-1]
    assert (top.low, top.said, top.true) == (0.9, 0.9, Share(2, 2))
    assert brier(claims) == pytest.approx((0.01 + 0.01 + 0.36 + 0.49 + 0.49 + 0.64 + 0.01) / 7)


def test_what_was_taken_for_what_is_counted_and_a_failure_is_no_answer():
    broken = replace(ALL[0], said={}, reply={**ALL[0].reply, "failure": "boom"})
    table = confusion([*ALL[:4], broken])
    assert table["saturation"] == {"saturation": 1, "hum": 1, "failure": 1}
    assert table["nothing"] == {"nothing": 1, "hum": 1}
    assert "failure, boom" in failures([broken])


def test_an_effect_found_too_seldom_is_listed_with_what_it_was_taken_for_and_why():
    told = weak(ALL, {"saturation": ("hum",)})
    assert told == "- `saturation` 1 of 2 (50 %); instead hum 1; exactly the same data: hum"
    assert "| `saturation` | 50-50 | 1/2 | 2/2 | 1/2 | 1/1 | 2/2 |" in by_effect(ALL, {})


def test_what_shows_more_clearly_is_counted_apart():
    clear = opened(entry("single", ["saturation"], verdict="consistent", z=400.0))
    rows = by_z([*ALL, clear]).splitlines()
    assert rows[3] == "| 30 to 100 | 1 of 2 (50 %) | 2 of 2 (100 %) | 1 of 2 (50 %) |"
    assert rows[4] == "| 100 to 1000 | 0 of 1 (0 %) | 0 of 1 (0 %) | 0 of 1 (0 %) |"


def test_every_trial_that_went_wrong_is_in_the_report_and_no_other():
    wrong = failures(ALL)
    assert [line.split("`")[1] for line in wrong.splitlines()] == ["1/null/1", "1/outside/1", "1/pair/0", "1/single/1"]
    assert wrong in report(ALL, {})
    assert report([], {})


def test_a_trial_is_told_in_one_line():
    assert "saturation@F 0.90 upper 9 (8.91..9.09) | hum@F 0.10" in shown(RIGHT)
    failed = {**RIGHT, "reply": {**RIGHT["reply"], "said": {}, "failure": "Traceback\nValueError: no"}}
    assert shown(failed).endswith("FAILED ValueError: no")


def test_tables_go_between_the_marks_of_a_page():
    page = "a\n<!-- proof: begin -->\nold\n<!-- proof: end -->\nb\n"
    assert between_marks(page, "new") == page.replace("old", "new")
    with pytest.raises(ValueError, match="the page has no"):
        between_marks("a", "new")
