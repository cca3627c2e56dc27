"""Is every sealed case answered, and does the table say what the answers say?"""

import json

from tests.proof.sealed.__main__ import HERE, table
from tests.proof.tables import BEGIN, END

CASES = [f"case-{letter}" for letter in "abcdefghijkl"] + ["case-p-1", "case-p-2"]


def test_every_case_has_its_answer() -> None:
    answers = {path.stem: json.loads(path.read_text(encoding="utf-8")) for path in HERE.glob("*.json")}
    assert sorted(answers) == CASES
    assert {said["schema"] for said in answers.values()} == {"rig.explain/1"}
    assert answers["case-a"]["fit"]["held_out"]["runs"] == ["multisine", "staircase_repeat"]
    assert answers["case-p-2"]["fit"]["held_out"]["runs"] == ["recording_3"]


def test_the_table_is_that_of_the_answers() -> None:
    told = (HERE / "README.md").read_text(encoding="utf-8").partition(BEGIN)[2].partition(END)[0]
    assert told.strip() == table()
