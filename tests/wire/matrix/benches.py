"""Which devices are tried?"""

from tests.wire.matrix.firmware_cases import FIRMWARE, RATE_HZ, SAFE_V, in_simavr
from tests.wire.matrix.play import Bench
from tests.wire.matrix.scpi_cases import REDPITAYA, U2300A
from tests.wire.matrix.serial_cases import SERIAL
from tests.wire.simavr.bench import UNO
from tests.wire.simavr.built import missing

BENCHES = {
    "serial": Bench("serial", SERIAL, amplitude_v=5.0, safe_level_v=1.0, lsb_v=40.0 / (2**24 - 2)),
    "u2300a": Bench("u2300a", U2300A, amplitude_v=2.5, safe_level_v=0.5, lsb_v=10.0 / 32768),
    "redpitaya": Bench("redpitaya", REDPITAYA, amplitude_v=0.5, safe_level_v=0.1, lsb_v=40.0 / (2**14 - 2)),
}
if not missing():  # a simulated controller computes all the time: side by side they would be late
    BENCHES["firmware"] = Bench(
        "firmware", FIRMWARE, amplitude_v=4.0, safe_level_v=SAFE_V, lsb_v=UNO.capabilities.input_lsb_v, rate_hz=RATE_HZ,
        made=in_simavr, at_once=1,
    )
