"""Does an address find its driver, and does a wrong one say what would be right?"""

from importlib.metadata import EntryPoint

import pytest

from drivers.loopback import LoopbackDevice
from rig import registry
from rig.device import Device
from rig.errors import DeviceError, UsageError
from tests.unit.rig.devices import ScriptedDevice

HERE = "tests.unit.rig.devices"


def install(monkeypatch: pytest.MonkeyPatch, **values: str) -> None:
    entries = [EntryPoint(name, value, registry.GROUP) for name, value in values.items()]
    monkeypatch.setattr(registry, "entry_points", lambda group: entries if group == registry.GROUP else [])


def test_the_shipped_drivers_are_registered() -> None:
    assert {"loopback", "serial"} <= set(registry.drivers())
    assert registry.driver("loopback") is LoopbackDevice


def test_a_scheme_reaches_its_driver_with_the_rest_of_the_address() -> None:
    with registry.connect("loopback:rigs/opamp_backlash.yaml?seed=3") as device:
        assert isinstance(device, LoopbackDevice)


@pytest.mark.parametrize("where", ["", ":", ":some:where"])
def test_a_class_can_be_named_without_being_registered(where: str) -> None:
    with registry.connect(f"{HERE}:ScriptedDevice{where}") as device:
        assert isinstance(device, ScriptedDevice)


def test_an_installed_package_adds_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    install(monkeypatch, scripted=f"{HERE}:ScriptedDevice")
    with registry.connect("scripted:x") as device:
        assert str(device.identity()) == "scripted serial 0 firmware 1"


@pytest.mark.parametrize(("address", "message"), [
    ("loopback", "not a device address: 'loopback'.*write scheme:where"),
    ("lopback:", "unknown device 'lopback'.*did you mean 'loopback'"),
    ("", "not a device address"),
    ("no.such.module:Driver", "no module 'no'"),
    (f"{HERE}:NoSuchClass", "does not import"),
    (f"{HERE}:BLOCK", "BLOCK is no driver"),
    ("rig.errors:RigError", "RigError is no driver.*subclass of rig.device.Device"),
])
def test_a_wrong_address_is_refused_with_what_would_be_right(address: str, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        registry.connect(address)


def test_an_unknown_scheme_is_refused() -> None:
    with pytest.raises(UsageError, match=r"unknown device 'serail'.*'serial'"):
        registry.driver("serail")


def test_what_is_attached_is_told_by_identity_and_what_fails_by_its_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    def attached(cls: type[Device]) -> tuple[str, ...]:
        return ("good", "bad")

    def connect(cls: type[Device], where: str) -> Device:
        if where == "bad":
            raise DeviceError("no answer", where=where)
        return ScriptedDevice(where)

    install(monkeypatch, broken="no.such.module:Driver", scripted=f"{HERE}:ScriptedDevice")
    monkeypatch.setattr(ScriptedDevice, "attached", classmethod(attached))
    monkeypatch.setattr(ScriptedDevice, "connect", classmethod(connect))
    broken, good, bad = registry.discover()
    assert broken.address == "broken:"
    assert "no module" in str(broken.problem)
    assert (good.address, str(good.identity), good.problem) == ("scripted:good", "scripted serial 0 firmware 1", None)
    assert (bad.address, bad.identity, bad.problem) == ("scripted:bad", None, "bad: no answer")
