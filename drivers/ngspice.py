"""How is a circuit simulated sample by sample, with a program that knows no samples?

ngspice runs as a process of its own and writes its answer into a pipe: it waits where nobody reads, and ends where
nobody will. Its PWL source looks for every instant from the beginning of its table: hours for a long run. So u comes
from a ``filesource``, which reads on; it makes no time point where it steps, so a source of noise without amplitude
does, one each sample. u steps a ten thousandth of a period after the instant: what is read at the instant is what stood
before.
"""

import os
import select
import shutil
import subprocess
import tempfile
import time
from collections.abc import Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import final

import numpy as np

from identify.trace import Array, blocks
from rig.device import Samples
from rig.errors import DeviceError

PROGRAM = "ngspice"
INSTALL = "install ngspice (Debian, Ubuntu: apt-get install ngspice)"
LATE = 1e-4  # of a sample period
HEAD_ENDS = b"Binary:\n"
AT_ONCE = 1 << 20  # bytes of the answer
ANSWER = "out.raw"
ANALYSIS = """
Afs_ %v([u]) fs_
.model fs_ filesource (file="u.txt" amploffset=[0] amplscale=[1] timeoffset=0 timescale=1 timerelative=false
+ amplstep=true)
Vtick_ tick_ 0 TRNOISE(1u {step:.17g} 0 0)
.options method=trap
.save {saved}
.tran {step:.17g} {stop:.17g} 0 {step:.17g}
.end
"""


def missing() -> str:
    """Return what is to be installed before circuits can be simulated; empty when nothing is."""
    return "" if shutil.which(PROGRAM) else f"{PROGRAM} not found: {INSTALL}"


@final
class Simulation:
    """One run of a circuit, going on by itself until it is done or stopped."""

    def __init__(self, circuit: Sequence[str], nodes: Sequence[str], u: Samples, rate_hz: float) -> None:
        """Start; ``circuit`` are the lines of a netlist, ``nodes`` what is read. Raises DeviceError without ngspice."""
        if missing():
            raise DeviceError("no circuit can be simulated here", value=f"{PROGRAM} not found", do=INSTALL)
        self._held, self._size, self._step_s = ExitStack(), int(u.size), 1.0 / rate_hz
        self._folder = Path(self._held.enter_context(tempfile.TemporaryDirectory(prefix="rig-spice-")))
        self._done, self._bytes, self._begun = 0, b"", False
        self._rows: Array = np.empty((0, 1 + len(nodes)))
        self._write(circuit, nodes, u)
        os.mkfifo(self._folder / ANSWER)
        self._pipe = os.open(self._folder / ANSWER, os.O_RDONLY | os.O_NONBLOCK)
        self._held.callback(os.close, self._pipe)
        log = self._held.enter_context((self._folder / "log").open("w"))
        self._process = subprocess.Popen(
            [PROGRAM, "-n", "-b", "-r", ANSWER, "deck.cir"], cwd=self._folder, stdin=subprocess.DEVNULL,
            stdout=log, stderr=subprocess.STDOUT, start_new_session=True)

    @property
    def done(self) -> int:
        """Return how many samples were handed over."""
        return self._done

    def take(self, most: int, timeout_s: float) -> Array | None:
        """Return the next samples (n, nodes), at most so many, None where none came in time; raise DeviceError."""
        deadline = time.monotonic() + timeout_s
        while True:
            ended = self._process.poll() is not None
            self._catch_up(max(0.0, deadline - time.monotonic()))
            if (stop := self._reached()) > self._done:
                return self._at_instants(self._done, min(stop, self._done + most))
            if ended:
                raise DeviceError("ngspice gave up", where=f"sample {self._done} of {self._size}",
                                  value=self._last_words(), do="check the values of the netlist's parts")
            if time.monotonic() >= deadline:
                return None

    def stop(self) -> None:
        """End the process and forget its files; harmless when it has ended."""
        if self._process.poll() is None:
            self._process.kill()
        self._process.wait()
        self._held.close()

    def _write(self, circuit: Sequence[str], nodes: Sequence[str], u: Samples) -> None:
        """Write the deck, and u where it changes."""
        saved = " ".join(f"v({node})" for node in nodes)
        analysis = ANALYSIS.format(step=self._step_s, stop=self._size * self._step_s, saved=saved)
        (self._folder / "deck.cir").write_text("\n".join(["circuit", *circuit, analysis]), encoding="utf-8")
        with (self._folder / "u.txt").open("w") as table:
            table.write("0 0\n")
            level = 0.0
            for start, stop in blocks(0, self._size):
                values = np.asarray(u[start:stop])
                changed = np.flatnonzero(np.diff(values, prepend=level))
                times = (start + changed + LATE) * self._step_s
                np.savetxt(table, np.column_stack([times, values[changed]]), fmt="%.17g")
                level = float(values[-1])
            table.write(f"{(self._size + 1) * self._step_s:.17g} {level:.17g}\n")

    def _catch_up(self, timeout_s: float) -> None:
        """Read what ngspice has written since, waiting for it where there is nothing yet."""
        if self._reached() > self._done or not select.select([self._pipe], [], [], timeout_s)[0]:
            return
        fresh = os.read(self._pipe, AT_ONCE)
        if not fresh:  # it has closed the pipe, and is about to end
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(timeout_s)
            return
        self._bytes += fresh
        if not self._begun:
            _, end, rest = self._bytes.partition(HEAD_ENDS)
            if not end:
                return
            self._begun, self._bytes = True, rest
        columns = self._rows.shape[1]
        whole = len(self._bytes) // (8 * columns) * 8 * columns
        rows = np.frombuffer(self._bytes[:whole], dtype="<f8").reshape(-1, columns)
        self._rows, self._bytes = np.concatenate([self._rows, rows]), self._bytes[whole:]

    def _reached(self) -> int:
        """Return up to which sample, not included, the answer goes."""
        if not len(self._rows):
            return 0
        return min(self._size, int(np.floor(self._rows[-1, 0] / self._step_s + LATE)) + 1)

    def _at_instants(self, start: int, stop: int) -> Array:
        """Return the answer at the instants of the samples [start, stop), where ngspice has time points."""
        instants = np.arange(start, stop) * self._step_s
        times = self._rows[:, 0]
        read = np.column_stack([np.interp(instants, times, column) for column in self._rows.T[1:]])
        past = int(np.searchsorted(times, instants[-1] - LATE * self._step_s))
        self._rows, self._done = self._rows[max(past - 1, 0):], stop
        return read

    def _last_words(self) -> str:
        """Return what ngspice said of its failure."""
        said = (self._folder / "log").read_text(errors="replace").splitlines()
        told = [line.strip() for line in said if any(word in line.lower() for word in ("error", "small", "singular"))]
        return "; ".join(told[:3]) or "it ended without a word"
