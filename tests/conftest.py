"""Which examples do property tests look at, where do tests lock ports, who goes first, which browser is there?

The same examples every time: what passes here passes there. Every process of tests locks ports in a folder of its own:
devices emulated inside a test have one name in all of them. No test finds a calibration that somebody made here.

Tests of devices go before all that computes, as far as the machine allows: a device does not wait. Lines are not
counted in whole answers and in long tests, which makes them take up to twice as long; shorter ones run those lines,
and a few long ones that are marked.
"""

import os
import shutil
import signal
import sys
import tempfile
import threading
from collections.abc import Generator, Iterator
from contextlib import contextmanager, nullcontext, suppress
from typing import TYPE_CHECKING

import pytest
from hypothesis import settings

from rig import calibration, stopping
from rig.ownership import FOLDER_VARIABLE

if TYPE_CHECKING:
    from selenium.webdriver import Chrome

settings.register_profile("fixed", derandomize=True)
settings.load_profile("fixed")
os.environ[FOLDER_VARIABLE] = tempfile.mkdtemp(prefix="rig-ports-")
os.environ[stopping.FOLDER_VARIABLE] = os.path.join(os.environ[FOLDER_VARIABLE], "bells")
os.environ[calibration.FOLDER_VARIABLE] = os.path.join(os.environ[FOLDER_VARIABLE], "no calibrations")


OF_DEVICES = ("wire", "contract", "hardware", "test_pytest_plugin.py")
USUAL, FIRST = os.getpriority(os.PRIO_PROCESS, 0), -10  # niceness of tests, and of those of devices with all they start
WHOLE = (
    "test_answers.py", "test_begun_anew.py", "test_carried.py", "test_coarse.py", "test_compare.py", "test_corners.py",
    "test_exchange.py", "test_excerpts.py", "test_finding.py", "test_follow_up.py", "test_held.py", "test_in_front.py",
    "test_innovations.py", "test_knowing.py", "test_locate.py", "test_mains.py", "test_misread.py", "test_moments.py",
    "test_narrow.py", "test_odds.py", "test_out_of_step.py", "test_places.py", "test_profile.py", "test_prove.py",
    "test_reach.py", "test_readings.py", "test_rig_file.py", "test_scattered.py", "test_second_look.py",
    "test_second_place.py", "test_select.py", "test_side_by_side.py", "test_stored.py", "test_surest.py",
    "test_uneven_noise.py", "test_unvisited.py", "test_wander.py",
)  # fmt: skip
LONG = (
    "architecture", "proof", "benchmarks", "peers", "flow/test_batch.py", "test_bend.py", "test_cable.py",
    "flow/test_calibration.py", "test_delay.py", "test_demo.py", "flow/test_design.py", "test_examples.py",
    "test_kernels.py", "test_layout.py", "test_live.py", "test_memory.py", "test_mutated.py", "test_palette.py",
    "test_readme.py", "test_real_recordings.py", "test_sines_only.py", "test_workflow.py",
)  # fmt: skip
UNCOUNTED = (*LONG, *WHOLE, "test_pressed.py")  # a signal of the last may meet a lock
LONGEST = ("proof", "test_real_recordings.py", "test_demo.py")
COMPILING_NOTHING = ("architecture", "wire")  # what takes a minute and simulates nothing
COUNTING = "COVERAGE_PROCESS_CONFIG"  # the variable that has processes count lines


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Have every process begin with its share of what takes longest, all but the first after what compiles nothing.

    Processes are given equal stretches of what is collected: what is long and comes last is waited for by all. And all
    would compile the same kernels at the same time, where those that come later find them compiled.
    """
    processes = int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1"))
    before = [[], *([item for item in items if _among((place,), item)] for place in COMPILING_NOTHING)][:processes]
    longest = [item for item in items if _among(LONGEST, item)]
    begun = {item for part in (*before, longest) for item in part}
    others = [item for item in items if item not in begun]
    size = -(-len(items) // processes)
    parts = [[*(before[i] if i < len(before) else []), *longest[i::processes]] for i in range(processes)]
    for part in parts:
        part += [others.pop(0) for _ in range(min(size - len(part), len(others)))]
    items[:] = [item for part in parts for item in part] + others


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """Let tests of devices go first, and have no process of an uncounted test count lines."""
    _nice(FIRST if _among(OF_DEVICES, item) else USUAL)
    try:
        uncounted = _among(UNCOUNTED, item) or item.get_closest_marker("uncounted")
        with _uncounted() if uncounted and not item.get_closest_marker("counted") else nullcontext():
            return (yield)
    finally:
        _nice(USUAL)


@contextmanager
def _uncounted() -> Iterator[None]:
    """Have no line counted by this process, or by one that it starts.

    Several count in a process of tests, and the mark of pytest-cov stops only the last that began.
    """
    here, in_threads, elsewhere = sys.gettrace(), threading.gettrace(), os.environ.pop(COUNTING, None)
    sys.settrace(None)
    threading.settrace(None)
    try:
        yield
    finally:
        sys.settrace(here)
        threading.settrace(in_threads)
        if elsewhere is not None:
            os.environ[COUNTING] = elsewhere


def pytest_unconfigure() -> None:
    """Leave no folder of locks behind."""
    shutil.rmtree(os.environ[FOLDER_VARIABLE], ignore_errors=True)


def _among(places: tuple[str, ...], item: pytest.Item) -> bool:
    """Return whether a test is in one of some files or folders, each as its path ends."""
    return any(f"/{place}/" in f"{item.path.as_posix()}/" for place in places)


def _nice(value: int) -> None:
    """Set the niceness of this process, where that is allowed."""
    with suppress(PermissionError):
        os.setpriority(os.PRIO_PROCESS, 0, value)


@pytest.fixture(scope="session")
def browser() -> "Iterator[Chrome]":
    """Return a headless Chromium; tests that need one are skipped where none is installed."""
    from tests.browser import chromium

    with chromium() as shown:
        yield shown


@pytest.fixture
def interruptible() -> Iterator[None]:
    """Have Ctrl-C interrupt, also where whoever started the tests had it ignored, as a shell does in the background."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)
