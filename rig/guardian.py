"""Who brings the output to its safe level when the program that plays is killed and cannot do it itself?

A guardian is a process of its own, started before anything is output. It holds the end of a pipe that closes when the
program dies, by whatever cause, and the lock on the port, so that nobody gets in between. It does not touch the port
before the pipe closes; then it connects as any program would, ramps the output to the safe level, and says so on
stderr. A device with a watchdog would get there by itself, only later; one without has nobody else. (A child that the
program forked and left behind keeps pipe and port open, and the guardian away from both. Nothing here forks.)

What the two say to each other, in lines: the program ``arm LEVEL_V RAMP_S``, ``disarm``, and ``once`` when it goes of
its own will and could not make the output safe; the guardian ``ready`` once the driver is loaded, ``armed`` and
``disarmed``. The end of the pipe while disarmed is the end of the guardian.
"""

import json
import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import final

from rig import registry
from rig.device import Device
from rig.errors import DeviceError, RigError
from rig.ownership import Claim

READY_S, ANSWER_S = 20.0, 2.0
"""Longest waits for a guardian: before a run, where it costs nothing but time, and at the end of a ramp."""
TRY_FOR_S, TRY_AGAIN_S = 10.0, 0.02
"""How long a guardian tries to reach the device: the system may still be closing the port, or a cable be off."""


@dataclass(frozen=True)
class Order:
    """What to do when the pipe closes; ``once``: the program tried it for long already, over the link it had."""

    level_v: float
    ramp_s: float
    once: bool = False


@final
class Guardian:
    """The program's side: a process that watches over the device ``identity`` at ``address``."""

    def __init__(self, address: str, identity: str, claim: Claim) -> None:
        """Start the process; raise DeviceError when that fails."""
        self._where, self._said, self._ready, self._armed = address, b"", False, False
        post = json.dumps({"address": address, "identity": identity, "port": claim.port, "lock": claim.fileno(),
                           "path": sys.path})
        try:
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-m", "rig.guardian", post], env=_environment(),
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0, pass_fds=[claim.fileno()],
                start_new_session=True)
        except OSError as error:
            raise DeviceError("no guardian can be started", where=address, value=str(error.strerror),
                              do="free memory or processes; nothing was output") from error

    @property
    def alive(self) -> bool:
        """Return whether there still is such a process."""
        return self._process.poll() is None

    def ready(self) -> None:
        """Wait until the guardian has loaded its driver; raise DeviceError when it does not come to that."""
        if not self._ready:
            self._await("ready", READY_S)
            self._ready = True

    def arm(self, level_v: float, ramp_s: float) -> None:
        """Have the output brought to ``level_v`` when this program dies; raise DeviceError unless that is promised."""
        self.ready()
        self._tell(f"arm {level_v!r} {ramp_s!r}")
        self._armed = True
        self._await("armed", READY_S)

    @contextmanager
    def over(self, level_v: float, ramp_s: float) -> Iterator[None]:
        """Watch over the way to a level, and let the output be when it is there.

        A guardian that does not answer must not keep the output from getting there: it is given up, and one that is not
        ready yet is not waited for.
        """
        if not self._ready:
            yield
            return
        with self._given_up():
            self._tell(f"arm {level_v!r} {ramp_s!r}")
            self._armed = True
        yield
        with self._given_up():
            self._tell("disarm")
            self._armed = False
            self._await("disarmed", ANSWER_S)

    @contextmanager
    def _given_up(self) -> Iterator[None]:
        """Kill a guardian that is of no use any more."""
        try:
            yield
        except DeviceError:
            self._process.kill()
            self._process.wait()

    def leave(self) -> None:
        """Close the pipe and wait: one that is still armed now tries its luck, any other one ends."""
        if self._armed:
            with suppress(DeviceError):
                self._tell("once")
        for stream in (self._process.stdin, self._process.stdout):
            assert stream is not None
            with suppress(OSError):
                stream.close()
        try:
            self._process.wait(READY_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def _tell(self, line: str) -> None:
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(f"{line}\n".encode())
        except OSError as error:
            raise self._gone() from error

    def _await(self, word: str, patience_s: float) -> None:
        """Wait until the guardian says ``word``; raise DeviceError when it does not in time."""
        assert self._process.stdout is not None
        deadline = time.monotonic() + patience_s
        while word.encode() not in (lines := self._said.split(b"\n"))[:-1]:
            in_time = select.select([self._process.stdout], [], [], max(0.0, deadline - time.monotonic()))[0]
            heard = self._process.stdout.read(4096) if in_time else b""
            if not heard:
                raise self._gone()
            self._said += heard
        self._said = b"\n".join(lines[lines.index(word.encode()) + 1:])

    def _gone(self) -> DeviceError:
        """Return what is to be said when the guardian does not answer."""
        return DeviceError("the guardian does not answer", where=self._where,
                           value=f"exit code {self._process.poll()}", do="see what it wrote to stderr; then run again")


def _environment() -> dict[str, str]:
    """Return the environment in which the guardian finds this package, and nothing that hides Python's own modules."""
    home = str(Path(__file__).parents[1])
    return {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, (home, os.environ.get("PYTHONPATH"))))}


