"""How is a run played on a Red Pitaya, generator and acquisition started by one trigger?

An address is ``redpitaya:TCPIP::HOST::5000::SOCKET``; the SCPI server is switched on in its web page, OS 2.00-18 or
later. Both its buffers hold 16,384 samples, so that is the longest run. Its output ends at +-1 V: the amplifier behind
it is described in the rig file. The jumper of the input is at HV. Commands: redpitaya.readthedocs.io, "List of
supported SCPI & API commands".
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import final

import numpy as np

from drivers.scpi_link import ScpiLink
from drivers.scpi_output import Playing, ramp
from drivers.visa_resource import load
from rig.amplifier import behind
from rig.device import Array, Block, Capabilities, Device, Flag, Identity, Samples
from rig.emulation import offered
from rig.errors import DeviceError
from rig.rigfile import read_rig

CLOCK_HZ = 125e6
BUFFER = 16_384
MOST_DIVIDED = 65_536
POWERS = (1, 2, 4, 8, 16)
"""Decimations below 17; above, every whole number is one."""
BITS, INPUTS = 14, 2
INPUT_V, OUTPUT_V = 20.0, 1.0
BLOCK_S, POLL_S, SETUP_S = 0.02, 0.003, 3.0
BYTES = 4
TEN = "amplifier: {gain: 10, range: 10 V}"


@dataclass
class _Run(Playing):
    """One run, and where in the buffer its trigger was."""

    inputs: int
    trigger: int | None = None


@final
class RedPitaya(Device):
    """A STEMlab 125-14 on the network, its first output and both inputs."""

    emulator = "drivers.emulators.scpi_serve:serve_redpitaya"

    def __init__(self, resource_name: str) -> None:
        """Open the link, ask who is there, leave the output alone; raise DeviceError or UsageError."""
        super().__init__()
        self._run: _Run | None = None
        self._link = ScpiLink(resource_name, "\r\n")
        try:
            self._who = self._introduced()
        except DeviceError:
            self._link.close()
            raise

    @classmethod
    def connect(cls, where: str) -> "RedPitaya":
        """Return the Red Pitaya with the VISA address ``where``; raise UsageError or DeviceError."""
        return cls(where)

    @classmethod
    def warm_up(cls) -> None:
        """Load pyvisa."""
        load()

    @classmethod
    def port(cls, where: str) -> str:
        """Return host and port."""
        return f"tcp:{':'.join(where.lower().split('::')[1:3])}"

    @classmethod
    @contextmanager
    def simulated(cls, rig: str, speed: float = 1.0) -> Iterator[str]:
        """Give the address of an emulated one in front of the rig; a rig without an amplifier gets one of ten."""
        described = read_rig(rig)
        text = described.text if described.amplifier else f"{described.text.rstrip()}\n{TEN}\n"
        with TemporaryDirectory() as folder:
            amplified = Path(folder) / "amplified.yaml"
            amplified.write_text(text, encoding="utf-8")
            with offered(cls.emulator, amplified, speed) as where:
                yield behind(where, read_rig(amplified).amplifier)

    def _introduced(self) -> Identity:
        """Return who answers; raise DeviceError for anything but a Red Pitaya.

        Boards call themselves number 0, all of them: where one does, it is known by its host.
        """
        maker, model, serial, firmware = (part.strip() for part in self._link.introduce().split(",", 3))
        if maker.upper().replace(" ", "") != "REDPITAYA":
            raise DeviceError("not a Red Pitaya", where=self._link.name, value=f"{maker} {model}")
        unique = serial if serial.strip("0") else self._link.name.split("::")[1]
        return Identity(f"Red Pitaya {model}", unique, firmware)

    def _identity(self) -> Identity:
        return self._who

    def _capabilities(self) -> Capabilities:
        return Capabilities(-OUTPUT_V, OUTPUT_V, -INPUT_V, INPUT_V, min_rate_hz=CLOCK_HZ / MOST_DIVIDED,
                            max_rate_hz=CLOCK_HZ, output_bits=BITS, input_bits=BITS, max_samples=BUFFER, inputs=INPUTS)

    def _achievable_rate(self, rate_hz: float) -> float:
        return CLOCK_HZ / _decimation(rate_hz)

    def _begin(self, u: Samples, rate_hz: float, safe_level_v: float, ramp_s: float) -> None:
        volts = u[:]  # a buffer of the instrument
        self._prepare_input(_decimation(rate_hz))
        self._prepare_output(volts, rate_hz)
        self._link.tell("ACQ:START", "ACQ:TRig AWG_PE")
        self._run = _Run(volts, rate_hz, time.monotonic(), self._inputs)
        self._link.tell("SOUR1:TRig:INT", f"SOUR1:BURS:LASTValue {volts[-1]:.6f}")

    def _prepare_input(self, decimation: int) -> None:
        """Set the acquisition so that the trigger is its first sample; raise DeviceError where that is not taken."""
        self._link.tell("ACQ:RST", f"ACQ:DEC:Factor {decimation}", "ACQ:AVG OFF", "ACQ:SOUR1:GAIN HV",
                        "ACQ:SOUR2:GAIN HV", "ACQ:DATA:FORMAT BIN", "ACQ:DATA:Units VOLTS",
                        f"ACQ:TRig:DLY {BUFFER // 2}")
        for query, needed in (("ACQ:DEC:Factor?", str(decimation)), ("ACQ:SOUR1:GAIN?", "HV"),
                              ("ACQ:SOUR2:GAIN?", "HV")):
            said = self._link.ask(query).strip()
            if said != needed:
                raise DeviceError("the device did not take a setting", where=self._link.name, value=f"{query} {said}",
                                  allowed=needed, do="restart it")

    def _prepare_output(self, u: Array, rate_hz: float) -> None:
        """Load the run as one burst of the whole buffer, which holds the present level until it is triggered."""
        level_v = self._level_v() or 0.0
        pattern = np.concatenate([u, np.full(BUFFER - u.size, u[-1])])
        self._link.tell(
            f"SOUR1:INITValue {level_v:.6f}", f"SOUR1:BURS:LASTValue {level_v:.6f}", "SOUR1:BURS:STAT BURST",
            "SOUR1:BURS:NCYC 1", "SOUR1:BURS:NOR 1", "SOUR1:TRig:SOUR INT", f"SOUR1:FREQ:FIX {rate_hz / BUFFER!r}",
            "SOUR1:TRAC:DATA:DATA " + ",".join(f"{value:.6f}" for value in pattern),
            "SOUR1:VOLT:OFFS 0;:SOUR1:FUNC ARBITRARY;:SOUR1:VOLT 1", "OUTPUT1:STATE ON", timeout_s=SETUP_S,
        )

    def _read(self, timeout_s: float) -> Block | None:
        run = self._running()
        deadline = time.monotonic() + timeout_s
        least = min(run.u.size, run.received + max(1, round(BLOCK_S * run.rate_hz)))
        while (ready := min(self._ready(run), run.u.size)) < least:
            if time.monotonic() > deadline:
                return None
            time.sleep(POLL_S)
        start, run.received = run.received, ready
        assert run.trigger is not None
        at = (run.trigger + start) % BUFFER
        read = np.stack([self._fetched(source, at, ready - start) for source in range(1, 1 + run.inputs)])
        clipped = bool(np.abs(read).max() >= INPUT_V - 0.5 * self.capabilities().input_lsb_v)
        flags = Flag.CLIPPED if clipped else Flag.NONE
        return Block(start, read[0], flags, read[1:]) if run.inputs > 1 else Block(start, read[0], flags)

    def _ready(self, run: _Run) -> int:
        """Return how many samples were written since the trigger; the one being written does not count."""
        if run.trigger is None:
            if self._link.ask("ACQ:TRig:STAT?").strip() != "TD":
                return 0
            run.trigger = self._position("ACQ:TPOS?")
        if self._link.ask("ACQ:TRig:FILL?").strip() == "1":
            return BUFFER
        return max(0, (self._position("ACQ:WPOS?") - run.trigger) % BUFFER - 1)

    def _fetched(self, source: int, start: int, count: int) -> Array:
        """Return samples of an input's ring, V, in two parts where it ends between."""
        first = min(count, BUFFER - start)
        parts = [(start, first), (0, count - first)] if count > first else [(start, first)]
        return np.concatenate([self._part(source, *part) for part in parts])

    def _part(self, source: int, start: int, count: int) -> Array:
        """Return samples that stand in one piece, V; raise DeviceError when others come."""
        payload = self._link.ask_block(f"ACQ:SOUR{source}:DATA:STA:N? {start},{count}", BYTES * count)
        y = np.frombuffer(payload[:len(payload) // BYTES * BYTES], dtype=">f4").astype(np.float64)
        if len(payload) != BYTES * count or not np.isfinite(y).all() or np.abs(y).max() > 1.1 * INPUT_V:
            raise DeviceError("samples that cannot be", where=self._link.name, value=f"{len(payload)} bytes",
                              allowed=f"{count} numbers within {1.1 * INPUT_V:g} V")
        return y

    def _position(self, query: str) -> int:
        """Return a position in the ring; raise DeviceError for anything else."""
        position = self._link.ask_number(query)
        if position != int(position) or not 0 <= position < BUFFER:
            raise DeviceError(f"a wrong answer to {query!r}", where=self._link.name, value=f"{position:g}",
                              allowed=f"0 to {BUFFER - 1}")
        return int(position)

    def _running(self) -> _Run:
        """Return the run in progress."""
        if self._run is None:
            raise DeviceError("nothing was started", where=self._link.name)
        return self._run

    def _halt(self) -> None:
        """Stop the acquisition and hold the level, as a signal that can be changed and read back."""
        run = self._run
        if run is not None:
            held_v = run.held_v()
            self._link.tell(_held(held_v))
            self._run = None
            self._link.tell("ACQ:STOP")

    def _safe(self, level_v: float, ramp_s: float) -> None:
        try:
            self._halt()
            self._bring(level_v, ramp_s)
        except DeviceError:
            self._link.shout(_held(level_v))
            raise

    def _bring(self, level_v: float, ramp_s: float) -> None:
        """Ramp to a level, V, and read it back; raise DeviceError when it is another."""
        at_v = self._level_v()
        self._link.tell(_held(level_v if at_v is None else at_v))
        self._link.tell("OUTPUT1:STATE ON")
        ramp(level_v if at_v is None else at_v, level_v, ramp_s, self._put_out)
        reached_v = self._level_v()
        if reached_v is None or abs(reached_v - level_v) > self.capabilities().output_lsb_v:
            raise DeviceError("the device did not reach the level", where=self._link.name, value=f"{reached_v} V",
                              allowed=f"{level_v:g} V", do="switch the rig off by hand")

    def _put_out(self, level_v: float) -> None:
        """Change the constant level, V."""
        self._link.tell(f"SOUR1:VOLT:OFFS {level_v:.6f}")

    def _level_v(self) -> float | None:
        if self._link.ask("OUTPUT1:STATE?").strip() in ("0", "OFF") or self._link.ask("SOUR1:FUNC?").strip() != "DC":
            return None
        level_v = self._link.ask_number("SOUR1:VOLT?") + self._link.ask_number("SOUR1:VOLT:OFFS?")
        return float(self._quantise(np.array([level_v]))[0])

    def _close(self) -> None:
        self._link.close()


def _held(level_v: float) -> str:
    """Return what puts out a constant level, V, in one message: for less than a millisecond between there are 0 V."""
    return f"SOUR1:VOLT 0;:SOUR1:FUNC DC;:SOUR1:VOLT:OFFS {level_v:.6f}"


def _decimation(rate_hz: float) -> int:
    """Return the decimation whose rate is nearest to ``rate_hz``."""
    wanted = CLOCK_HZ / rate_hz
    if wanted >= POWERS[-1]:
        return min(MOST_DIVIDED, round(wanted))
    return min(POWERS, key=lambda factor: abs(CLOCK_HZ / factor - rate_hz))
