"""Is a new driver one file and one entry point, tested by being installed, and found out? The README's example is."""

import subprocess
from pathlib import Path

import pytest

from rig.errors import UsageError
from tests.pages import example
from tests.plugged import contract, passed, plug_in
from tests.unit.rig.devices import ScriptedDevice

SOUND = example("drivers/README.md", "acme_daq.py")
FLAW = ("self._bench.play(part)[:, 0]", "np.roll(self._bench.play(part)[:, 0], 1)")
"""A reading late by a sample."""


def suite(folder: Path, driver: str) -> subprocess.CompletedProcess[str]:
    """Install ``driver`` as a package would, and run the contract suite on it."""
    plug_in(folder, "acme_daq", driver, "rig.drivers", "acme", "AcmeDaq")
    return contract(folder, "test_devices", "acme")


def test_a_driver_is_tested_by_being_installed(tmp_path: Path) -> None:
    ended = suite(tmp_path, SOUND)
    assert ended.returncode == 0, ended.stdout
    assert passed(ended) > 20


def test_a_driver_that_breaks_the_contract_is_found_out(tmp_path: Path) -> None:
    assert SOUND.count(FLAW[0]) == 1
    assert suite(tmp_path, SOUND.replace(*FLAW)).returncode == 1


def test_a_driver_that_names_no_emulator_is_told_to() -> None:
    """The suite has nothing to connect to then, and fails with this."""
    with pytest.raises(UsageError, match="name one in its driver"), ScriptedDevice.simulated("rig.yaml"):
        pytest.fail("there is no such device")
