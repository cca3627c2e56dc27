"""What has befallen an emulated device: is it silent, deaf, or off its cable, and until when?"""

import math
from dataclasses import dataclass
from typing import Protocol

from drivers.emulators.faults import Fault, What

LOSES_ALL = (What.UNPLUGGED, What.RESTARTED)
"""Faults after which the device is as just switched on."""


class Cable(Protocol):
    """A port that can be pulled."""

    def pull(self) -> None:
        """Tear the link."""


@dataclass
class Outage:
    """When the device speaks again, when its cable is back (s of real time since power-up), and whether it hangs."""

    mute_until_s: float = -math.inf
    back_s: float = -math.inf
    hung: bool = False

    def begin(self, fault: Fault, now_s: float, port: Cable) -> None:
        """Let a fault happen to the device."""
        if fault.what is What.MUTE:
            self.mute_until_s = now_s + fault.seconds
        if fault.what is What.HUNG:
            self.hung = True
        if fault.what in (What.TORN, What.UNPLUGGED):
            port.pull()
            self.back_s = now_s + fault.seconds
