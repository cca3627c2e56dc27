"""How does pyusb reach an emulated USB device as if libusb had found it?

A backend in place of libusb's: everything above it, pyusb and pyvisa-py, is unchanged and cannot tell. Its bus is the
list of cables plugged in, each a TCP port of an emulator.
"""

import errno
import importlib
import socket
from array import array
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, final

import usb.backend
import usb.backend.libusb1
from usb.core import USBError, USBTimeoutError

from drivers.emulators.usb_wire import (
    BULK_IN,
    BULK_OUT,
    BUSY,
    CLAIM,
    CONTROL,
    DESCRIBE,
    IDS,
    READ,
    RELEASE,
    SETUP,
    TIMEOUT,
    packed,
    received,
)

Place = tuple[str, int]
MARGIN_S = 2.0
"""What the answer to a read may take beyond the read's own time."""
BULK_SIZE = 512


@dataclass(frozen=True)
class _Device:
    """One device on the bus."""

    place: Place
    vendor: int
    product: int


@dataclass
class _Handle:
    """An open device; only once its interface is claimed it keeps a connection, which is then to be closed."""

    place: Place
    connection: socket.socket | None = None

    def close(self) -> None:
        """Let go of the connection."""
        connection, self.connection = self.connection, None
        if connection is not None:
            connection.close()