def post(device: Device) -> Guardian | None:
    """Return the guardian of ``device``, posted now or before; None where nothing outlives this program.

    It goes when the device is closed. As it takes a moment to start, it is best posted before there is need of it.
    Raises DeviceError when none can be started.
    """
    if device.claim is None:
        return None
    if device.guardian is None or not device.guardian.alive:
        device.guardian = Guardian(device.address, str(device.identity()), device.claim)
        device.held.callback(device.guardian.leave)
    return device.guardian


def watch(lines: Iterable[bytes], answer: int) -> Order | None:
    """Follow what the program says until its pipe closes; return what is then to be done, None for nothing."""
    order: Order | None = None
    for line in lines:
        if not line.endswith(b"\n"):
            break  # the program died over this line
        word, *numbers = line.decode("ascii").split()
        if word == "once" and order is not None:
            order = replace(order, once=True)
            continue
        order = Order(float(numbers[0]), float(numbers[1])) if word == "arm" else None
        _say(answer, "armed" if order else "disarmed")
    return order


def _say(answer: int, word: str) -> None:
    """Tell the program; the end of its own pipe says better than this one that it is gone."""
    with suppress(OSError):
        os.write(answer, f"{word}\n".encode())


def make_safe(address: str, identity: str, claim: Claim, order: Order) -> str:
    """Bring the output to its safe level and return the sentence that says so; raise RigError when it stays away.

    The first attempt ramps; where the device did not confirm it, the next ones jump.
    """
    ramp_s, deadline = order.ramp_s, time.monotonic() + (0.0 if order.once else TRY_FOR_S)
    while True:
        reached = False
        try:
            with registry.connect(address, claim) as device:
                _recognise(device, identity)
                reached = True
                device.safe(order.level_v, ramp_s)
            return f"the output of {identity} was brought to {order.level_v:g} V"
        except RigError:
            if time.monotonic() > deadline:
                raise
            ramp_s = 0.0 if reached else ramp_s
            time.sleep(TRY_AGAIN_S)


def _recognise(device: Device, identity: str) -> None:
    """Raise DeviceError for another device at the same address: the output of that one is none of our business."""
    if str(device.identity()) != identity:
        raise DeviceError("another device answers", where=device.address, value=str(device.identity()),
                          allowed=identity)


def main(posted: str) -> int:
    """Be a guardian; return its exit code."""
    told = json.loads(posted)
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    sys.path[:] = told["path"]
    registry.driver_at(told["address"])[0].warm_up()
    _say(1, "ready")
    order = watch(sys.stdin.buffer, 1)
    if order is None:
        return 0
    claim = Claim(told["port"], told["lock"])
    claim.sign(f"the guardian of {told['address']}, whose program died")
    try:
        said, code = make_safe(told["address"], told["identity"], claim, order), 0
    except RigError as error:
        said, code = f"the output is not confirmed safe: {error}; switch the rig off by hand", error.exit_code
    with suppress(OSError):
        sys.stderr.write(f"rig: guardian: {told['address']} was left without its program; {said}\n")
        sys.stderr.flush()
    return code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
