"""Which driver does a device address mean, and what is attached?

An address is ``scheme:where``. Schemes are the entry points of group ``rig.drivers``, so an installed package adds its
own; ``module:Class`` and ``module:Class:where`` reach a driver class that is not registered.
"""

import importlib
import re
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path

from rig import ownership
from rig.amplified_device import AmplifiedDevice
from rig.amplifier import behind, parted
from rig.device import Device, Identity
from rig.errors import MisfitError, RigError, UsageError, unknown
from rig.ownership import Claim
from rig.progress import Show, silent
from rig.references import file_meant

GROUP = "rig.drivers"
_CLASS_ADDRESS = re.compile(r"(?P<module>[A-Za-z_][\w.]*):(?P<name>[A-Z]\w*)(?::(?P<where>.*))?")


@dataclass(frozen=True)
class Attached:
    """One device found: its address, and who it is or why it would not say."""

    address: str
    identity: Identity | None
    problem: str | None = None


def drivers() -> dict[str, EntryPoint]:
    """Return the installed drivers by scheme, none of them imported."""
    return {entry.name: entry for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.name)}


def connect(address: str, claim: Claim | None = None) -> Device:
    """Return the device at ``address``, connected and with its output untouched, its port locked until it is closed.

    An address with an amplifier means voltages behind it (``rig/amplifier.py``).
    With ``claim`` the port is locked already, and stays so. Raises UsageError for an address that names no driver,
    DeviceError when the device does not answer or is in use.
    """
    amplifier = parted(address)[1]
    kind, where = driver_at(address)
    with ExitStack() as held:
        port = kind.port(where)
        if claim is None and port is not None:
            claim = ownership.claim(port)
            held.callback(claim.release)
        device = kind.connect(where)
        if amplifier is not None:
            device = AmplifiedDevice(device, amplifier)
        device.address, device.claim = address, claim
        device.held.push(held.pop_all())
    return device


def driver_at(address: str) -> tuple[type[Device], str]:
    """Return the driver class an address means, and what follows; raise UsageError when it means none."""
    address = parted(address)[0]
    scheme, colon, where = address.partition(":")
    if not colon:
        raise UsageError("not a device address", value=repr(address), allowed=_forms(), do="write scheme:where")
    if scheme in drivers():
        return driver(scheme), where
    if match := _CLASS_ADDRESS.fullmatch(address):
        return _driver_class(match["module"], match["name"], address), match["where"] or ""
    raise UsageError(**unknown("device", scheme, list(drivers())), where=address)


def address_in(folder: Path, address: str) -> str:
    """Return the device a protocol in ``folder`` names; a file that stands for a device is seen from there.

    Raises MisfitError for a driver that is not installed, which would run any code there is, and for a file elsewhere.
    """
    bare, amplifier = parted(address)
    scheme, colon, where = bare.partition(":")
    if scheme not in drivers() and _CLASS_ADDRESS.fullmatch(bare):
        raise MisfitError("a protocol names the device of an installed driver", value=repr(bare),
                          allowed=", ".join(f"{known}:..." for known in drivers()), do="give this one with --device")
    if not colon or scheme not in drivers() or driver(scheme).hardware or not where:
        return address
    name, mark, option = where.partition("?")
    if not name:  # options alone
        return address
    found = file_meant(name, folder)
    if found is None:
        raise MisfitError("no such file", value=name, do="give its path as seen from this protocol")
    return behind(f"{scheme}:{found}{mark}{option}", amplifier)


def driver(scheme: str) -> type[Device]:
    """Return the driver class registered for ``scheme``; raise UsageError when there is none or it does not import."""
    try:
        entry = drivers()[scheme]
    except KeyError:
        raise UsageError(**unknown("device", scheme, list(drivers()))) from None
    module, _, name = entry.value.partition(":")
    return _driver_class(module, name, f"{scheme}:")


def emulators() -> dict[str, str]:
    """Return the emulator, ``module:function``, of every kind of device that has one; failing drivers are left out."""
    found = {}
    for scheme in drivers():
        with suppress(UsageError):
            found[scheme] = driver(scheme).emulator
    return {scheme: emulator for scheme, emulator in found.items() if emulator}


def discover(progress: Show = silent) -> tuple[Attached, ...]:
    """Ask everything that may be a device who it is; one that does not answer is listed with the reason."""
    found, schemes = [], drivers()
    for index, scheme in enumerate(schemes):
        progress(f"{scheme}:", index / len(schemes))
        try:
            places = driver(scheme).attached()
        except RigError as error:
            found.append(Attached(f"{scheme}:", None, str(error)))
            continue
        found.extend(_ask(f"{scheme}:{where}") for where in places)
    return tuple(found)


def _ask(address: str) -> Attached:
    """Return who is at ``address``, or why that cannot be told."""
    try:
        with connect(address) as device:
            return Attached(address, device.identity())
    except RigError as error:
        return Attached(address, None, str(error))


def _driver_class(module: str, name: str, address: str) -> type[Device]:
    """Return the class ``name`` of ``module``; raise UsageError when it cannot be imported or is no driver."""
    try:
        found = getattr(importlib.import_module(module), name)
    except ModuleNotFoundError as error:
        raise UsageError(f"no module {error.name!r}", where=address, allowed=_forms(),
                         do="install the package that holds the driver") from error
    except (ImportError, AttributeError) as error:
        raise UsageError(f"the driver does not import: {error}", where=address) from error
    if not (isinstance(found, type) and issubclass(found, Device)):
        raise UsageError(f"{name} is no driver", where=address, allowed="a subclass of rig.device.Device")
    return found


def _forms() -> str:
    """Return the forms an address may take."""
    return ", ".join([*(f"{scheme}:..." for scheme in drivers()), "module:Class"])


