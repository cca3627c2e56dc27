"""How does a test get the device under test, the same test on the mock, an emulator, the firmware and the hardware?

A plug-in of pytest, installed with this package. ``pytest --rig-device serial:/dev/ttyACM0`` names the device,
``loopback:`` where nothing is named; ``emulated:KIND`` starts an emulator for the session. Whatever a test does, the
output is at its safe level before the next one. Only pytest is imported here until a test asks for the device.
"""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from rig.device import Device
    from rig.recorded import Recording

OPTION, SAFE_OPTION, SIMULATED_RIG = "--rig-device", "--rig-safe-level", "--rig-simulated"
MARKER = "rig_hardware"
EMULATED = "emulated:"


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options."""
    group = parser.getgroup("rig", "the rig under test")
    group.addoption(OPTION, metavar="ADDRESS", default="loopback:",
                    help="the device, as for `rig run --device`; emulated:KIND starts an emulator (default: loopback:)")
    group.addoption(SAFE_OPTION, metavar="QUANTITY", default="0 V", help="its level after every test (default: 0 V)")
    group.addoption(SIMULATED_RIG, metavar="RIG.yaml", default="rigs/opamp_backlash.yaml",
                    help="the rig in front of emulated:KIND (default: %(default)s)")


def pytest_configure(config: pytest.Config) -> None:
    """Declare the marker of tests that need hardware."""
    config.addinivalue_line("markers", f"{MARKER}: needs hardware; skipped on a simulated device or a recording")


def pytest_report_header(config: pytest.Config) -> str:
    """Say on what the tests run."""
    return f"rig device: {config.getoption(OPTION)}"


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip a test that needs hardware where there is none."""
    address = str(item.config.getoption(OPTION))
    if item.get_closest_marker(MARKER) is not None and is_simulated(address):
        pytest.skip(f"needs hardware, and {address} is none: name a device with {OPTION}")


def is_simulated(address: str) -> bool:
    """Return whether what is at ``address`` is no hardware."""
    from rig import registry
    from rig.errors import UsageError

    try:
        return address.startswith(EMULATED) or not registry.driver_at(address)[0].hardware
    except UsageError as error:
        raise pytest.UsageError(str(error)) from error


@pytest.fixture(scope="session")
def rig_address(request: pytest.FixtureRequest) -> Iterator[str]:
    """Give the address of the device under test, its emulator running where one was asked for."""
    from rig import registry
    from rig.session import shipped

    address = str(request.config.getoption(OPTION))
    if not address.startswith(EMULATED):
        yield address
        return
    kind = address.removeprefix(EMULATED)
    rig = str(shipped(request.config.getoption(SIMULATED_RIG)))
    with registry.driver(kind).simulated(rig) as where:
        yield f"{kind}:{where}"


@pytest.fixture
def rig_device(rig_address: str, request: pytest.FixtureRequest) -> "Iterator[Device]":
    """Give the device under test, connected; its output is at the safe level when the test is over, however it ends.

    A guardian sees to that where the tests are killed.
    """
    from rig import registry
    from rig.guardian import post
    from rig.units import quantity

    level_v = quantity(request.config.getoption(SAFE_OPTION), "V")
    with registry.connect(rig_address) as device:
        post(device)
        try:
            yield device
        finally:
            device.safe(level_v)


@pytest.fixture
def rig_record(rig_device: "Device", rig_address: str, tmp_path: Path) -> "Callable[[str | Path], Recording]":
    """Give a function that plays the protocol in a file on the device under test and returns the recording.

    A run that is not complete raises what `rig run` would tell; so does a rig file with an amplifier that the device's
    address does not have: the device would be given volts that are meant behind it.
    """
    from rig.errors import UsageError
    from rig.protocol import read_protocol
    from rig.session import at_rig, play, shipped

    def record(path: str | Path) -> "Recording":
        out = tmp_path / f"{Path(path).stem}-{len(list(tmp_path.glob('*.h5')))}.h5"
        protocol = read_protocol(shipped(path))
        if (behind := at_rig(rig_address, protocol.rig)) != rig_address:
            raise UsageError("there is an amplifier behind the device", where=str(path), do=f"name it {behind}")
        done = play(protocol, rig_address, rig_device, out)
        if done.outcome.failure is not None:
            raise done.outcome.failure
        return done.recording

    return record
