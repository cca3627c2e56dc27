"""Which devices are tried, and what is played on them?"""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from rig.device import Array
from tests.rigs import GAIN
from tests.wire.emulated import Emulated, emulated
from tests.wire.matrix.case import Case
from tests.wire.matrix.play import Bench
from tests.wire.matrix.serial_cases import SERIAL

WAVES = """
spec: 1
title: waves
question: What becomes of them on a link that fails?
limits: {level: 10 V}
acquisition: {rate: 10 kHz}
safe_level: 1 V
ramp: 0.1 s
steps:
  - sine: {frequency: 7 Hz, amplitude: 5 V, periods: 7}
"""


def tripled(u: Array) -> Array:
    """Return what GAIN answers to ``u``, the output at 0 V before; y[k] is read before u[k] acts."""
    return 3.0 * np.concatenate([[0.0], u[:-1]])


@contextmanager
def serial(case: Case) -> Iterator[Emulated]:
    """Emulate a serial DAQ with the faults of ``case``."""
    with emulated(GAIN, speed=case.speed, faults=case.faults, **case.hardware) as device:
        yield device


BENCHES = {"serial": Bench("serial", SERIAL, serial, WAVES, tripled)}
