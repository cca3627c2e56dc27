"""Which examples do property tests look at, where do tests lock ports, which calibrations and browser are there?

The same examples every time: what passes here passes there. Every process of tests locks ports in a folder of its own:
devices emulated inside a test have one name in all of them. No test finds a calibration that somebody made here.
"""

import os
import tempfile
from collections.abc import Iterator
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


@pytest.fixture(scope="session")
def browser() -> "Iterator[Chrome]":
    """Return a headless Chromium; tests that need one are skipped where none is installed."""
    from tests.browser import chromium

    with chromium() as shown:
        yield shown
