"""How can a protocol be played on a circuit that exists as a netlist, part by part?

``spice:`` is the op-amp circuit beside this file, ``spice:FILE.cir`` another netlist, in which the source drives node u
and the ADC reads node y; ``spice:RIG.yaml`` is a plain rig made of ideal parts. Options give other parts, by what they
are called in the netlist, and the noise of the reading: ``spice:?C3=220n&X7=UA741&noise=5mV&seed=3``.
"""

import zlib
from contextlib import AbstractContextManager, nullcontext
from importlib import resources
from pathlib import Path
from typing import final

import numpy as np

from drivers import circuits
from drivers.converter import adc
from drivers.idealised import idealised
from drivers.netlist import Netlist, parse_netlist
from drivers.ngspice import Simulation, missing
from identify.trace import blocks
from rig.device import Block, Capabilities, Device, Flag, Identity, Samples
from rig.errors import DeviceError, FileError, MisfitError, UsageError
from rig.rigfile import read_rig
from rig.units import quantity
from rig.yamlfile import read_text

DEFAULT, PARTS = "opamp_play.cir", "parts.cir"
NOISE = "10 mV"
BLOCK = 4096
"""Most samples a block, as the loopback has it."""
SOURCE, READ, PROBES = "u", "y", ("u", "v", "w")
"""The nodes that are driven and read, and those further inputs are wired to, as far as the netlist has them."""


@final
class SpiceDevice(Device):
    """A circuit in ngspice, between the converters of a DAQ."""

    hardware = False

    def __init__(self, circuit: Netlist, noise_v: float = 0.0, seed: int = 0) -> None:
        """Wire a circuit; equal seeds and protocols give equal noise. Raises FileError for one without u or y."""
        super().__init__()
        if absent := [node for node in (SOURCE, READ) if node not in circuit.nodes]:
            raise FileError("a node is missing", where=circuit.title, value=absent[0],
                            do="name the node u that is driven, and y that is read")
        self._circuit, self._noise_v, self._seed, self._runs = circuit, noise_v, seed, 0
        self._wired = (READ, *(node for node in PROBES if node in circuit.nodes))
        self._u: Samples = np.empty(0)
        self._running: Simulation | None = None
        self._done = 0
        self._level: float | None = None
        self._rng = np.random.default_rng(seed)

    @classmethod
    def connect(cls, where: str) -> "SpiceDevice":
        """Return the circuit at ``where``, with the options behind ``?``.

        Raises FileError for a netlist that cannot be used, UsageError for an option, DeviceError without ngspice.
        """
        if missing():
            raise DeviceError("no circuit can be simulated here", where=f"spice:{where}", value=missing())
        path, _, text = where.partition("?")
        given = _options(text)
        noise, seed = given.pop("noise", None), given.pop("seed", "0")
        circuit, own_v = _circuit(path)
        return cls(circuit.with_parts(given, stock().models), own_v if noise is None else _noise_v(noise), _seed(seed))

    @classmethod
    def port(cls, where: str) -> None:
        """Return None: the circuit is simulated for this program alone."""

    @classmethod
    def attached(cls) -> tuple[str, ...]:
        """Return the default circuit, where ngspice is installed."""
        return () if missing() else ("",)

    @classmethod
    def simulated(cls, rig: str, speed: float = 1.0) -> AbstractContextManager[str]:
        """Give the rig file itself: made of ideal parts, it is a circuit like any other."""
        return nullcontext(rig)

    def _identity(self) -> Identity:
        lines = "\n".join(self._circuit.lines).encode()
        return Identity(f"ngspice: {self._circuit.title}", f"{zlib.crc32(lines):08x}", "1")

    def _capabilities(self) -> Capabilities:
        return Capabilities(
            output_low_v=-10.0, output_high_v=10.0, input_low_v=-12.0, input_high_v=12.0, min_rate_hz=0.1,
            max_rate_hz=1e5, output_bits=16, input_bits=18, inputs=len(self._wired),
        )

    def _achievable_rate(self, rate_hz: float) -> float:
        return rate_hz

    def _begin(self, u: Samples, rate_hz: float, safe_level_v: float, ramp_s: float) -> None:
        lines = [*self._circuit.lines, *stock().lines]
        self._u, self._done = u, 0
        self._rng = np.random.default_rng([self._seed, self._runs, _checksum(u)])
        self._running = Simulation(lines, self._wired[:self._inputs], u, rate_hz)
        self._runs += 1

    def _read(self, timeout_s: float) -> Block | None:
        if self._running is None:
            return None
        read = self._running.take(BLOCK, timeout_s)
        if read is None:
            return None
        start, self._done = self._done, self._done + len(read)
        self._level = float(self._u[self._done - 1:self._done][0])
        converter = adc(self.capabilities())
        codes = converter.codes(read.T + self._rng.normal(0.0, 1.0, read.shape).T * self._noise_v)
        flags = Flag.CLIPPED if converter.clipped(codes[0]) else Flag.NONE
        y, *further = converter.volts(codes)
        return Block(start, y, flags, np.array(further)) if further else Block(start, y, flags)

    def _halt(self) -> None:
        running, self._running = self._running, None
        if running is not None:
            running.stop()

    def _safe(self, level_v: float, ramp_s: float) -> None:
        self._halt()
        self._level = float(self._quantise(np.array([level_v]))[0])

    def _played(self) -> int:
        return self._done

    def _level_v(self) -> float | None:
        return self._level

    def _close(self) -> None:
        self._halt()


def shipped(name: str) -> str:
    """Return the text of a netlist that comes with the program."""
    return (resources.files(circuits) / name).read_text(encoding="utf-8")


def stock() -> Netlist:
    """Return the models of parts that every circuit may name."""
    return parse_netlist("parts\n" + shipped(PARTS), PARTS)


def _circuit(path: str) -> tuple[Netlist, float]:
    """Return the circuit a path means, and the noise its readings have unless another is given, V."""
    if path.endswith((".yaml", ".yml", ".json")):
        rig = read_rig(path)
        return idealised(rig), rig.model.noise_v or 0.0
    text = shipped(DEFAULT) if path in ("", DEFAULT) else read_text(Path(path))
    return parse_netlist(text, path or DEFAULT), quantity(NOISE, "V")


def _options(text: str) -> dict[str, str]:
    """Return ``NAME=VALUE&...`` as a mapping; raise UsageError."""
    given: dict[str, str] = {}
    for word in filter(None, text.split("&")):
        name, equals, value = word.partition("=")
        if not (name and equals and value) or name in given:
            raise UsageError("not an option of a circuit", where="spice:", value=repr(word),
                             allowed="NAME=VALUE, each name once: a part, noise or seed", do="as in ?C3=220n&noise=5mV")
        given[name] = value
    return given


def _noise_v(text: str) -> float:
    try:
        value = quantity(text, "V")
    except MisfitError as error:
        raise UsageError(error.what, where="noise", value=error.value, allowed=error.allowed, do=error.do) from error
    if value < 0.0:
        raise UsageError("noise below zero", where="noise", value=text, allowed="0 V or more")
    return value


def _seed(text: str) -> int:
    if not text.isdecimal():
        raise UsageError("not a seed", where="seed", value=repr(text), allowed="a whole number, 0 or more")
    return int(text)


def _checksum(u: Samples) -> int:
    """Return a number that tells protocols apart."""
    told = 0
    for start, stop in blocks(0, u.size):
        told = zlib.crc32(np.ascontiguousarray(u[start:stop]).tobytes(), told)
    return told
