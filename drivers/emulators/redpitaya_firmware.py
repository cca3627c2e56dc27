"""What does a Red Pitaya's SCPI server answer, and when do its generator and its acquisition run?

Commands and their meaning: redpitaya.readthedocs.io, "List of supported SCPI & API commands", OS 2.00-18 and later.
The acquisition writes a ring of 16,384 samples; the generator walks through as many at a rate of its own.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import final

import numpy as np
from numpy.typing import NDArray

from drivers.emulators.device_model import DeviceModel, Hardware, State
from drivers.emulators.scpi_instrument import BlockHandler, Handler, RefusedError, real, whole, word
from rig.device import Capabilities, Identity

Array = NDArray[np.float64]
BUFFER = 16_384
CLOCK_HZ = 125e6
TOP = 8191
"""The largest code of 14 bits."""
HARDWARE = Hardware(
    Identity("INSTR2023", "0", "01-02"),
    Capabilities(output_low_v=-1.0, output_high_v=1.0, input_low_v=-20.0, input_high_v=20.0,
                 min_rate_hz=CLOCK_HZ / 65536, max_rate_hz=CLOCK_HZ, output_bits=14, input_bits=14,
                 max_samples=BUFFER, inputs=2),
    output_fifo=BUFFER, input_fifo=BUFFER, clock_hz=CLOCK_HZ,
)


@dataclass
class _Generator:
    """Settings of the first output, as ``GEN:RST`` leaves them."""

    function: str = "SINE"
    frequency_hz: float = 1000.0
    amplitude_v: float = 1.0
    offset_v: float = 0.0
    burst: bool = False
    initial_v: float = 0.0
    last_v: float = 0.0
    on: bool = False
    played: bool = False
    pattern: Array = field(default_factory=lambda: np.zeros(BUFFER))


@dataclass
class _Acquisition:
    """Settings of the inputs, as ``ACQ:RST`` leaves them."""

    decimation: int = 1
    delay: int = 0
    binary: bool = False
    averaging: bool = True
    gains: list[str] = field(default_factory=lambda: ["LV", "LV"])
    started: bool = False
    waits_for_generator: bool = False


@final
class RedPitayaFirmware:
    """The commands in front of a device model. ``seed`` and the count of runs choose the noise."""

    def __init__(self, model: DeviceModel, seed: int = 0) -> None:
        """Power up: the output is off."""
        self.model, self._seed, self._runs = model, seed, 0
        who = model.hardware.identity
        self.identity = f"REDPITAYA,{who.model},{who.serial},{who.firmware}"
        self._generator, self._acquisition = _Generator(), _Acquisition()
        self._rings, self._start, self._written = np.zeros((2, BUFFER)), 0, 0

    def commands(self) -> Mapping[str, Handler]:
        """Return what to do for every header."""
        return {**self._of_generator(), **self._of_acquisition()}

    def blocks(self) -> Mapping[str, BlockHandler]:
        """Return what takes a block: nothing."""
        return {}

    def reset(self, now_s: float) -> None:
        """Reset generator and acquisition."""
        self._reset_generator("", now_s)
        self._acquisition = _Acquisition()

    def advance(self, now_s: float) -> None:
        """Let time pass until ``now_s``: play what is due and write what is read into the ring."""
        self.model.advance(now_s)
        while (taken := self.model.take(BUFFER)) is not None:
            numbers = (self._start + taken[0] + np.arange(len(taken[1]))) % BUFFER
            self._rings[:, numbers] = self.model.bench.adc.volts(taken[1].T)
            self._written = taken[0] + len(taken[1])
        if self.model.state is State.RUNNING and self.model.done:
            self.model.halt(now_s)
            self._generator.played = True
            self._show(now_s)

    @property
    def busy(self) -> bool:
        """Return whether the converters run."""
        return self.model.state is not State.IDLE

    def _of_generator(self) -> dict[str, Handler]:
        """Return the commands of the output."""
        generator = self._generator
        return {
            "GENerator:RST": self._reset_generator, "SOUR1:FUNC": self._function,
            "SOUR1:FUNC?": lambda text, now_s: generator.function,
            "SOUR1:FREQ:FIX": self._frequency, "SOUR1:FREQ:FIX?": lambda text, now_s: repr(generator.frequency_hz),
            "SOUR1:VOLT": self._set("amplitude_v"), "SOUR1:VOLT?": lambda text, now_s: repr(generator.amplitude_v),
            "SOUR1:VOLT:OFFS": self._set("offset_v"),
            "SOUR1:VOLT:OFFS?": lambda text, now_s: repr(generator.offset_v),
            "SOUR1:INITValue": self._set("initial_v"),
            "SOUR1:INITValue?": lambda text, now_s: repr(generator.initial_v),
            "SOUR1:BURSt:LASTValue": self._set("last_v"),
            "SOUR1:BURSt:LASTValue?": lambda text, now_s: repr(generator.last_v),
            "SOUR1:BURSt:STAT": self._burst, "SOUR1:BURSt:NCYC": self._once, "SOUR1:BURSt:NOR": self._once,
            "SOUR1:TRACe:DATA:DATA": self._pattern, "SOUR1:TRig:SOUR": lambda text, now_s: word(text, "INT") and None,
            "SOUR1:TRig:INT": self._trigger, "OUTPUT1:STATE": self._switch,
            "OUTPUT1:STATE?": lambda text, now_s: str(int(generator.on)),
        }

    def _of_acquisition(self) -> dict[str, Handler]:
        """Return the commands of the acquisition."""
        return {
            "ACQuire:RST": self._reset_acquisition, "ACQuire:DECimation[:Factor]": self._decimate,
            "ACQuire:DECimation[:Factor]?": lambda text, now_s: str(self._acquisition.decimation),
            "ACQuire:AVG": self._average, **self._of_input(0), **self._of_input(1),
            "ACQuire:DATA:FORMAT": self._format, "ACQuire:DATA:Units": lambda text, now_s: word(text, "VOLTS") and None,
            "ACQuire:TRig:DLY": self._delay, "ACQuire:START": self._start_acquisition, "ACQuire:STOP": self._stop,
            "ACQuire:TRig": self._arm, "ACQuire:TRig:STAT?": lambda text, now_s: "TD" if self._triggered else "WAIT",
            "ACQuire:TRig:FILL?": lambda text, now_s: str(int(self._triggered and self._written >= BUFFER)),
            "ACQuire:WPOS?": lambda text, now_s: str((self._start + self._written) % BUFFER),
            "ACQuire:TPOS?": lambda text, now_s: str(self._start),
            "ACQuire:BUF:SIZE?": lambda text, now_s: str(BUFFER),
        }

    def _of_input(self, index: int) -> dict[str, Handler]:
        """Return the commands of one input."""
        name = f"ACQuire:SOUR{index + 1}"

        def set_gain(text: str, now_s: float) -> None:
            self._acquisition.gains[index] = word(text, "LV", "HV")

        def part(text: str, now_s: float) -> bytes:
            self.advance(now_s)
            start, count = (int(number) for number in text.split(","))
            if not (0 <= start < BUFFER and 0 < count <= BUFFER):
                raise RefusedError(-222)
            return self._block(index, start, count)

        return {
            f"{name}:GAIN": set_gain, f"{name}:GAIN?": lambda text, now_s: self._acquisition.gains[index],
            f"{name}:DATA?": lambda text, now_s: self._block(index, self._start, BUFFER),
            f"{name}:DATA:STArt:N?": part,
        }

    @property
    def _triggered(self) -> bool:
        return self._acquisition.started and not self._acquisition.waits_for_generator

    def _set(self, name: str) -> Handler:
        """Return what sets a voltage of the generator."""
        def take(text: str, now_s: float) -> None:
            setattr(self._generator, name, real(text, -1.0, 1.0))
            self._show(now_s)
        return take

    def _show(self, now_s: float) -> None:
        """Put out what the generator puts out while it plays nothing; an output switched off is at 0 V."""
        if self.model.state is State.RUNNING:
            return
        generator = self._generator
        if generator.function == "DC":
            level_v = generator.amplitude_v + generator.offset_v
        else:
            level_v = (generator.last_v if generator.played else generator.initial_v) + generator.offset_v
        if generator.on or self.model.level_v(now_s) is not None:
            self.model.safe(float(np.clip(level_v, -1.0, 1.0)) * generator.on, 0.0, now_s)
            self.model.advance(now_s)

    def _reset_generator(self, text: str, now_s: float) -> None:
        self.model.halt(now_s)
        vars(self._generator).update(vars(_Generator()))
        self._show(now_s)

    def _function(self, text: str, now_s: float) -> None:
        """Change the signal; what played is cut off."""
        self._generator.function = word(text, "SINE", "DC", "ARBITRARY")
        self.model.halt(now_s)
        self._show(now_s)

    def _frequency(self, text: str, now_s: float) -> None:
        self._generator.frequency_hz = real(text, 0.0, 62.5e6)

    def _burst(self, text: str, now_s: float) -> None:
        self._generator.burst = word(text, "BURST", "CONTINUOUS") == "BURST"

    def _once(self, text: str, now_s: float) -> None:
        if whole(text, 1, 65536) != 1:
            raise RefusedError(-222)

    def _pattern(self, text: str, now_s: float) -> None:
        """Keep a pattern; a short one would be played at a rate that depends on its length, so it is refused."""
        pattern = np.array(text.split(","), dtype=np.float64)
        if pattern.size != BUFFER or not np.abs(pattern).max() <= 1.0:
            raise RefusedError(-222)
        self._generator.pattern = pattern

    def _switch(self, text: str, now_s: float) -> None:
        self._generator.on = word(text, "ON", "OFF", "1", "0") in ("ON", "1")
        if not self._generator.on:
            self.model.halt(now_s)
        self._show(now_s)

    def _trigger(self, text: str, now_s: float) -> None:
        """Start the burst, and the acquisition that waits for it."""
        generator, acquisition = self._generator, self._acquisition
        if not (generator.burst and generator.on and generator.function == "ARBITRARY" and acquisition.started):
            raise RefusedError(-221)
        if acquisition.delay != BUFFER // 2 or acquisition.averaging or acquisition.gains != ["HV", "HV"]:
            raise RefusedError(-221)
        rate_hz = CLOCK_HZ / acquisition.decimation
        self.model.arm(BUFFER, rate_hz, (0.0, 0.0), self._seed + self._runs, inputs=2)
        self.model.push(0, self.model.bench.dac.codes(self._played_pattern(rate_hz)))
        self._runs += 1
        self._start, self._written = (self._start + self._written + 1234) % BUFFER, 0
        generator.played, acquisition.waits_for_generator = False, False
        self.model.go(now_s)

    def _played_pattern(self, rate_hz: float) -> Array:
        """Return what the generator puts out at the ticks of the acquisition, V."""
        generator = self._generator
        at = np.floor(np.arange(BUFFER) * (generator.frequency_hz * BUFFER / rate_hz) + 1e-6).astype(np.int64)
        inside = generator.pattern[np.minimum(at, BUFFER - 1)] * generator.amplitude_v + generator.offset_v
        return np.where(at < BUFFER, inside, generator.last_v + generator.offset_v)

    def _reset_acquisition(self, text: str, now_s: float) -> None:
        self._acquisition = _Acquisition()

    def _decimate(self, text: str, now_s: float) -> None:
        factor = whole(text, 1, 65536)
        if factor < 16 and factor not in (1, 2, 4, 8):
            raise RefusedError(-224)
        self._acquisition.decimation = factor

    def _average(self, text: str, now_s: float) -> None:
        self._acquisition.averaging = word(text, "ON", "OFF") == "ON"

    def _format(self, text: str, now_s: float) -> None:
        self._acquisition.binary = word(text, "BIN", "ASCII") == "BIN"

    def _delay(self, text: str, now_s: float) -> None:
        self._acquisition.delay = whole(text, 0, BUFFER)

    def _start_acquisition(self, text: str, now_s: float) -> None:
        self._acquisition.started, self._acquisition.waits_for_generator = True, True

    def _stop(self, text: str, now_s: float) -> None:
        self._acquisition.started = False

    def _arm(self, text: str, now_s: float) -> None:
        if word(text, "AWG_PE", "DISABLED") == "AWG_PE" and not self._acquisition.started:
            raise RefusedError(-221)

    def _block(self, index: int, start: int, count: int) -> bytes:
        """Return samples as big-endian floats in volts, or as text."""
        values = self._rings[index, (start + np.arange(count)) % BUFFER]
        if not self._acquisition.binary:
            return ("{" + ",".join(f"{value:.6f}" for value in values) + "}").encode()
        payload: bytes = values.astype(">f4").tobytes()
        size = str(len(payload))
        return f"#{len(size)}{size}".encode() + payload
