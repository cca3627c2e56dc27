"""Which faults of a serial link befall the firmware in simavr as they befall its emulator?

Those of messages. It has the hardware it has, and tells what it can in figures of its own.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

from drivers.emulators.faults import OF_THE_DEVICE
from tests.rigs import GAIN
from tests.wire.matrix.case import Case
from tests.wire.matrix.serial_cases import SERIAL
from tests.wire.simavr.bench import UNO, Board, on_simavr

RATE_HZ, SLOWER = 1000.0, 10.0
SAFE_CODE = 205
SAFE_V = SAFE_CODE * UNO.capabilities.output_lsb_v
"""1 V is no level of a DAC of 12 bits."""


def of_messages(case: Case) -> bool:
    """Return whether a case needs the link alone: no other hardware, no host that sleeps, no figure of another."""
    figures = any(fault.to == "CAP?" and fault.old for fault in case.faults.script)
    of_device = any(fault.what in OF_THE_DEVICE for fault in case.faults.script)
    return not (figures or of_device or case.naps or case.hardware)


def slowed(case: Case) -> Case:
    """Return the case with its faults at the same share of a run that has fewer samples."""
    script = (fault if fault.at_sample is None else replace(fault, at_sample=round(fault.at_sample / SLOWER))
              for fault in case.faults.script)
    in_ci = case.in_ci and any(fault.to == "INPUT" for fault in case.faults.script)
    return replace(case, faults=replace(case.faults, script=tuple(script)), in_ci=in_ci)


FIRMWARE = tuple(slowed(case) for case in SERIAL if of_messages(case))


@contextmanager
def in_simavr(kind: str, case: Case) -> Iterator[Board]:
    """Run the firmware in front of GAIN, with the faults of the case, in real time."""
    with on_simavr(GAIN, faults=case.faults) as board:
        yield board
