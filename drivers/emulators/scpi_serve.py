"""How are the emulated Red Pitaya and U2300A offered to programs on this computer?"""

import os
from collections.abc import Callable
from dataclasses import replace

from drivers.emulators import redpitaya_firmware, u2300a_firmware
from drivers.emulators.device_model import Hardware
from drivers.emulators.faults import NO_FAULTS, Faults
from drivers.emulators.scpi_device import ScpiDevice
from drivers.emulators.stopping import until_stopped
from drivers.emulators.tcp_port import TcpPort
from drivers.emulators.usb_port import UsbPort
from drivers.emulators.usb_wire import Descriptor
from rig.rigfile import RigFile

VENDOR, PRODUCT = 0x0957, 0x0F18
Announce = Callable[[str], None]


def redpitaya(
    rig: RigFile, *, speed: float = 1.0, seed: int = 0, faults: Faults = NO_FAULTS,
    hardware: Hardware = redpitaya_firmware.HARDWARE,
) -> ScpiDevice:
    """Return a Red Pitaya on a TCP socket, in front of ``rig``."""
    return ScpiDevice(rig, redpitaya_firmware.RedPitayaFirmware, hardware, TcpPort(), b"\r\n", speed=speed, seed=seed,
                      faults=faults)


def u2300a(
    rig: RigFile, *, speed: float = 1.0, seed: int = 0, faults: Faults = NO_FAULTS,
    hardware: Hardware = u2300a_firmware.HARDWARE,
) -> ScpiDevice:
    """Return a U2351A on an emulated USB cable, in front of ``rig``; each has a serial number of its own."""
    who = replace(hardware.identity, serial=f"{hardware.identity.serial}-{os.urandom(3).hex().upper()}")
    hardware = replace(hardware, identity=who)
    name = f"USB0::0x{VENDOR:04X}::0x{PRODUCT:04X}::{who.serial}::0::INSTR"
    port = UsbPort(Descriptor(VENDOR, PRODUCT, "Agilent Technologies", who.model, who.serial), name)
    return ScpiDevice(rig, u2300a_firmware.U2300aFirmware, hardware, port, b"\n", speed=speed, seed=seed, faults=faults)


def serve_redpitaya(rig: RigFile, announce: Announce, *, speed: float = 1.0, seed: int = 0) -> None:
    """Offer a Red Pitaya until SIGINT or SIGTERM; raise OSError when the system has no port left."""
    _serve(redpitaya(rig, speed=speed, seed=seed), announce)


def serve_u2300a(rig: RigFile, announce: Announce, *, speed: float = 1.0, seed: int = 0) -> None:
    """Offer a U2351A until SIGINT or SIGTERM; raise OSError when the system has no port left."""
    _serve(u2300a(rig, speed=speed, seed=seed), announce)


def _serve(device: ScpiDevice, announce: Announce) -> None:
    with device, until_stopped() as stopped:
        device.warm_up()
        announce(device.path)
        device.run(stopped)
