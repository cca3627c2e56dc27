"""Which part of the circuit is changed, and what must that cause by hand calculation?

The calculations use the values of parts as they stand in ``drivers/circuits`` and what a text book says; nothing here
knows the product's chain.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import combinations
from math import log, pi, sqrt

import numpy as np

KELVIN = 300.15  # ngspice's 27 degrees
V_T = 1.380649e-23 * KELVIN / 1.602176634e-19
NO_NAME = "unnamed"
GAIN, HOLD_F, FEEDBACK_OHM = 8.0, 100e-9, 80e3
TO_ADC = ("X10 z y vcc vee y TL081N", "X10 z y0 vcc vee y0 TL081N")  # room for something between the buffer and the ADC
FROM_SOURCE = ("R1 u a 20k", "R1 u1 a 20k")  # and between the source and the first resistor
HOLD, GAIN_STAGE = "C3 hc 0 100n", "X8 0 k vpp vnn o TL081N"  # lines that calculations by hand rely on
FIRST, REFERENCE = "C1 a 0 1u", "V5 ref 0 1.25"


@dataclass(frozen=True)
class Change:
    """What is done to the circuit with parts, and what follows.

    ``edits`` are lines and what replaces them, ``added`` further lines. ``effect`` and ``stage`` name the physics, ""
    where values of the plain model change and no physics is missing, ``unnamed`` where no catalogue has it.
    ``expected`` are its values, or those of the plain model by their path in ``model``, and ``because`` says how they
    follow; ``also`` is further physics the same part brings along. ``given`` are lines that these values rely on.
    """

    name: str
    done: str
    effect: str
    stage: str
    because: str
    expected: Mapping[str, float] = field(default_factory=dict)
    edits: tuple[tuple[str, str], ...] = ()
    added: tuple[str, ...] = ()
    also: tuple[str, ...] = ()
    given: tuple[str, ...] = ()

    @property
    def named(self) -> bool:
        """Return whether the catalogue has a name for what it causes."""
        return self.effect not in ("", NO_NAME)

    def applied(self, netlist: str, number: int = 0) -> str:
        """Return the netlist with the change in it; raise ValueError where a line to be edited is not there once.

        Added parts are numbered from 90 down by tens with the ``number`` of changes that were made before.
        """
        for line, other in self.edits:
            if netlist.splitlines().count(line) != 1:
                raise ValueError(f"{self.name}: {line!r} is not in the netlist once")
            netlist = netlist.replace(line, other)
        parts = [f"{part[0]}{9 - number}{part[2:]}" for part in self.added]
        return netlist.replace("\n.end", "\n" + "\n".join([*parts, ".end"]))

    def leaves(self, other: "Change") -> bool:
        """Return whether the lines of the other change, and those its values rely on, are as they were."""
        touched = {line for line, _ in self.edits}
        return touched.isdisjoint({line for line, _ in other.edits} | set(other.given))


@dataclass(frozen=True)
class Circuit:
    """The circuit with one change or several."""

    changes: tuple[Change, ...]

    @property
    def name(self) -> str:
        """Return what it is called."""
        return " and ".join(change.name for change in self.changes)

    def applied(self, netlist: str) -> str:
        """Return the netlist with all changes in it."""
        for number, change in enumerate(self.changes):
            netlist = change.applied(netlist, number)
        return netlist


def _knee(string: int) -> dict[str, float]:
    """Return n V_T and the knee of so many red diodes in series across the feedback resistor."""
    n_vt = string * 1.9 * V_T
    return {"n_vt": n_vt, "knee": n_vt * log(n_vt / (FEEDBACK_OHM * 1e-20))}


def _hum(volt: float, hertz: float, farad: float) -> float:
    """Return what a stray capacitor from the mains makes of them at the first RC."""
    w = 2.0 * pi * hertz
    return volt * w * farad * 20e3 / sqrt(1.0 + (w * 20e3 * (1e-6 + farad)) ** 2)


def _absorbed(ohm: float, farad: float, behind_ohm: float, behind_farad: float) -> dict[str, float]:
    """Return the share that comes late, and how late, in a low-pass whose capacitor has another behind a resistor."""
    fast, slow, taken = ohm * farad, behind_ohm * behind_farad, ohm * behind_farad
    middle = 0.5 * (fast + slow + taken)
    tau = middle + sqrt(middle**2 - fast * slow)
    return {"fraction": 1.0 - slow / tau, "tau": tau}


OWN = {"plateau_droop": {"current": -GAIN * 30e-12 / HOLD_F}, "saturation": {"upper": 10.0, "lower": -10.0}}
"""What every one of these circuits has, where the data tell it: the bias current of X7, a TL081, and rails."""
NOTHING = Change("nothing", "the circuit as it is", "", "", "S = 80k / 10k, D = +-1.25 V, and a droop of -2.4 mV/s",
                 {"F.S_L": 8.0, "F.D_L": 1.25, "F.S_U": 8.0, "F.D_U": -1.25})

CHANGES = (
    Change(
        "leaky hold capacitor", "120 Mohm across C3 = 100 nF", "plateau_droop", "F",
        "rate = 1 / (120 Mohm x 100 nF)", {"rate": 1.0 / (120e6 * HOLD_F)}, added=("R91 hc 0 120meg",), given=(HOLD,),
    ),
    Change(
        "741 behind the hold capacitor", "X7: TL081 -> uA741", "plateau_droop", "F",
        "current = -8 x 80 nA / 100 nF", {"current": -GAIN * 80e-9 / HOLD_F},
        (("X7 h m vcc vee m TL081N", "X7 h m vcc vee m UA741"),), given=(HOLD,),
    ),
    Change(
        "a Schottky diode in the play", "D2: picoampere diode -> BAT85, and C3: 0.1 -> 1 uF", "plateau_droop", "F",
        "current = 8 x I_s / 1 uF, I_s = 0.2 uA", {"current": GAIN * 0.2e-6 / 1e-6},
        (("D2 h r DLEAKLESS", "D2 h r DBAT85"), (HOLD, "C3 hc 0 1u")),
    ),
    Change(
        "weak supply of the gain stage", "V3: 11.5 -> 8.6 V, V4: -11.5 -> -9.4 V", "saturation", "F",
        "the amplifier ends 1.5 V before its supply, and w has the other sign",
        {"upper": 9.4 - 1.5, "lower": -8.6 + 1.5},
        (("V3 vpp 0 11.5", "V3 vpp 0 8.6"), ("V4 vnn 0 -11.5", "V4 vnn 0 -9.4")), given=(GAIN_STAGE,),
    ),
    Change(
        "hold capacitor that absorbs", "4.7 nF behind 10 Mohm across C3", "dielectric_absorption", "F",
        "fraction = 4.7 nF / 100 nF, tau = 10 Mohm x 4.7 nF", {"fraction": 0.047, "tau": 10e6 * 4.7e-9},
        added=("C91 hc da 4.7n", "R91 da 0 10meg"), given=(HOLD,),
    ),
    Change(
        "micropower gain stage", "X8: TL081 -> LT1494", "slew_limit", "F",
        "1 V/ms by its data sheet, and a pole at 2.7 kHz / 9", {"rate": 1000.0},
        ((GAIN_STAGE, "X8 0 k vpp vnn o LT1494"),), also=("extra_pole",),
    ),
    Change(
        "diodes across the gain stage", "four red LEDs in series, both ways, across R15", "diode_clamp", "F",
        "n V_T = 4 x 1.9 x 25.9 mV, knee where the string carries n V_T / 80 kohm", _knee(4),
        added=tuple(f"D9{at} {one} {two} DLED" for at, (one, two) in enumerate(
            [("k", "l1"), ("l1", "l2"), ("l2", "l3"), ("l3", "o"), ("o", "l4"), ("l4", "l5"), ("l5", "l6"), ("l6", "k")]
        )),
    ),
    Change(
        "stray capacitance past the play", "1 nF from v to the hold capacitor", "plateau_tilt", "F",
        "k = 8 x 1 nF / (100 nF + 1 nF)", {"k": GAIN * 1e-9 / (HOLD_F + 1e-9)}, added=("C91 v h 1n",), given=(HOLD,),
    ),
    Change(
        "crosstalk to the ADC", "1 kohm before the ADC, 33 kohm from the source to it", "feedthrough", "sense",
        "k = 1 kohm / (1 kohm + 33 kohm)", {"k": 1.0 / 34.0}, (TO_ADC,), ("R91 y0 y 1k", "R92 u y 33k"),
    ),
    Change(
        "mains into the first filter", "230 V of 50.013 Hz through 47 pF into C1", "hum", "G1",
        "325 V x w x 47 pF x magnitude of 20 kohm parallel to 1 uF",
        {"amplitude": _hum(325.0, 50.013, 47e-12), "frequency": 50.013},
        added=("V91 mains 0 SIN(0 325 50.013)", "C91 mains a 47p"),
    ),
    Change(
        "choke before the ADC", "470 mH, 100 ohm, 2.2 uF before the ADC", "resonance", "G2",
        "w_n = 1 / sqrt(L C), zeta = R / 2 x sqrt(C / L)",
        {"w_n": 1.0 / sqrt(0.47 * 2.2e-6), "zeta": 50.0 * sqrt(2.2e-6 / 0.47)},
        (TO_ADC,), ("R91 y0 y1 100", "L91 y1 y 470m", "C91 y 0 2.2u"),
    ),
    Change(
        "coupling capacitor before the ADC", "10 uF into 100 kohm", "ac_coupling", "sense", "T = 10 uF x 100 kohm",
        {"T": 1.0}, (TO_ADC,), ("C91 y0 y 10u", "R91 y 0 100k"),
    ),
    Change(
        "coupling capacitor behind the source", "47 uF into 100 kohm", "input_ac_coupling", "source",
        "T = 100 kohm x (47 uF + C1 = 1 uF)", {"T": 4.8}, (FROM_SOURCE,), ("C91 u u1 47u", "R91 u1 0 100k"),
    ),
    Change(
        "buffer behind the source on +-4.5 V", "a TL081 as follower, 1.5 V of swing lost each side", "input_clipping",
        "source", "4.5 V - 1.5 V", {"upper": 3.0, "lower": -3.0}, (FROM_SOURCE,),
        ("V91 v4 0 4.5", "V92 v5 0 -4.5", "X91 u u1 v4 v5 u1 TL081N"),
    ),
    Change(
        "resistor across the diodes of the play", "100 Mohm from v to C3 = 100 nF", "plateau_droop", "F",
        "rate = 1 / (100 Mohm x 100 nF), towards 8 v", {"rate": 1.0 / (100e6 * HOLD_F)},
        added=("R91 v hc 100meg",), given=(HOLD,),
    ),
    Change(
        "ripple of the reference", "V5: 1.25 V with 50 mV of 100 Hz on it", "hum", "F",
        "D_L and D_U apart by 50 mV of twice 50 Hz", {"second": 0.05, "frequency": 50.0},
        ((REFERENCE, "V5 ref 0 SIN(1.25 0.05 100)"),),
    ),
    Change(
        "ceramic capacitor in the first filter", "C1: 1 uF, with a charge of C (V - 0.004 V^3)",
        "capacitor_nonlinearity", "G1", "C dQ/dV = C (1 - 3 x 0.004 V^2) behind 20 kohm", {"k2": 0.012, "tau": 0.02},
        ((FIRST, "C1 a 0 Q='1u*V(a)*(1-0.004*V(a)*V(a))'"),),
    ),
    Change(
        "junction as capacitor in the first filter", "C1: 1 uF, with a charge of C (V - 0.01 V^2)",
        "capacitor_nonlinearity", "G1", "C dQ/dV = C (1 - 2 x 0.01 V) behind 20 kohm", {"k1": 0.02, "tau": 0.02},
        ((FIRST, "C1 a 0 Q='1u*V(a)*(1-0.01*V(a))'"),),
    ),
    Change(
        "first capacitor that absorbs", "47 nF behind 1 Mohm across C1", "dielectric_absorption", "G1",
        "tau = the slower root of (p - 20 ms) (p - 47 ms) = p x 20 kohm x 47 nF, (1 - fraction) tau = 47 ms",
        _absorbed(20e3, 1e-6, 1e6, 47e-9),
        added=("C91 a da1 47n", "R91 da1 0 1meg"), given=(FIRST,),
    ),
    Change(
        "resistor of the gain stage that warms", "R15: 2 % less a kelvin, 15 mK/V^2, 0.3 s", "self_heating", "F",
        "k = 2 % x 0.3 x 0.05 / V^2, tau = 0.3 ohm x 1 F", {"k": 3e-4, "tau": 0.3},
        added=("C91 th 0 1", "R91 th 0 0.3", "B91 0 th I='V(o)*V(o)*0.05'", "B92 o k I='(V(o)-V(k))/80k*0.02*V(th)'"),
    ),
    Change(
        "wrong resistor in the gain stage", "R15: 80 -> 75 kohm", "", "", "S = 75 kohm / 10 kohm",
        {"F.S_L": 7.5, "F.S_U": 7.5, "F.D_L": 1.25, "F.D_U": -1.25}, (("R15 k o 80k", "R15 k o 75k"),),
    ),
    Change(
        "wrong capacitor in the first filter", "C1: 1 -> 1.5 uF", "", "", "tau = 20 kohm x 1.5 uF",
        {"G1.tau": 0.03}, ((FIRST, "C1 a 0 1.5u"),),
    ),
    Change(
        "no catch diodes", "D3 and D4 left out", NO_NAME, "F",
        "the blocked amplifier must come back from its rail, later by a law of the square root of the rate",
        edits=(("D3 n p D1N4148", "* no D3"), ("D4 r q D1N4148", "* no D4")),
    ),
    Change(
        "feedback before the diode", "R11 and R12 from p and r in place of m", "diode_contact", "F",
        "n V_T = 1.1 x 25.9 mV at 27 degrees C; past the play 2 pF of either diode, k = 8 x 4 pF / 100 nF and less",
        {"n_vt": 0.02845}, (("R11 m n 10k", "R11 p n 10k"), ("R12 m q 10k", "R12 r q 10k")), also=("plateau_tilt",),
    ),
    Change(
        "ripple of the reference, off the mains", "V5: 1.25 V with 30 mV of 86.3 Hz on it", NO_NAME, "F",
        "D_L and D_U apart by a line that is none of the mains'", edits=((REFERENCE, "V5 ref 0 SIN(1.25 0.03 86.3)"),),
    ),
    Change(
        "follower without bias behind the gain stage", "100 mV lost on either side of zero", NO_NAME, "F",
        "what a class-B stage does around zero is a law of w", edits=(("R16 o i 20k", "R16 o2 i 20k"),),
        added=("B91 o2 0 V='V(o)>0.1 ? V(o)-0.1 : (V(o)<-0.1 ? V(o)+0.1 : 0)'",),
    ),
)  # fmt: skip
SINGLE = tuple(Circuit((change,)) for change in (NOTHING, *CHANGES))
_TOGETHER = [
    Circuit((one, other))
    for one, other in combinations((change for change in CHANGES if change.named), 2)
    if one.effect != other.effect and one.leaves(other) and other.leaves(one)
]
PAIRS = tuple(_TOGETHER[i] for i in np.random.default_rng(0).permutation(len(_TOGETHER)))
"""All pairs of changes that bring different physics and leave each other's parts alone, shuffled once and for all."""
