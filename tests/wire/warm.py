"""What every emulator process needs and need not do again: loaded once, where the processes are forked from."""

import numpy as np

from drivers.emulators.bench import Bench
from drivers.emulators.serial_pty import HARDWARE
from rig.rigfile import parse_rig
from tests.rigs import GAIN, QUIET

for rig in (QUIET, GAIN):
    bench = Bench(parse_rig(rig, "warm"), HARDWARE.capabilities)
    bench.reset(1000.0, 0)
    bench.play(np.zeros(4, dtype=np.int32))
