"""Which cases has nobody looked at while the explainer was built? Rig, physics, size and noise come from a seed."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from tests.proof.cases import Case, Concealed, Finding
from tests.proof.rigs import OP_AMP, RC, SKEWED, Rig

CLEAN, ONE, TWO = 0.15, 0.55, 0.15  # share of cases; the rest is physics outside the library
SIZES = (0.5, 20.0)  # mismatch rms over noise rms once the plain model is refitted, roughly
NOISES_V = (0.003, 0.020)
SPREAD = 0.12  # of the values in a rig file, around those the explainer was built with
HIGHEST_V, LOWEST_V = 3.0, -3.5  # of v that the staircases reach

Rng = np.random.Generator
Values = dict[str, float]
Piece = tuple[Concealed, Finding | None]
Draw = Callable[[Rng, Rig, float], Piece]


def drawn(seed: int) -> Case:
    """Return the case of a seed: clean, one effect, two effects of different stages, or physics without a name."""
    rng = np.random.default_rng([seed, 20261121])
    lot = float(rng.uniform())
    kinds = _kinds(rng, lot)
    nominal = _rig(rng, kinds)
    pieces = [_piece(rng, nominal, kind) for kind in kinds]
    name = " and ".join(kinds) or "clean"
    found = tuple(finding for _, finding in pieces if finding is not None)
    return Case(f"{name}, {nominal.name}", nominal, tuple(concealed for concealed, _ in pieces), found, seed)


def _kinds(rng: Rng, lot: float) -> tuple[str, ...]:
    """Return which physics is concealed."""
    if lot < CLEAN:
        return ()
    if lot < CLEAN + ONE:
        return (str(rng.choice(list(LIBRARY))),)
    if lot < CLEAN + ONE + TWO:
        return _pair(rng)
    return (str(rng.choice(list(OUTSIDE))),)


def _pair(rng: Rng) -> tuple[str, str]:
    """Return two pieces of library physics at different stages."""
    first = str(rng.choice(list(LIBRARY)))
    others = [kind for kind in LIBRARY if STAGES[kind] != STAGES[first] and LIBRARY[kind] is not LIBRARY[first]]
    return first, str(rng.choice(others))


def _rig(rng: Rng, kinds: tuple[str, ...]) -> Rig:
    """Return a rig file; missing poles sit in the rig that has no spare pole to hide them."""
    poles = any(kind.startswith("extra_pole") for kind in kinds)
    stock = RC if poles else (OP_AMP, SKEWED, RC)[int(rng.integers(3))]

    def varied(value: float) -> float:
        return value * float(np.exp(SPREAD * rng.uniform(-1.0, 1.0)))

    return replace(
        stock, g1_den=(*(varied(a) for a in stock.g1_den[:-1]), stock.g1_den[-1]),
        g2_den=(*(varied(a) for a in stock.g2_den[:-1]), stock.g2_den[-1]),
        s_l=varied(stock.s_l), d_l_v=varied(stock.d_l_v), s_u=varied(stock.s_u), d_u_v=varied(stock.d_u_v),
        noise_v=_between(rng, *NOISES_V),
    )  # fmt: skip


def _piece(rng: Rng, rig: Rig, kind: str) -> Piece:
    """Return physics of about a drawn size, the size counted in the noise of the rig."""
    return {**LIBRARY, **OUTSIDE}[kind](rng, rig, _between(rng, *SIZES) * rig.noise_v / 0.010)


def _between(rng: Rng, low: float, high: float) -> float:
    """Return a number whose logarithm is uniform."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _sign(rng: Rng) -> float:
    return float(rng.choice([-1.0, 1.0]))


def _tops(rig: Rig) -> tuple[float, float]:
    """Return the lowest and highest w that the staircases reach."""
    return rig.s_u * (LOWEST_V - rig.d_u_v), rig.s_l * (HIGHEST_V - rig.d_l_v)


