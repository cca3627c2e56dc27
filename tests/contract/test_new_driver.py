"""Is a new driver one file and one entry point, tested by the contract suite by its existing, and found out?"""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from rig.errors import UsageError
from tests.architecture.house import ROOT
from tests.unit.rig.devices import ScriptedDevice

SOUND = """
'''A DAQ of another maker: in this test its rig is simulated in the process.'''

from contextlib import nullcontext
from typing import final

import numpy as np

from drivers.converter import dac
from drivers.emulators.bench import Bench
from rig.device import Block, Capabilities, Device, Flag, Identity
from rig.rigfile import read_rig

CAN = Capabilities(output_low_v=-10.0, output_high_v=10.0, input_low_v=-15.0, input_high_v=15.0, min_rate_hz=1.0,
                   max_rate_hz=1e5, output_bits=14, input_bits=18)


@final
class AcmeDaq(Device):
    def __init__(self, rig):
        super().__init__()
        self._bench, self._level, self._left = Bench(read_rig(rig), CAN), None, None

    @classmethod
    def connect(cls, where):
        return cls(where)

    @classmethod
    def simulated(cls, rig, speed=1.0):
        return nullcontext(rig)

    def _identity(self):
        return Identity("ACME", "7", "1")

    def _capabilities(self):
        return CAN

    def _achievable_rate(self, rate_hz):
        return rate_hz

    def _begin(self, u, rate_hz, safe_level_v, ramp_s):
        self._bench.reset(rate_hz, 0)
        self._codes, self._at = dac(CAN).codes(u), 0

    def _read(self, timeout_s):
        part, start = self._codes[self._at:self._at + 500], self._at
        y = self._bench.play(part)[:, 0]
        self._at += part.size
        self._level = float(dac(CAN).volts(part[-1:])[0])
        return Block(start, self._bench.adc.volts(y), Flag.CLIPPED if self._bench.adc.clipped(y) else Flag.NONE)

    def _halt(self):
        pass

    def _safe(self, level_v, ramp_s):
        self._level = level_v

    def _level_v(self):
        return self._level

    def _close(self):
        pass
"""
FLAW = ("self._bench.play(part)[:, 0]", "np.roll(self._bench.play(part)[:, 0], 1)")
"""A reading late by a sample."""


def suite(folder: Path, driver: str) -> subprocess.CompletedProcess[str]:
    """Install ``driver`` as a package would, and run the contract suite on it."""
    (folder / "acme_daq.py").write_text(driver)
    installed = folder / "acme-1.dist-info"
    installed.mkdir()
    (installed / "METADATA").write_text("Metadata-Version: 2.1\nName: acme\nVersion: 1\n")
    (installed / "entry_points.txt").write_text("[rig.drivers]\nacme = acme_daq:AcmeDaq\n")
    path = os.pathsep.join([str(folder), str(ROOT), os.environ.get("PYTHONPATH", "")])
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "--no-cov", "-x", "-p", "no:cacheprovider", "-k", "acme",
         "tests/contract/test_devices.py"],
        cwd=ROOT, env={**os.environ, "PYTHONPATH": path}, capture_output=True, text=True, timeout=100, check=False)


def test_a_driver_is_tested_by_being_installed(tmp_path: Path) -> None:
    ended = suite(tmp_path, SOUND)
    assert ended.returncode == 0, ended.stdout
    assert "passed" in ended.stdout
    assert int(ended.stdout.split(" passed")[0].split()[-1]) > 20


def test_a_driver_that_breaks_the_contract_is_found_out(tmp_path: Path) -> None:
    assert SOUND.count(FLAW[0]) == 1
    assert suite(tmp_path, SOUND.replace(*FLAW)).returncode == 1


def test_a_driver_that_names_no_emulator_is_told_to() -> None:
    """The suite has nothing to connect to then, and fails with this."""
    with pytest.raises(UsageError, match="name one in its driver"), ScriptedDevice.simulated("rig.yaml"):
        pytest.fail("there is no such device")
