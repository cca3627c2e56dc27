"""Does no file, however damaged or hostile, get more out of a command than one message, in time and in little memory?

A share of ``python -m tests.benchmarks.mutated``.
"""

from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from random import Random

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.mutations.case import LIMIT_BYTES, SECRET, Case, Ending, judge
from tests.mutations.every import damaged, hostile
from tests.mutations.originals import CHECK, PROTOCOL, RIG, TABLE, originals
from tests.mutations.player import Player, in_a_process, laid_out, played
from tests.mutations.recordings import LINES
from tests.mutations.tables import intact_tables

SHARE = 13
"""One in so many of the hostile files."""


@pytest.fixture(scope="module")
def player() -> Iterator[Player]:
    started = Player()
    yield started
    started.close()


def intact() -> dict[str, Case]:
    """Return every file as it was before it was damaged."""
    words = {"p.yaml": PROTOCOL.encode(), "rig.yaml": RIG.encode(), "t.csv": TABLE.encode()}
    run = words | {"run.h5": originals().run, "model.json": originals().answer, "c.json": originals().calibration}
    lines = {"protocol": CHECK, "model": ("simulate", "run.h5", "--rig", "model.json")}
    lines |= {line[0]: line for line in LINES}
    tables = {name: Case(name, {name: held}, ("import", name, *line)) for name, (held, line) in intact_tables().items()}
    return {name: Case(name, run, line) for name, line in lines.items()} | tables


def test_files_made_to_harm_are_refused() -> None:
    judged = list(played(hostile(originals(), SHARE)))
    assert len(judged) > 40
    assert [(one.case.name, one.faults, one.ending.err) for one in judged if one.faults] == []


@settings(max_examples=30, deadline=None, suppress_health_check=list(HealthCheck))
@given(seed=st.integers(0, 10**9), at=st.integers(0, 11))
def test_damage_at_random_gets_no_more_than_a_message(player: Player, seed: int, at: int) -> None:
    case = next(islice(damaged(originals(), Random(seed)), at, None))
    with laid_out(case) as folder:
        found = judge(case, player.play(case, folder))
    assert not found.faults, (case.name, found.ending)


def test_it_ends_so_in_a_process_of_its_own(player: Player) -> None:
    hurt = Case("cut", {"run.h5": originals().run[:-1]}, ("simulate", "run.h5"), hostile=True)
    alone = in_a_process(hurt)
    assert alone.faults == ()
    with laid_out(hurt) as folder:
        assert player.play(hurt, folder).err == alone.ending.err


def test_what_is_intact_is_answered(player: Player) -> None:
    for case in intact().values():
        with laid_out(case) as folder:
            found = judge(case, player.play(case, folder))
        assert (found.ending.code, found.faults) == (0, ()), (case.name, found.ending.err)


def ending(**what: object) -> Ending:
    usual = {"code": 2, "out": "", "err": "rig: f: wrong\n", "seconds": 0.1, "peak_bytes": 10**8}
    return Ending(**{**usual, **what})  # type: ignore[arg-type]


@pytest.mark.parametrize(("wrong", "fault"), [
    ({"code": 0, "err": ""}, "ended with 0"), ({"code": 70}, "ended with 70"), ({"code": 1}, "ended with 1"),
    ({"code": None}, "went on"), ({"signal": 11}, "died"), ({"seconds": 11.0}, "took 11.0 s"),
    ({"peak_bytes": LIMIT_BYTES + 1}, "took 1000 MB"), ({"err": "rig: a\nrig: b\n"}, "not one message"),
    ({"err": "Traceback\nrig: a\n"}, "not one message"), ({"err": ""}, "not one message"), ({"out": "y"}, "an answer"),
    ({"left": ("out.h5",)}, "left out.h5"), ({"err": f"rig: {SECRET}\n"}, "another file"),
])
def test_these_tests_can_fail(wrong: dict[str, object], fault: str) -> None:
    case = Case("hostile", {}, CHECK, hostile=True)
    assert judge(case, ending()).faults == ()
    assert any(found.startswith(fault) or fault in found for found in judge(case, ending(**wrong)).faults)


def test_the_secret_is_there_to_be_followed_to(tmp_path: Path) -> None:
    with laid_out(Case("empty", {}, CHECK)) as folder:
        assert (folder / ".." / "outside").read_text() == SECRET