# A draw takes a size z in units of 10 mV of mismatch. The figures say which value makes z = 1 on the op-amp rig.


def _linear(what: str, name: str, stage: str, key: str, unit: float, signed: bool = False) -> Draw:
    """Return the draw of an effect whose mismatch is proportional to its one value."""

    def draw(rng: Rng, rig: Rig, z: float) -> Piece:
        values = {key: unit * z * (_sign(rng) if signed else 1.0)}
        return Concealed(what, values), Finding(name, stage, values)

    return draw


def _saturation(rng: Rng, rig: Rig, z: float) -> Piece:
    low, high = _tops(rig)
    values = {"upper": high * (1.0 - 0.004 * z), "lower": low * (1.0 - 0.004 * z * float(rng.uniform(0.5, 1.5)))}
    absent = (None, None, "upper", "lower")[int(rng.integers(4))]
    told = {key: value for key, value in values.items() if key != absent}
    nowhere = {"upper": float("inf"), "lower": float("-inf")}
    return Concealed("saturation", nowhere | told), Finding("saturation", "F", told)


def _soft(what: str, unit: float) -> Draw:
    def draw(rng: Rng, rig: Rig, z: float) -> Piece:
        values = {"level": unit * z**-0.5}
        return Concealed(what, values), Finding("soft_saturation", "F", values)

    return draw


def _diode(what: str) -> Draw:
    def draw(rng: Rng, rig: Rig, z: float) -> Piece:
        knee = _between(rng, 0.6, 2.5)
        values = {"drop": 0.09 * z * float(np.exp(-min(map(abs, _tops(rig))) / knee)), "knee": knee}
        return Concealed(what, values), Finding("diode_clamp", "F", {"n_vt": knee})

    return draw


def _hum(what: str, stage: str, unit: float) -> Draw:
    def draw(rng: Rng, rig: Rig, z: float) -> Piece:
        values = {
            "frequency": float(rng.choice([50.0, 60.0]) + rng.uniform(-0.04, 0.04)), "amplitude": unit * z,
            "third": unit * z * _between(rng, 0.02, 0.5), "fifth": unit * z * _between(rng, 0.02, 0.3),
        }  # fmt: skip
        return Concealed(what, values), Finding("hum", stage, values)

    return draw


def _coupled(rng: Rng, rig: Rig, z: float) -> Piece:
    tau = 300.0 / z
    return Concealed("ac_coupling", {"tau": tau}), Finding("ac_coupling", "sense", {"T": tau})


def _bent(rng: Rng, rig: Rig, z: float) -> Piece:
    values = {"k2": 3e-4 * z * _sign(rng), "k3": 3e-5 * z * _sign(rng)}
    return Concealed("adc_nonlinearity", values), Finding("adc_nonlinearity", "sense", values)


def _clipped(rng: Rng, rig: Rig, z: float) -> Piece:
    low, high = _tops(rig)
    values = {"upper": high * (1.0 - 0.004 * z), "lower": low * (1.0 - 0.004 * z)}
    return Concealed("adc_clipping", values), Finding("adc_clipping", "sense", values)


def _told(what: str, name: str, stage: str, values: Callable[[Rng, Rig, float], Values]) -> Draw:
    """Return the draw of physics whose values the library has by the same names."""

    def draw(rng: Rng, rig: Rig, z: float) -> Piece:
        drawn_values = values(rng, rig, z)
        return Concealed(what, drawn_values), Finding(name, stage, drawn_values)

    return draw


def _second_play(rng: Rng, rig: Rig, z: float) -> Values:
    return {"gap": (rig.d_l_v - rig.d_u_v) * float(rng.uniform(1.2, 1.8)), "weight": 7.3e-3 * z}


def _absorption(rng: Rng, rig: Rig, z: float) -> Values:
    return {"fraction": 5.8e-3 * z, "tau": _between(rng, 0.02, 0.3)}


