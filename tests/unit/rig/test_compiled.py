"""Do two processes that compile two forms of one function at once each find their own code again?"""

import threading
from pathlib import Path

import pytest
from numba.core.caching import IndexDataCacheFile

from rig.compiled import TakingTurns

STAMP = "the source"


def crossing(folder: Path, kind: type[IndexDataCacheFile]) -> IndexDataCacheFile:
    """Save two forms at once, so that each wants to write between the other's index and code where nothing stops it."""
    index_of_first, second_done = threading.Event(), threading.Event()
    second = kind(str(folder), "loop", STAMP)
    first = kind(str(folder), "loop", STAMP)
    loads, saves = first._load_index, first._save_index

    def load_of_second() -> dict:
        found = dict(IndexDataCacheFile._load_index(second))
        index_of_first.wait(0.3)
        return found

    def save_second() -> None:
        second.save("second", "code of the second")
        second_done.set()

    def load_of_first() -> dict:
        found = dict(loads())
        thread.start()
        thread.join(0.1)
        return found

    def save_of_first(overloads: dict) -> None:
        saves(overloads)
        index_of_first.set()
        second_done.wait(0.3)

    thread = threading.Thread(target=save_second)
    second._load_index, first._load_index, first._save_index = load_of_second, load_of_first, save_of_first
    first.save("first", "code of the first")
    thread.join()
    return kind(str(folder), "loop", STAMP)


def test_taking_turns_each_finds_its_own(tmp_path: Path) -> None:
    held = crossing(tmp_path, TakingTurns)
    assert (held.load("first"), held.load("second")) == ("code of the first", "code of the second")
    assert held.load("third") is None


@pytest.mark.parametrize("key", ["first", "second"])
def test_else_one_finds_the_others_or_none(tmp_path: Path, key: str) -> None:
    assert crossing(tmp_path, IndexDataCacheFile).load(key) != f"code of the {key}"
