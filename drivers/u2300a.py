"""How is a run played on a Keysight U2300A, output and input started by one edge?

An address is ``u2300a:USB0::0x0957::0x0F18::SERIAL::0::INSTR``. Digital output 501 bit 0 is wired to both trigger pins,
EXTD_AO_TRIG and EXTD_AI_TRIG: without that wire nothing starts. The output holds the whole run in its memory and plays
it once; what the input reads is fetched while it plays. Commands: Keysight U2300A programmer's reference.
"""

import time
from dataclasses import dataclass
from typing import final

import numpy as np

from drivers.converter import Codes, adc, dac
from drivers.scpi_link import ScpiLink
from drivers.scpi_output import Playing, ramp
from drivers.visa_resource import load
from rig.device import Block, Capabilities, Device, Flag, Identity, Samples
from rig.errors import DeviceError, UsageError

CLOCK_HZ = 48e6
MEMORY = 8_000_000
"""Samples of a pattern, and of an acquisition (programmer's reference: ACQuire:POINts, at most 8 MSa)."""
RANGE_V = 10.0
LSB_V = RANGE_V / 32768
MAX_RATE_HZ = {"U2351A": 250_000.0, "U2353A": 500_000.0}
"""Models with 16 bits both ways. The coding of the 12-bit outputs of their relatives is not known well enough here."""
INPUTS = 4
"""Channels 101 to 104; the model has 8 differential ones, and scans them in turn."""
BLOCK_S, SHORT_S, POLL_S = 0.1, 0.25, 0.003
BYTES = 2


@dataclass
class _Run(Playing):
    """One run, and how its answer is read: in blocks, or ``single``, at once."""

    block: int
    single: bool
    inputs: int


