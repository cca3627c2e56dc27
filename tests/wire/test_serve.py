"""Does the emulator come up as a program, answer on the path it tells, and go when asked?"""

import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from rig.errors import DeviceError
from rig.plan import Limits
from rig.registry import connect
from tests.rigs import GAIN

PROGRAM = """
import sys
from drivers.emulators.serial_pty import serve
from rig.rigfile import read_rig
serve(read_rig(sys.argv[1]), lambda path: print(path, flush=True), speed=float(sys.argv[2]))
print("over")
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_emulator_serves_until_it_is_asked_to_stop(tmp_path: Path, number: signal.Signals) -> None:
    rig = tmp_path / "rig.yaml"
    rig.write_text(GAIN)
    u, rate_hz, speed = np.linspace(0.0, 3.0, 20_000), 10_000.0, 10.0
    command = [sys.executable, "-c", PROGRAM, str(rig), str(speed)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as program:
        assert program.stdout is not None
        path = program.stdout.readline().strip()
        with connect(f"serial:{path}") as device:
            begun = time.monotonic()
            y = np.concatenate([block.y for block in device.stream(u, rate_hz, Limits(-10.0, 10.0, None))])
            took_s = time.monotonic() - begun
            assert y.size == u.size
            assert u.size / rate_hz / speed < took_s < u.size / rate_hz
            program.send_signal(number)
            rest, _ = program.communicate(timeout=5)
            assert program.returncode == 0
            assert rest == "over\n"
            with pytest.raises(DeviceError, match="gone"):
                device.level_v()
