"""Does the loopback play the rig its address names, and the same again when all is repeated?"""

from pathlib import Path

import numpy as np
import pytest

from drivers.loopback import LoopbackDevice, rig_path
from rig.device import Array
from rig.errors import FileError, UsageError
from rig.plan import Limits
from tests.rigs import GAIN

LIMITS = Limits(-10.0, 10.0, None)


def record(device: LoopbackDevice, u: Array) -> Array:
    return np.concatenate([block.y for block in device.stream(u, 1000.0, LIMITS)])


@pytest.fixture
def noisy(tmp_path: Path) -> str:
    path = tmp_path / "noisy.yaml"
    path.write_text(GAIN + "noise: 10 mV\n")
    return str(path)


def test_equal_seeds_and_protocols_give_equal_noise(noisy: str) -> None:
    u = np.linspace(0, 1, 6000)
    assert np.array_equal(record(LoopbackDevice.connect(noisy), u), record(LoopbackDevice.connect(noisy), u))


def test_noise_differs_between_runs_seeds_and_protocols_and_has_its_size(noisy: str) -> None:
    u = np.zeros(6000)
    one, seeded = LoopbackDevice.connect(noisy), LoopbackDevice.connect(f"{noisy}?seed=5")
    other = u.copy()
    other[-1] = 1.0
    noises = [record(one, u), record(one, u), record(seeded, u), record(LoopbackDevice.connect(noisy), other)]
    for index, noise in enumerate(noises):
        assert np.std(noise) == pytest.approx(0.01, rel=0.05)
        for another in noises[:index]:
            assert abs(np.corrcoef(noise, another)[0, 1]) < 0.06


def test_the_default_rig_conceals_its_rails() -> None:
    y = record(LoopbackDevice.connect(""), np.full(6000, 8.0))
    assert y[-1000:].mean() == pytest.approx(10.0, abs=0.01)


def test_a_rig_is_found_as_a_path_or_beside_the_protocols(noisy: str) -> None:
    assert rig_path(noisy) == Path(noisy)
    assert rig_path("rigs/opamp_backlash.yaml") == rig_path("")


def test_an_unknown_rig_is_refused_with_those_there_are() -> None:
    with pytest.raises(FileError, match=r"rigs/none\.yaml: no such rig file.*rigs/opamp_backlash\.yaml"):
        LoopbackDevice.connect("rigs/none.yaml")


@pytest.mark.parametrize("option", ["speed=3", "seed=x", "seed=-1", "seed"])
def test_an_unknown_option_is_refused(option: str) -> None:
    with pytest.raises(UsageError, match="seed=N"):
        LoopbackDevice.connect(f"?{option}")