@final
class Cables(usb.backend.IBackend):  # type: ignore[misc]
    """The backend: which devices are plugged in, and what passes between them and the host."""

    def __init__(self) -> None:
        """Start with nothing plugged in."""
        super().__init__()
        self.places: list[Place] = []

    def enumerate_devices(self) -> Iterator[_Device]:
        """Yield the devices that answer."""
        for place in self.places:
            with suppress(OSError), socket.create_connection(place, MARGIN_S) as connection:
                connection.sendall(packed(DESCRIBE))
                yield _Device(place, *IDS.unpack(received(connection)[1]))

    def get_device_descriptor(self, dev: _Device) -> Any:
        """Return the device descriptor (USB 2.0, table 9-8)."""
        return SimpleNamespace(
            bLength=18, bDescriptorType=1, bcdUSB=0x0200, bDeviceClass=0, bDeviceSubClass=0, bDeviceProtocol=0,
            bMaxPacketSize0=64, idVendor=dev.vendor, idProduct=dev.product, bcdDevice=0x0100, iManufacturer=1,
            iProduct=2, iSerialNumber=3, bNumConfigurations=1, address=1 + self.places.index(dev.place), bus=1,
            port_number=1, port_numbers=(1,), speed=3)

    def get_configuration_descriptor(self, dev: _Device, config: int) -> Any:
        """Return the one configuration (table 9-10)."""
        if config:
            raise IndexError(config)
        return SimpleNamespace(bLength=9, bDescriptorType=2, wTotalLength=32, bNumInterfaces=1, bConfigurationValue=1,
                       iConfiguration=0, bmAttributes=0xC0, bMaxPower=50, extra_descriptors=[])

    def get_interface_descriptor(self, dev: _Device, intf: int, alt: int, config: int) -> Any:
        """Return the one interface: USBTMC, USB488 (USBTMC 1.0, table 43)."""
        if intf or alt or config:
            raise IndexError(intf)
        return SimpleNamespace(bLength=9, bDescriptorType=4, bInterfaceNumber=0, bAlternateSetting=0, bNumEndpoints=2,
                       bInterfaceClass=0xFE, bInterfaceSubClass=3, bInterfaceProtocol=1, iInterface=0,
                       extra_descriptors=[])

    def get_endpoint_descriptor(self, dev: _Device, ep: int, intf: int, alt: int, config: int) -> Any:
        """Return one of the two bulk endpoints."""
        if ep > 1:
            raise IndexError(ep)
        return SimpleNamespace(bLength=7, bDescriptorType=5, bEndpointAddress=(0x02, 0x81)[ep], bmAttributes=2,
                       wMaxPacketSize=BULK_SIZE, bInterval=0, bRefresh=0, bSynchAddress=0, extra_descriptors=[])

    def open_device(self, dev: _Device) -> _Handle:
        """Return the device, opened."""
        return _Handle(dev.place)

    def close_device(self, dev_handle: _Handle) -> None:
        """Let go of the device."""
        dev_handle.close()

    def set_configuration(self, dev_handle: _Handle, config_value: int) -> None:
        """Choose the only configuration."""

    def get_configuration(self, dev_handle: _Handle) -> int:
        """Return the only configuration."""
        return 1

    def set_interface_altsetting(self, dev_handle: _Handle, intf: int, altsetting: int) -> None:
        """Choose the only setting."""

    def claim_interface(self, dev_handle: _Handle, intf: int) -> None:
        """Take the interface for this handle alone."""
        try:
            dev_handle.connection = socket.create_connection(dev_handle.place, MARGIN_S)
        except OSError as error:
            raise _gone() from error
        if self._asked(dev_handle, packed(CLAIM), MARGIN_S)[0] == BUSY:
            dev_handle.close()
            raise USBError("Resource busy", -6, errno.EBUSY)

    def release_interface(self, dev_handle: _Handle, intf: int) -> None:
        """Let others take the interface."""
        self._asked(dev_handle, packed(RELEASE), MARGIN_S)
        dev_handle.close()

    def is_kernel_driver_active(self, dev_handle: _Handle, intf: int) -> bool:
        """Return that no driver of the system has the device."""
        return False

    def bulk_write(self, dev_handle: _Handle, ep: int, intf: int, data: Any, timeout: int) -> int:
        """Send to the device."""
        self._asked(dev_handle, packed(BULK_OUT, bytes(data)), timeout / 1000)
        return len(data)

    def bulk_read(self, dev_handle: _Handle, ep: int, intf: int, buff: "array[int]", timeout: int) -> int:
        """Read from the device into ``buff``; return how many bytes."""
        answer = self._asked(dev_handle, packed(BULK_IN, READ.pack(len(buff), timeout)), timeout / 1000 + MARGIN_S)
        return _filled(buff, answer[1])

    def ctrl_transfer(
        self, dev_handle: _Handle, bmRequestType: int, bRequest: int, wValue: int, wIndex: int, data: Any, timeout: int,
    ) -> int:
        """Do a control transfer; one from the device fills ``data``."""
        setup = SETUP.pack(bmRequestType, bRequest, wValue, wIndex, len(data))
        letter, said = self._asked(dev_handle, packed(CONTROL, setup), timeout / 1000 + MARGIN_S)
        if letter == b"S":
            raise USBError("Pipe error", -9, errno.EPIPE)
        return _filled(data, said) if bmRequestType & 0x80 else len(data)

    def _asked(self, handle: _Handle, request: bytes, patience_s: float) -> tuple[bytes, bytes]:
        """Return the device's answer; raise USBError when there is none in time, or no device any more."""
        try:
            if handle.connection is not None:
                answer = _exchanged(handle.connection, request, patience_s)
            else:
                with socket.create_connection(handle.place, MARGIN_S) as connection:
                    answer = _exchanged(connection, request, patience_s)
        except TimeoutError as error:
            handle.close()  # its answer would be taken for another's
            raise _timed_out() from error
        except OSError as error:
            raise _gone() from error
        if answer[0] == TIMEOUT:
            raise _timed_out()
        return answer


CABLES = Cables()


def plug_in(place: Place) -> None:
    """Put the emulated device at ``place`` on the bus that this program sees, in place of the real one."""
    if place not in CABLES.places:
        CABLES.places.append(place)
    usb.backend.libusb1.get_backend = lambda find_library=None: CABLES
    importlib.import_module("pyvisa")
    importlib.import_module("pyvisa_py.usb")  # where it was imported without any USB before, it failed and is not there


def _exchanged(connection: socket.socket, request: bytes, patience_s: float) -> tuple[bytes, bytes]:
    """Return the answer to a request; raise OSError when there is none in time."""
    connection.settimeout(patience_s)
    connection.sendall(request)
    return received(connection)


def _filled(buffer: "array[int]", data: bytes) -> int:
    """Put ``data`` into the host's buffer; return how many bytes."""
    count = min(len(buffer), len(data))
    buffer[:count] = array("B", data[:count])
    return count


def _gone() -> USBError:
    return USBError("No such device (it may have been disconnected)", -4, errno.ENODEV)


def _timed_out() -> USBTimeoutError:
    return USBTimeoutError("Operation timed out", -7, errno.ETIMEDOUT)
