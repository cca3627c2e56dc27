"""What does a Keysight U2300A answer, and when do its converters run?

The commands are those of the U2300A programmer's reference that the driver uses, and those that show what goes wrong
without them: an output switched on without the trigger starts 7 ms after the input. Behind it is the device model.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import final

import numpy as np
from numpy.typing import NDArray

from drivers.emulators.device_model import DeviceModel, Hardware, State
from drivers.emulators.scpi_instrument import BlockHandler, Handler, RefusedError, real, whole, word
from rig.device import Capabilities, Identity

Codes = NDArray[np.int32]
LSB_V = 10.0 / 32768
CLOCK_HZ = 48e6
MEMORY = 8_000_000
"""Samples: of one acquisition, and of the output's pattern."""
UNTRIGGERED_S = 0.007
FEED, WAITING_FEED, ENDLESS = 4096, 32, 1 << 40
"""Samples given to the DAC at once; few while its pattern may yet be switched on."""

HARDWARE = Hardware(
    Identity("U2351A", "EMU", "A.2009.08.18"),
    Capabilities(output_low_v=-32767 * LSB_V, output_high_v=32767 * LSB_V, input_low_v=-32767 * LSB_V,
                 input_high_v=32767 * LSB_V, min_rate_hz=3.0, max_rate_hz=250_000.0, output_bits=16, input_bits=16,
                 buffer_samples=1 << 20, max_samples=MEMORY, inputs=4, max_total_rate_hz=250_000.0, multiplexed=True),
    output_fifo=4 * FEED, input_fifo=1 << 20, clock_hz=CLOCK_HZ,
)


@dataclass
class _Settings:
    """What ``*RST`` makes of every setting."""

    input_rate: int = 1000
    output_rate: int = 1000
    points: int = 500
    block: int = 500
    iterations: int = 0
    input_waits: bool = False
    output_waits: bool = False
    enabled: bool = False
    user: bool = False
    scan: tuple[int, ...] = (101,)
    pattern: Codes = field(default_factory=lambda: np.zeros(0, dtype=np.int32))