@final
class U2300a(Device):
    """A U2351A or U2353A on USB."""

    emulator = "drivers.emulators.scpi_serve:serve_u2300a"

    def __init__(self, resource_name: str) -> None:
        """Open the instrument, ask who it is, leave its output alone; raise DeviceError or UsageError."""
        super().__init__()
        self._run: _Run | None = None
        self._link = ScpiLink(resource_name)
        try:
            self._who = self._introduced()
        except DeviceError:
            self._link.close()
            raise

    @classmethod
    def connect(cls, where: str) -> "U2300a":
        """Return the instrument with the VISA address ``where``; raise UsageError or DeviceError.

        Behind ``?usb=HOST:PORT`` an emulated one is reached; `rig emulate u2300a` prints such an address.
        """
        resource_name, _, option = where.partition("?")
        if option:
            from drivers.emulators.usb_cable import plug_in

            plug_in(_cable(option))
        return cls(resource_name)

    @classmethod
    def warm_up(cls) -> None:
        """Load pyvisa."""
        load()

    @classmethod
    def port(cls, where: str) -> str:
        """Return the serial number, which an address may precede with the other numbers in several spellings."""
        return f"usb:{where.partition('?')[0].upper().split('::')[3:4]}"

    @classmethod
    def attached(cls) -> tuple[str, ...]:
        """Return the USBTMC instruments of this maker; none where USB cannot be used."""
        try:
            from pyvisa_py.usb import USBInstrSession
        except Exception:  # without libusb the import itself fails, with whatever pyusb makes of it
            return ()
        return tuple(name for name in USBInstrSession.list_resources() if "::2391::" in name or "::0x0957::" in name)

    def _introduced(self) -> Identity:
        """Return who answers; raise DeviceError for an instrument this driver does not know."""
        maker, model, serial, firmware = (part.strip() for part in self._link.introduce().split(",", 3))
        if model not in MAX_RATE_HZ:
            raise DeviceError("not an instrument this driver knows", where=self._link.name, value=f"{maker} {model}",
                              allowed=", ".join(MAX_RATE_HZ))
        return Identity(model, serial, firmware)

    def _identity(self) -> Identity:
        return self._who

    def _capabilities(self) -> Capabilities:
        top_v, max_rate_hz = 32767 * LSB_V, MAX_RATE_HZ[self._who.model]
        return Capabilities(-top_v, top_v, -top_v, top_v, min_rate_hz=3.0, max_rate_hz=max_rate_hz, output_bits=16,
                            input_bits=16, max_samples=MEMORY, inputs=INPUTS, max_total_rate_hz=max_rate_hz,
                            multiplexed=True)

    def _achievable_rate(self, rate_hz: float) -> float:
        """Return what the divider of the 48 MHz clock makes of the whole number of hertz the instrument is told."""
        return CLOCK_HZ / round(CLOCK_HZ / round(rate_hz))

    def _begin(self, u: Samples, rate_hz: float, safe_level_v: float, ramp_s: float) -> None:
        single = u.size <= min(SHORT_S * rate_hz, MEMORY / self._inputs)
        block = u.size if single else max(1, round(BLOCK_S * rate_hz))
        self._prepare(round(rate_hz))
        volts = u[:]  # the instrument takes no more than it holds, all at once
        codes = dac(self.capabilities()).codes(volts) + 32768
        self._link.tell_block("DATA", codes.astype("<u2").tobytes())
        self._link.tell("OUTP:WAV:ITER 1", "APPL:USER (@201)",
                        *((f"ACQ:POIN {block}", "DIG") if single else (f"WAV:POIN {block}", "RUN")), "OUTP ON")
        self._run = _Run(volts, rate_hz, time.monotonic(), block, single, self._inputs)
        self._link.tell("SOUR:DIG:DATA:BIT 1,0,(@501)")

    def _prepare(self, rate: int) -> None:
        """Set all that a run depends on; nothing changes at the output. Raise DeviceError where it is not taken."""
        scan = f"(@{','.join(str(101 + index) for index in range(self._inputs))})"
        self._link.tell(
            "STOP", "OUTP OFF", "ROUT:ENAB OFF,(@202)", "ROUT:ENAB ON,(@201)", "ROUT:CHAN:POL BIP,(@201)",
            f"ROUT:SCAN {scan}", f"ROUT:CHAN:RANG 10,{scan}", f"ROUT:CHAN:POL BIP,{scan}",
            f"ROUT:CHAN:STYP DIFF,{scan}",
            "CONF:DIG:DIR OUTP,(@501)", "SOUR:DIG:DATA:BIT 0,0,(@501)",
            "TRIG:SOUR EXTD", "TRIG:DTRG:POL POS", "TRIG:TYPE POST",
            "OUTP:TRIG:SOUR EXTD", "OUTP:TRIG:DTRG:POL POS", "OUTP:TRIG:TYP POST",
            f"ACQ:SRAT {rate}", f"OUTP:WAV:SRAT {rate}",
        )
        for query in ("ACQ:SRAT?", "OUTP:WAV:SRAT?"):
            made = self._link.ask_number(query)
            if round(made) != rate:
                raise DeviceError("the instrument runs at another rate", where=self._link.name,
                                  value=f"{query} {made:g} Hz", allowed=f"{rate} Hz", do="change acquisition.rate")

    def _read(self, timeout_s: float) -> Block | None:
        run = self._running()
        deadline = time.monotonic() + timeout_s
        while not (state := self._ready(run)):
            if time.monotonic() > deadline:
                return None
            time.sleep(POLL_S)
        if state == "OVER":
            return Block(run.u.size, np.empty(0), Flag.OVERRUN)
        return self._fetched(run)

    def _ready(self, run: _Run) -> str:
        """Return ``DATA`` when a block is there, ``OVER`` when the instrument lost samples, else nothing."""
        if run.single:
            return "DATA" if self._link.ask("WAV:COMP?").strip() == "YES" else ""
        state = self._link.ask("WAV:STAT?").strip()
        if state not in ("EPTY", "FRAG", "DATA", "OVER"):
            raise DeviceError("a wrong answer to 'WAV:STAT?'", where=self._link.name, value=repr(state[:40]),
                              allowed="EPTY, FRAG, DATA or OVER")
        return state if state in ("DATA", "OVER") else ""

    def _fetched(self, run: _Run) -> Block:
        """Return the next samples of the run; what was read behind its end is left out."""
        size = BYTES * run.inputs * run.block
        payload = self._link.ask_block("WAV:DATA?", size)
        if len(payload) != size:
            raise DeviceError("a block of the wrong size", where=self._link.name, value=f"{len(payload)} bytes",
                              allowed=f"{size} bytes")
        codes: Codes = np.frombuffer(payload, dtype="<i2").astype(np.int32).reshape(-1, run.inputs)
        codes = codes[:run.u.size - run.received]
        start, run.received = run.received, run.received + len(codes)
        converter = adc(self.capabilities())
        y, *further = converter.volts(codes.T)
        flags = Flag.CLIPPED if converter.clipped(codes) else Flag.NONE
        return Block(start, y, flags, np.array(further)) if further else Block(start, y, flags)

    def _running(self) -> _Run:
        """Return the run in progress."""
        if self._run is None:
            raise DeviceError("nothing was started", where=self._link.name)
        return self._run

    def _halt(self) -> None:
        """Stop both converters; a pattern cut off holds no level that could be read back, so the level is set."""
        run = self._run
        if run is not None:
            held_v = run.held_v()
            self._link.tell("OUTP OFF", "STOP", "SOUR:DIG:DATA:BIT 0,0,(@501)")
            self._run = None
            self._put_out(held_v)

    def _safe(self, level_v: float, ramp_s: float) -> None:
        try:
            self._halt()
            self._end_foreign_run(level_v)
            self._bring(level_v, ramp_s)
        except DeviceError:
            self._link.shout("OUTP OFF", "STOP", f"SOUR:VOLT {level_v:.6f},(@201)")
            raise

    def _end_foreign_run(self, level_v: float) -> None:
        """End a run that another program began and died over; nobody knows its level, so there is no ramp from it."""
        if self._link.ask("OUTP?").strip() not in ("OFF", "0"):
            self._link.tell("OUTP OFF", "STOP")
            self._put_out(level_v)

    def _bring(self, level_v: float, ramp_s: float) -> None:
        """Ramp to a level, V, and read it back; raise DeviceError when it is another."""
        ramp(self._output_v(), level_v, ramp_s, self._put_out)
        reached_v = self._output_v()
        if abs(reached_v - level_v) > LSB_V:
            raise DeviceError("the instrument did not reach the level", where=self._link.name,
                              value=f"{reached_v:g} V", allowed=f"{level_v:g} V", do="switch the rig off by hand")

    def _level_v(self) -> float | None:
        return None if self._run is not None else self._output_v()

    def _output_v(self) -> float:
        """Return the level the output was set to, V, on the grid of the DAC."""
        return float(self._quantise(np.array([self._link.ask_number("SOUR:VOLT? (@201)")]))[0])

    def _put_out(self, level_v: float) -> None:
        """Set the output, V."""
        self._link.tell(f"SOUR:VOLT {level_v:.6f},(@201)")

    def _close(self) -> None:
        self._link.close()


def _cable(option: str) -> tuple[str, int]:
    """Return the host and port of ``usb=HOST:PORT``; raise UsageError for anything else."""
    name, _, place = option.partition("=")
    host, _, port = place.rpartition(":")
    if name != "usb" or not host or not port.isdecimal():
        raise UsageError("unknown option in a u2300a address", value=option, allowed="usb=HOST:PORT")
    return host, int(port)
