"""Does the page find the run it was asked for, go on to its retries, and end when it is of no use any more?"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Event
from types import SimpleNamespace
from typing import IO

import numpy as np
import pytest
from tornado.ioloop import IOLoop

from rig.live import process
from rig.live.following import follow
from rig.live.launching import Order
from rig.live.process import Live
from rig.recording import Writer
from rig.retry import path_of
from tests.unit.rig.test_recording import EQUIPMENT, a_plan
from tests.wire.waiting import eventually


@pytest.fixture
def asker(monkeypatch: pytest.MonkeyPatch) -> Iterator[IO[bytes]]:
    """Return the end of the pipe that the program that asked for a page holds."""
    theirs, ours = os.pipe()
    with os.fdopen(theirs, "rb", buffering=0) as heard, os.fdopen(ours, "wb", buffering=0) as held:
        monkeypatch.setattr(process.sys, "stdin", heard)
        yield held


@contextmanager
def a_page(order: Order, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[Live, list[str]]]:
    """Give a page that takes its turns when it is told to, and what has ended it."""
    ended: list[str] = []
    live = Live(order)
    monkeypatch.setattr(IOLoop.current(), "stop", lambda: ended.append("stopped"))
    try:
        yield live, ended
    finally:
        live.close()
        monkeypatch.undo()


def shown(live: Live, name: str) -> bool:
    """Have the page take turns until it shows a recording; return whether it comes to that."""

    def turned() -> bool:
        live._turn()
        return live._page.state().get("file") == name

    return eventually(turned)


def begun(path: Path) -> Writer:
    """Return a recording of which some samples have come."""
    writer = Writer(path, a_plan(), EQUIPMENT, overwrite=True)
    writer.append(0, np.ones(10))
    return writer


def test_the_recording_that_was_there_before_is_not_the_runs(
    tmp_path: Path, asker: IO[bytes], monkeypatch: pytest.MonkeyPatch,
) -> None:
    path = tmp_path / "run.h5"
    begun(path).close()
    there = path.stat()
    with a_page(Order(str(path), (there.st_dev, there.st_ino)), monkeypatch) as (live, ended):
        live._turn()
        assert live._page.watch is None
        with begun(path):
            assert shown(live, "run")
            assert live._page.state()["going_on"]
        assert ended == []


def test_the_page_answers_while_a_long_recording_is_looked_at(
    tmp_path: Path, asker: IO[bytes], monkeypatch: pytest.MonkeyPatch,
) -> None:
    path, looked = tmp_path / "run.h5", Event()
    with begun(path), a_page(Order(str(path)), monkeypatch) as (live, ended):
        monkeypatch.setattr(process, "follow", lambda path: looked.wait(60) and follow(path))
        for _ in range(5):
            live._turn()
        assert live._page.watch is None
        asker.close()  # who asked has ended, and left a recording: it is still shown
        live._turn()
        assert ended == []
        looked.set()
        assert shown(live, "run")


def test_a_page_of_no_run_ends_with_who_asked_for_it(
    tmp_path: Path, asker: IO[bytes], monkeypatch: pytest.MonkeyPatch,
) -> None:
    with a_page(Order(str(tmp_path / "run.h5")), monkeypatch) as (live, ended):
        live._turn()
        assert ended == []
        asker.close()
        live._turn()
        assert ended == ["stopped"]


def test_a_run_that_is_played_again_is_followed(
    tmp_path: Path, asker: IO[bytes], monkeypatch: pytest.MonkeyPatch,
) -> None:
    path = tmp_path / "run.h5"
    with a_page(Order(str(path)), monkeypatch) as (live, ended):
        with begun(path) as writer:
            assert shown(live, "run")
            writer.finish(False, "samples were lost")
        live._turn()
        live._turn()
        assert live._page.state()["file"] == "run"
        with begun(path_of(path, 1)):
            assert shown(live, "run.retry1")
            assert live._page.state()["going_on"]
        assert ended == []


def test_a_page_that_nobody_looks_at_ends_some_time_after_the_run(
    tmp_path: Path, asker: IO[bytes], monkeypatch: pytest.MonkeyPatch,
) -> None:
    path, clock = tmp_path / "run.h5", iter(np.arange(0.0, 1e4, 7.0))
    with a_page(Order(str(path), idle_s=60.0), monkeypatch) as (live, ended):
        with begun(path) as writer:
            assert shown(live, "run")
            monkeypatch.setattr(process, "time", SimpleNamespace(monotonic=lambda: float(next(clock))))
            for _ in range(40):
                live._turn()
            assert ended == [], "the run goes on"
            writer.finish(True, "all there")
        live._turn()
        assert ended == []
        for _ in range(40):
            live._turn()
        assert ended
