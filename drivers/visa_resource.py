"""How is a VISA resource opened, and what is an operator told when pyvisa fails?"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rig.errors import DeviceError

if TYPE_CHECKING:
    from pyvisa.resources import MessageBasedResource

OPEN_S = 3.0


def load() -> None:
    """Load what opening a resource needs; that takes some tenths of a second."""
    import pyvisa

    pyvisa.ResourceManager("@py")


def opened(resource_name: str) -> "MessageBasedResource":
    """Return the resource of this name, opened by pyvisa-py; raise DeviceError when it is not there."""
    import pyvisa

    with told(resource_name):
        manager = pyvisa.ResourceManager("@py")
        try:
            return manager.open_resource(resource_name, open_timeout=int(1000 * OPEN_S))  # type: ignore[return-value]
        except Exception as error:  # pyvisa-py raises whatever is underneath, and bare Exception itself
            raise _unopened(resource_name, str(error) or repr(error)) from error


def _unopened(resource_name: str, why: str) -> DeviceError:
    """Return the error for a resource that does not open: it is not there, or this computer cannot use USB."""
    if "PyUSB" in why or "backend" in why:
        return DeviceError("USB cannot be used on this computer", where=resource_name, value="libusb is missing",
                           do="install libusb-1.0; Debian: apt install libusb-1.0-0")
    return DeviceError("the device cannot be opened", where=resource_name, value=why.splitlines()[0],
                       do="check that it is on and connected, and that its address is right")


@contextmanager
def told(name: str) -> Iterator[None]:
    """Turn what goes wrong in pyvisa, pyusb or a socket into a DeviceError that says what to do."""
    try:
        yield
    except (OSError, ValueError, AttributeError, KeyError) as error:
        raise DeviceError("the link to the device is gone", where=name, value=str(error) or repr(error),
                          do="check cable and power, then start again") from error
    except Exception as error:
        if not type(error).__module__.startswith(("pyvisa", "usb")):
            raise
        raise DeviceError("the link to the device failed", where=name, value=str(error), do="start again") from error
