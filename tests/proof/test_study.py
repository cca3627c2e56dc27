"""Does the study hold: truth sealed before the tool is asked, a cut study goes on, its first trials are right?

A fixed share of ``python -m tests.proof``: one standard trial with nothing missing, asked as the command asks it; what
is missing is found in the fixed cases of test_trials.py.
"""

import json
from contextlib import redirect_stdout
from io import StringIO
from itertools import count, islice

import pytest

from tests.proof.__main__ import LONG, README, REPLY, arguments, main, selected
from tests.proof.ask import exact_twins, limited
from tests.proof.in_short import shortest
from tests.proof.outcome import opened
from tests.proof.study import answered, keep, kept
from tests.proof.tables import between_marks, report


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """Return the file of a study of one trial: any test may be its first, or its only one."""
    out = tmp_path_factory.mktemp("study") / "proof.jsonl"
    with redirect_stdout(StringIO()) as said:
        main(["--stratum", "null", "--seed", "3", "--cases", "1", "--out", str(out)])
    assert "1 sealed trials" in said.getvalue()
    return out


def test_a_standard_trial_is_answered_rightly(study):
    (outcome,) = map(opened, answered(study, REPLY).values())
    assert (outcome.verdict, outcome.names, outcome.placed) == ("consistent", (), False)


def test_the_seal_stands_before_the_answer_and_what_is_answered_is_not_asked_again(study, capsys):
    lines = [json.loads(line) for line in study.read_text().splitlines()]
    assert [("reply" in line, line["seal"] == lines[0]["seal"]) for line in lines[:2]] == [(False, True), (True, True)]
    with study.open("a") as file:
        file.write('{"trial": "3/null/null/1", "reply": {"cut')
    main(["--stratum", "null", "--cases", "1", "--seed", "3", "--out", str(study)])
    assert "1 trials, 1 of them answered before" in capsys.readouterr().out
    assert len(study.read_text().splitlines()) == len(lines) + 1


def test_answers_that_are_kept_are_those_of_the_study_and_open_as_they_were_sealed(study, tmp_path):
    file = keep(study, REPLY, tmp_path / "answers")
    (trial, entry), = kept(REPLY, tmp_path / "answers").items()
    assert (file.name, trial, entry) == ("proof.jsonl.xz", "3/null/null/0", answered(study, REPLY)[trial])
    assert opened(entry).verdict == "consistent"
    (tmp_path / study.name).write_text("")
    keep(tmp_path / study.name, REPLY, tmp_path / "answers")  # another of that name takes nothing away
    assert kept(REPLY, tmp_path / "answers") == {trial: entry}


def test_the_tables_of_the_readmes_are_those_of_all_answers_that_are_kept():
    outcomes, twins = [opened(entry) for entry in kept(REPLY).values()], exact_twins()
    for page, text in ((README, shortest(outcomes, twins)), (LONG, report(outcomes, twins))):
        written = page.read_text(encoding="utf-8")
        assert between_marks(written, text) == written


@pytest.mark.parametrize("words", [("--effect", "gremlins"), ("--stratum", "null", "--effect", "hum")])
def test_what_no_trial_is_about_is_refused(words, capsys):
    with pytest.raises(SystemExit):
        main(list(words))
    assert "--effect" in capsys.readouterr().err


@pytest.mark.parametrize(("about", "stratum"), [("hum", "single"), ("echo", "outside")])
def test_trials_about_one_id_are_of_the_stratum_it_belongs_to(about, stratum):
    keys = islice(selected(arguments(["--effect", about]), frozenset()), 3)
    assert [(key.about, key.stratum, key.number) for key in keys] == [(about, stratum, n) for n in range(3)]


def test_an_answer_that_never_comes_ends_as_none():
    with pytest.raises(TimeoutError, match=r"no answer within 0\.05 s"), limited(0.05):
        all(number >= 0 for number in count())