@final
class U2300aFirmware:
    """The commands in front of a device model. ``seed`` and the count of runs choose the noise."""

    def __init__(self, model: DeviceModel, seed: int = 0) -> None:
        """Power up: 0 V at the output."""
        self.model, self._seed, self._runs = model, seed, 0
        who = model.hardware.identity
        self.identity = f"Agilent Technologies,{who.model},{who.serial},{who.firmware}"
        self._set = _Settings()
        self._level_v, self._bit = 0.0, False
        self._idle()

    def commands(self) -> Mapping[str, Handler]:
        """Return what to do for every header."""
        return {
            "ACQuire:SRATe": self._input_rate, "ACQuire:SRATe?": lambda text, now_s: str(self._set.input_rate),
            "ACQuire:POINts": self._points, "ACQuire:POINts?": lambda text, now_s: str(self._set.points),
            "WAVeform:POINts": self._block, "WAVeform:POINts?": lambda text, now_s: str(self._set.block),
            "ROUTe:SCAN": self._scan, "ROUTe:SCAN?": lambda text, now_s: _channels(self._set.scan),
            "ROUTe:CHANnel:RANGe": self._accept("10"), "ROUTe:CHANnel:POLarity": self._accept("BIPolar"),
            "ROUTe:CHANnel:STYPe": self._accept("DIFFerential", "SINGleended", "NRS"),
            "ROUTe:ENABle": self._enable, "CONFigure:DIGital:DIRection": self._accept("OUTPut", "INPut"),
            "TRIGger:SOURce": self._input_trigger, "OUTPut:TRIGger:SOURce": self._output_trigger,
            "TRIGger:DTRiGger:POLarity": self._accept("POSitive"), "TRIGger:TYPE": self._accept("POST"),
            "OUTPut:TRIGger:DTRiGger:POLarity": self._accept("POSitive"),
            "OUTPut:TRIGger:TYPe": self._accept("POST"),
            "OUTPut:WAVeform:ITERate": self._iterate, "OUTPut:WAVeform:SRATe": self._output_rate,
            "OUTPut:WAVeform:SRATe?": lambda text, now_s: str(self._set.output_rate),
            "APPLy:USER": self._use_pattern, "SOURce:VOLTage": self._volt,
            "SOURce:VOLTage?": lambda text, now_s: f"{self._level_v:.6f}",
            "SOURce:DIGital:DATA:BIT": self._digital, "OUTPut": self._switch,
            "OUTPut?": lambda text, now_s: "ON" if self._output_on else "OFF",
            "DIGitize": self._digitize, "RUN": self._run, "STOP": self._stop,
            "WAVeform:COMPlete?": self._complete, "WAVeform:STATus?": self._status, "WAVeform:DATA?": self._data,
        }

    def blocks(self) -> Mapping[str, BlockHandler]:
        """Return what takes a block: the pattern of the output."""
        return {"DATA": self._pattern}

    def reset(self, now_s: float) -> None:
        """Stop all and put 0 V out."""
        self._stop("", now_s)
        self._set = _Settings()
        self._put_out(0.0, now_s)

    def advance(self, now_s: float) -> None:
        """Let time pass until ``now_s``: keep the converters fed and play what is due."""
        while self.model.state is State.RUNNING:
            self._feed()
            fed_until_s = self._started_s + (self.model.accepted - 0.5) / self.model.rate_hz
            self.model.advance(min(now_s, fed_until_s))
            if now_s <= fed_until_s or self.model.done:
                return
        self.model.advance(now_s)

    @property
    def busy(self) -> bool:
        """Return whether the converters run."""
        return self.model.state is not State.IDLE

    def _idle(self) -> None:
        """Forget the last acquisition."""
        self._armed, self._continuous, self._output_on, self._triggered, self._playing = [False] * 5
        self._started_s, self._delay = 0.0, 0

    def _feed(self) -> None:
        """Give the DAC what comes next of the pattern; before and behind it the output holds."""
        pattern = self._set.pattern
        if self._playing:
            numbers = self.model.accepted + np.arange(FEED) - self._delay
            within = pattern[np.clip(numbers, 0, pattern.size - 1)]
            codes = np.where(numbers < 0, self._held, within).astype(np.int32)
        else:
            codes = np.full(WAITING_FEED if pattern.size else FEED, self._held, dtype=np.int32)
        self.model.push(self.model.accepted, codes)

    @property
    def _may_play(self) -> bool:
        """Return whether a pattern is there that ``OUTP ON`` plays; raise RefusedError where its rate is another."""
        settings = self._set
        if settings.input_rate != settings.output_rate:
            raise RefusedError(-221)
        return settings.user and settings.enabled and settings.pattern.size > 0

    def _begin(self, now_s: float) -> None:
        """Start the clock: of the input, and of the output where that waits for the same edge."""
        settings = self._set
        if settings.input_rate * len(settings.scan) > self.model.hardware.capabilities.max_rate_hz:
            raise RefusedError(-221)
        self.model.arm(ENDLESS if self._continuous else settings.points, settings.input_rate, (0.0, 0.0),
                       self._seed + self._runs, len(settings.scan))
        self._runs += 1
        self._playing, self._delay = self._output_on and settings.output_waits and self._may_play, 0
        self._held = int(self.model.bench.dac.codes(np.array([self.model.level_v(now_s) or 0.0]))[0])
        self._started_s, self._triggered = now_s, True
        self._feed()
        self.model.go(now_s)

    def _digitize(self, text: str, now_s: float) -> None:
        """Acquire once; at once unless the input waits for its trigger."""
        self._arm(now_s, continuous=False)

    def _run(self, text: str, now_s: float) -> None:
        """Acquire until stopped."""
        self._arm(now_s, continuous=True)

    def _arm(self, now_s: float, continuous: bool) -> None:
        output_on = self._output_on
        self._stop("", now_s)
        self._armed, self._continuous, self._output_on = True, continuous, output_on
        if not self._set.input_waits:
            self._begin(now_s)

    def _switch(self, text: str, now_s: float) -> None:
        """Switch the pattern on, to wait for its trigger where it has one, or off; off holds the level."""
        self._output_on = word(text, "ON", "OFF") == "ON"
        self.advance(now_s)
        if not self._output_on:
            self._stop("", now_s)
        elif self.busy and not self._playing and not self._set.output_waits and self._may_play:
            at_s = now_s - self._started_s + UNTRIGGERED_S
            self._delay, self._playing = max(self.model.accepted, round(at_s * self.model.rate_hz)), True

    def _digital(self, text: str, now_s: float) -> None:
        """Set a bit of the digital output; one wired to both trigger pins starts both converters with its rise."""
        bit = whole(text.partition(",")[0], 0, 1) == 1
        rises, self._bit = bit and not self._bit, bit
        if rises and self._armed and self._set.input_waits and not self._triggered:
            self._begin(now_s)

    def _stop(self, text: str, now_s: float) -> None:
        """Stop the clock; the output holds what it has."""
        self.advance(now_s)
        self.model.halt(now_s)
        self._idle()

    def _complete(self, text: str, now_s: float) -> str:
        """Return whether the single acquisition is over."""
        self.advance(now_s)
        return "YES" if self._triggered and self.model.done else "NO"

    def _status(self, text: str, now_s: float) -> str:
        """Return how much a continuous acquisition has: nothing, some, a block, or more than it could keep."""
        self.advance(now_s)
        ready = self.model.played - self.model.sent
        if self.model.overrun_samples:
            return "OVER"
        return "DATA" if ready >= self._set.block else "FRAG" if ready else "EPTY"

    def _data(self, text: str, now_s: float) -> bytes:
        """Return the next block of a continuous acquisition, or all of a single one, as little-endian words."""
        self.advance(now_s)
        most = self._set.block if self._continuous else self._set.points
        taken = self.model.take(most)
        codes = taken[1] if taken else np.zeros(0, dtype=np.int32)
        payload = codes.astype("<i2").tobytes()
        return f"#8{len(payload):08d}".encode() + payload

    def _pattern(self, payload: bytes, now_s: float) -> None:
        """Keep a pattern of little-endian words, offset binary."""
        if len(payload) % 2 or not 0 < len(payload) // 2 <= MEMORY:
            raise RefusedError(-161)
        self._set.pattern = np.frombuffer(payload, dtype="<u2").astype(np.int32) - 32768

    def _volt(self, text: str, now_s: float) -> None:
        """Put out a level."""
        self._put_out(real(text.partition(",")[0], -10.0, 10.0), now_s)

    def _put_out(self, level_v: float, now_s: float) -> None:
        if self.model.state is State.RUNNING and not self.model.done:
            raise RefusedError(-221)
        self._level_v = level_v
        self.model.safe(level_v, 0.0, now_s)
        self.model.advance(now_s)

    def _input_rate(self, text: str, now_s: float) -> None:
        self._set.input_rate = whole(text, 3, round(self.model.hardware.capabilities.max_rate_hz))

    def _output_rate(self, text: str, now_s: float) -> None:
        self._set.output_rate = whole(text, 0, 1_000_000)

    def _points(self, text: str, now_s: float) -> None:
        self._set.points = whole(text, 1, min(MEMORY, self.model.hardware.input_fifo))

    def _block(self, text: str, now_s: float) -> None:
        self._set.block = whole(text, 1, self.model.hardware.input_fifo)

    def _scan(self, text: str, now_s: float) -> None:
        listed = tuple(int(number) for number in text.strip().removeprefix("(@").removesuffix(")").split(","))
        if listed != tuple(range(101, 101 + len(listed))) or len(listed) > self.model.hardware.capabilities.inputs:
            raise RefusedError(-224)
        self._set.scan = listed

    def _enable(self, text: str, now_s: float) -> None:
        state, _, channels = text.partition(",")
        if channels.strip() == "(@201)":
            self._set.enabled = word(state, "ON", "OFF") == "ON"

    def _iterate(self, text: str, now_s: float) -> None:
        self._set.iterations = whole(text, 0, 0xFFFFFF)

    def _input_trigger(self, text: str, now_s: float) -> None:
        self._set.input_waits = word(text, "NONE", "EXTD") == "EXTD"

    def _output_trigger(self, text: str, now_s: float) -> None:
        self._set.output_waits = word(text, "NONE", "EXTD") == "EXTD"

    def _use_pattern(self, text: str, now_s: float) -> None:
        self._set.user = True

    def _accept(self, *allowed: str) -> Handler:
        """Return what takes a setting of which the model knows one value only."""
        def take(text: str, now_s: float) -> None:
            word(text.partition(",")[0].strip(), *allowed)
        return take


def _channels(numbers: tuple[int, ...]) -> str:
    """Return a channel list (SCPI-99, 8.3.2)."""
    return f"(@{','.join(map(str, numbers))})"
