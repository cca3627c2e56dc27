"""Which devices are tried?"""

from tests.wire.matrix.play import Bench
from tests.wire.matrix.serial_cases import SERIAL

BENCHES = {
    "serial": Bench("serial", SERIAL, amplitude_v=5.0, safe_level_v=1.0, lsb_v=40.0 / (2**24 - 2)),
}