def _process_noise(rng: Rng, rig: Rig, z: float) -> Values:
    return {"sd": 3e-3 * z, "bandwidth": _between(rng, 100.0, 3000.0)}


LIBRARY: dict[str, Draw] = {
    "second_play": _told("second_play", "second_play", "F", _second_play),
    "slew_limit": _told("slew_limit", "slew_limit", "F", lambda rng, rig, z: {"rate": 5300.0 * z**-0.5}),
    "absorption": _told("absorption", "dielectric_absorption", "F", _absorption),
    "absorption on plateaus": _told("absorption on plateaus", "dielectric_absorption", "F", _absorption),
    "rate_dependent_gap": _linear("rate_dependent_gap", "rate_dependent_gap", "F", "k", 1.2e-5),
    "process_noise": _told("process_noise", "process_noise", "G1", _process_noise),
    "saturation": _saturation,
    "soft_saturation": _soft("soft_saturation", 141.0),
    "soft_saturation, upper": _soft("soft_saturation, upper", 124.0),
    "diode_clamp": _diode("diode_clamp"),
    "diode_clamp, lower": _diode("diode_clamp, lower"),
    "diode_clamp, both": _diode("diode_clamp, both"),
    "leak": _linear("leak", "plateau_droop", "F", "rate", 8.6e-3),
    "bias current": _linear("bias current", "plateau_droop", "F", "current", 5.3e-2, signed=True),
    "dead_time": _linear("dead_time", "dead_time", "G2", "delay", 63e-6),
    "extra_pole in G1": _linear("extra_pole in G1", "extra_pole", "G1", "tau", 69e-6),
    "extra_pole in G2": _linear("extra_pole in G2", "extra_pole", "G2", "tau", 73e-6),
    "feedthrough": _linear("feedthrough", "feedthrough", "sense", "k", 4.5e-3, signed=True),
    "hum at sense": _hum("hum at sense", "sense", 13.5e-3),
    "hum at G1": _hum("hum at G1", "G1", 2.5e-3),
    "offset_drift": _linear("offset_drift", "offset_drift", "sense", "rate", 1.2e-3, signed=True),
    "gain_drift": _linear("gain_drift", "gain_drift", "sense", "rate", 4e-4, signed=True),
    "rectifying_sensor": _linear("rectifying_sensor", "rectifying_sensor", "sense", "lost", 2.6e-3),
    "ac_coupling": _coupled,
    "adc_nonlinearity": _bent,
    "adc_clipping": _clipped,
}
STAGES = {
    "saturation": "F", "soft_saturation": "F", "soft_saturation, upper": "F", "diode_clamp": "F",
    "diode_clamp, lower": "F", "diode_clamp, both": "F", "leak": "F",
    "second_play": "F", "slew_limit": "F", "absorption": "F", "absorption on plateaus": "F", "rate_dependent_gap": "F",
    "process_noise": "G1",
    "bias current": "F", "dead_time": "G2", "extra_pole in G1": "G1", "extra_pole in G2": "G2", "feedthrough": "sense",
    "hum at sense": "sense", "hum at G1": "G1", "offset_drift": "sense",
    "gain_drift": "sense", "rectifying_sensor": "sense", "ac_coupling": "sense", "adc_nonlinearity": "sense",
    "adc_clipping": "sense",
}  # fmt: skip


def _unnamed(what: str, values: Callable[[Rng, Rig, float], Values]) -> Draw:
    """Return the draw of physics that no name in the library fits."""
    return lambda rng, rig, z: (Concealed(what, values(rng, rig, z)), None)


OUTSIDE: dict[str, Draw] = {
    name: _unnamed(name, values)
    for name, values in {
        "curved_border": lambda rng, rig, z: {"k3": 7.5e-3 * z * _sign(rng)},
        "resonance in G2": lambda rng, rig, z: {"w_n": 3100.0 * z**-0.5, "zeta": float(rng.uniform(0.1, 0.6))},
    }.items()
}
