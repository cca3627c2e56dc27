"""What may be concealed in a trial, at which places and in which forms, with which values for a given strength?

Every id of the catalogue in physics.md section 2 is here, and kinds that are in no catalogue. Values depend on what
the rig reaches when it plays the standard protocol: a rail is set below the highest level, a knee inside the gap. A
strength of 1 is as strong as is still sensible; towards 0 the physics vanishes.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import exp, log1p

import numpy as np

from tests.proof.detect import Reach, Values
from tests.proof.rigs import Rig, Rng, between, first_order

PEAK = 4.5  # standard deviations that the noise of some reading reaches
Scaled = Callable[[float], Values]
Draw = Callable[[Rng, Reach], Scaled]


def same(rig: Rig) -> Rig:
    """Return the rig."""
    return rig


def as_concealed(values: Values) -> Values:
    """Return the values: the bench's law has the parameters of the catalogue."""
    return values


@dataclass(frozen=True)
class Kind:
    """Physics by its public id, its stage and its law; how its values are drawn, and what of them a report may tell.

    ``prepared`` makes the rig one in which it can be missing; ``chance``: its effect is one of chance, so that its mean
    counts; ``spectral``: it is noise, told by its spectrum; ``drawn``: it has no size to be set, only one to be drawn.
    """

    id: str
    stage: str
    law: str
    draw: Draw
    told: Callable[[Values], Values] = as_concealed
    prepared: Callable[[Rig], Rig] = same
    chance: bool = False
    spectral: bool = False
    drawn: bool = False

    @property
    def noisy(self) -> bool:
        """Return whether what it does scatters: what else is concealed has to show in that, too."""
        return self.chance or self.spectral


def sign(rng: Rng) -> float:
    """Return one up or down."""
    return float(rng.choice([-1.0, 1.0]))


def _one(key: str, most: Callable[[Reach], float], signed: bool = False) -> Draw:
    """Return the draw of physics with one value, proportional to its strength."""

    def draw(rng: Rng, reach: Reach) -> Scaled:
        top = most(reach) * (sign(rng) if signed else 1.0)
        return lambda strength: {key: top * strength}

    return draw


def _slow(most: float) -> Draw:
    """Return the draw of a coupling capacitor: tau in s, the shorter the stronger."""
    return lambda rng, reach: lambda strength: {"tau": 1.0 / (most * strength)}


def _limits(low: Callable[[Reach], float], high: Callable[[Reach], float], side: str) -> Draw:
    """Return the draw of limits that cut off up to 0.7 of what is reached, of ``side`` or both."""

    def draw(rng: Rng, reach: Reach) -> Scaled:
        other = float(rng.uniform(0.5, 1.0))
        tops = {"upper": high(reach), "lower": low(reach)}
        cut = dict(zip(tops, (1.0, other) if rng.uniform() < 0.5 else (other, 1.0), strict=True))
        kept = tops if side == "both" else {side: tops[side]}
        cut = cut if side == "both" else {side: 1.0}
        return lambda strength: {k: top * (1.0 - 0.7 * strength * cut[k]) for k, top in kept.items()}

    return draw


def _top(reach: Reach, side: str) -> float:
    """Return the level that a law of one side is set against: the one reached there, or the lesser of both."""
    return {"upper": reach.high_w_v, "lower": -reach.low_w_v}.get(side, min(reach.high_w_v, -reach.low_w_v))


def _soft(side: str) -> Draw:
    return lambda rng, reach: lambda strength: {"level": 0.8 * _top(reach, side) * strength**-0.5}


def _diode(side: str) -> Draw:
    """Return the draw of a clamp: n V_T, the level at which it conducts as R does, and in half of them a resistor."""

    def draw(rng: Rng, reach: Reach) -> Scaled:
        top = _top(reach, side)
        n_vt = top * between(rng, 0.004, 0.12)
        series = between(rng, 0.02, 0.4) if rng.uniform() < 0.5 else 0.0

        def values(strength: float) -> Values:
            level = top + 8.0 * n_vt - strength * (0.6 * top + 8.0 * n_vt)
            return {"level": level, "knee": n_vt, "series": series, "drop": n_vt * exp(-level / n_vt)}

        return values

    return draw


def _diode_told(values: Values) -> Values:
    series = values["series"]  # it adds to R: together they conduct as well as the diode at a lower level
    knee = values["level"] - values["knee"] * log1p(series)
    return {"knee": knee, "n_vt": values["knee"], "slope": series / (1.0 + series)}


def _hum(most: Callable[[Reach], float]) -> Draw:
    def draw(rng: Rng, reach: Reach) -> Scaled:
        frequency = float(rng.choice([50.0, 60.0]) + rng.uniform(-GRID_OFF_HZ, GRID_OFF_HZ))
        third, fifth, top = between(rng, 0.02, 0.5), between(rng, 0.02, 0.3), most(reach)
        return lambda strength: {
            "frequency": frequency, "amplitude": top * strength, "third": third * top * strength,
            "fifth": fifth * top * strength,
        }  # fmt: skip

    return draw


def _rectified(most: Callable[[Reach], float]) -> Draw:
    """Return the draw of a rectifier's ripple: the falling edge of its capacitor's voltage has a fourth harmonic."""

    def draw(rng: Rng, reach: Reach) -> Scaled:
        frequency = float(rng.choice([50.0, 60.0]) + rng.uniform(-GRID_OFF_HZ, GRID_OFF_HZ))
        fourth, top = between(rng, 0.05, 0.5), most(reach)
        return lambda strength: {
            "frequency": frequency, "second": top * strength, "fourth": fourth * top * strength,
        }  # fmt: skip

    return draw


def _resonance(at: Callable[[Rig], float]) -> Draw:
    def draw(rng: Rng, reach: Reach) -> Scaled:
        slowest, zeta = 3.0 * at(reach.rig), between(rng, 0.1, 0.7)
        return lambda strength: {"w_n": slowest / strength, "zeta": zeta}

    return draw


def _capacitor(most: Callable[[Reach], float], poles: Callable[[Rig], tuple[float, ...]]) -> Draw:
    """Return the draw of a capacitor in the slowest low-pass of a block: up to 30 % off at the highest level."""

    def draw(rng: Rng, reach: Reach) -> Scaled:
        tau = float(np.max(-1.0 / np.real(np.roots(poles(reach.rig)))))
        k2 = 0.3 * sign(rng) / most(reach) ** 2
        return lambda strength: {"k2": k2 * strength, "tau": tau}

    return draw


def _heating(level: Callable[[Reach], float]) -> Draw:
    """Return the draw of a part that its load warms: up to 30 % of the gain at the highest level, held."""

    def draw(rng: Rng, reach: Reach) -> Scaled:
        tau, k = between(rng, 0.05, 3.0), 0.3 * sign(rng) / level(reach) ** 2
        return lambda strength: {"k": k * strength, "tau": tau}

    return draw


def _process_noise(rng: Rng, reach: Reach) -> Scaled:
    bandwidth, half = between(rng, 100.0, 4000.0), reach.rig.half_gap_v
    return lambda strength: {"sd": 0.4 * half * strength, "bandwidth": bandwidth}


def _gap(rng: Rng, reach: Reach) -> Scaled:
    middle, skew = reach.rig.d_l_v, float(rng.uniform(-0.3, 0.3))

    def values(strength: float) -> Values:
        half = 0.4 * reach.v_v * strength
        return {"D_L": middle + half * (1.0 + skew), "D_U": middle - half * (1.0 - skew)}

    return values


def _curved(rng: Rng, reach: Reach) -> Scaled:
    span, rig = reach.v_v + reach.rig.half_gap_v, reach.rig
    k2, k3 = (sign(rng) * 0.25 * rig.s_l / span**power for power in (1, 2))
    share = float(rng.choice([0.0, 0.5, 1.0]))
    return lambda strength: {"k2": (1.0 - share) * k2 * strength, "k3": share * k3 * strength}


def _slopes(rng: Rng, reach: Reach) -> Scaled:
    up = sign(rng)
    return lambda strength: {"ratio": exp(0.3 * up * strength)}


def _absorption(rng: Rng, reach: Reach) -> Scaled:
    tau = between(rng, 0.008, 0.3)
    return lambda strength: {"fraction": 0.3 * strength, "tau": tau}


def _second(rng: Rng, reach: Reach) -> Scaled:
    factor = float(rng.uniform(1.2, 1.8)) if rng.uniform() < 0.5 else float(rng.uniform(0.2, 0.8))
    return lambda strength: {"gap": 2.0 * reach.rig.half_gap_v * factor, "weight": 0.4 * strength}


def _slew(rng: Rng, reach: Reach) -> Scaled:
    fastest = reach.speed_v * max(reach.rig.s_l, reach.rig.s_u)
    return lambda strength: {"rate": fastest * (1.0 - 0.97 * strength)}


def _hurried(rng: Rng, reach: Reach) -> Scaled:
    return lambda strength: {"k": 0.2 * strength, "top": reach.speed_v * reach.rig.s_l}


def _warm_joint(rng: Rng, reach: Reach) -> Scaled:
    tau = float(np.exp(rng.uniform(*np.log((0.05, 1.0)))))
    return lambda strength: {"k": 0.05 * strength * reach.high_w_v, "tau": tau, "top": reach.high_w_v}


def _ringing(rng: Rng, reach: Reach) -> Scaled:
    frequency = between(rng, 100.0, 600.0)
    return lambda strength: {"size": 0.1 * reach.high_w_v * strength, "frequency": frequency}


def _worked(rng: Rng, reach: Reach) -> Scaled:
    tau, top = between(rng, 0.05, 1.0), reach.speed_v * reach.rig.s_l
    return lambda strength: {"k": 0.5 * strength, "tau": tau, "top": top}


def _stirred(rng: Rng, reach: Reach) -> Scaled:
    tau = between(rng, 0.02, 0.5)
    return lambda strength: {"k": 0.5 * reach.rig.half_gap_v * strength, "tau": tau, "top": reach.speed_v}


def _rectified_offset(rng: Rng, reach: Reach) -> Scaled:
    tau = between(rng, 0.01, 0.5)
    return lambda strength: {"k": 0.2 * strength, "tau": tau}


def _rounded_slew(rng: Rng, reach: Reach) -> Scaled:
    """Return the draw of an amplifier that slews with rounded corners: the slower, the longer its lag is, too."""
    fastest, share = reach.speed_v * max(reach.rig.s_l, reach.rig.s_u), between(rng, 0.05, 0.5)
    span_v = reach.high_w_v - reach.low_w_v

    def values(strength: float) -> Values:
        rate = fastest * (1.0 - 0.97 * strength)
        return {"rate": rate, "lag": 0.1 * share * strength * span_v / rate}

    return values


def _coloured(rng: Rng, reach: Reach) -> Scaled:
    slope = float(rng.uniform(0.5, 2.0))
    return lambda strength: {"sd": 10.0 * reach.rig.noise_v * strength, "slope": slope}


def _bent_adc(rng: Rng, reach: Reach) -> Scaled:
    top, share = max(reach.high_w_v, -reach.low_w_v), float(rng.choice([0.0, 0.5, 1.0]))
    k2, k3 = (sign(rng) * 0.2 / top**power for power in (1, 2))
    return lambda strength: {"k2": (1.0 - share) * k2 * strength, "k3": share * k3 * strength}


def _spikes(rng: Rng, reach: Reach) -> Scaled:
    size = reach.rig.noise_v * between(rng, 8.0, 60.0)
    return lambda strength: {"rate": 20.0 * strength, "size": size}


def _lost(rng: Rng, reach: Reach) -> Scaled:
    position, count = float(rng.choice(reach.moving_s)), float(rng.integers(1, 21))
    return lambda strength: {"position": position, "count": count}


def _without_gap(rig: Rig) -> Rig:
    """Return the rig as a rig file without a backlash knows it: one line w = s (v - d)."""
    middle = 0.5 * (rig.d_l_v + rig.d_u_v)
    return replace(rig, d_l_v=middle, d_u_v=middle, s_u=rig.s_l, linear=True)


def _tied(rig: Rig) -> Rig:
    return replace(rig, s_u=rig.s_l, tied=True)


def _in_time(rig: Rig) -> Rig:
    return replace(rig, dead_time_s=0.0)


def _slow_t(values: Values) -> Values:
    return {"T": values["tau"]}


def _step_told(values: Values) -> Values:
    return {"LSB": values["lsb"]}


SIDES = ("both", "upper", "lower")
U_LOW, U_HIGH = (lambda reach: -reach.u_v), (lambda reach: reach.u_v)
GRID_OFF_HZ = 0.2  # what a grid's frequency is allowed to be off
W_LOW, W_HIGH = (lambda reach: reach.low_w_v), (lambda reach: reach.high_w_v)
Y_LOW, Y_HIGH = (lambda r: r.low_w_v - PEAK * r.rig.noise_v), (lambda r: r.high_w_v + PEAK * r.rig.noise_v)

LIBRARY: tuple[Kind, ...] = (
    Kind("dac_quantisation", "source", "dac_quantisation", _one("lsb", lambda r: 0.2 * r.u_v)),
    Kind("source_pole", "source", "source_pole", _one("tau", lambda r: 8e-3), prepared=first_order),
    Kind("source_nonlinearity", "source", "source_nonlinearity", _one("k", lambda r: 0.2 / r.u_v**2, signed=True)),
    Kind("input_ac_coupling", "source", "input_ac_coupling", _slow(10.0), _slow_t),
    *(Kind("input_clipping", "source", "input_clipping", _limits(U_LOW, U_HIGH, side)) for side in SIDES),
    Kind("resonance", "G1", "resonance in G1", _resonance(lambda r: r.g1_den[-1] / r.g1_den[-2])),
    Kind("resonance", "G2", "resonance in G2", _resonance(lambda r: r.g2_den[-1] / r.g2_den[-2])),
    Kind("extra_pole", "G1", "extra_pole in G1", _one("tau", lambda r: 8e-3), prepared=first_order),
    Kind("extra_pole", "G2", "extra_pole in G2", _one("tau", lambda r: 3e-3), prepared=first_order),
    Kind("capacitor_nonlinearity", "G1", "nonlinear capacitor in G1", _capacitor(lambda r: r.v_v, lambda r: r.g1_den)),
    Kind("capacitor_nonlinearity", "G2", "nonlinear capacitor in G2", _capacitor(
        lambda r: max(r.high_w_v, -r.low_w_v), lambda r: r.g2_den)),
    Kind("self_heating", "G1", "self-heating in G1", _heating(lambda r: r.v_v)),
    Kind("self_heating", "F", "self-heating in F", _heating(lambda r: max(r.high_w_v, -r.low_w_v))),
    Kind("process_noise", "G1", "process_noise", _process_noise, chance=True),
    Kind("process_noise", "G1", "process_noise, low-passed", _process_noise, chance=True),
    Kind("hum", "G1", "hum at G1", _hum(lambda r: 0.3 * r.rig.half_gap_v)),
    Kind("hum", "sense", "hum at sense", _hum(lambda r: 20.0 * r.rig.noise_v)),
    Kind("hum", "G1", "hum at G1", _rectified(lambda r: 0.3 * r.rig.half_gap_v)),
    Kind("hum", "F", "hum at F", _hum(lambda r: 0.3 * r.rig.half_gap_v)),
    Kind("hum", "sense", "hum at sense", _rectified(lambda r: 20.0 * r.rig.noise_v)),
    Kind("backlash", "F", "backlash", _gap, prepared=_without_gap),
    *(Kind("saturation", "F", "saturation", _limits(W_LOW, W_HIGH, side)) for side in SIDES),
    Kind("soft_saturation", "F", "soft_saturation", _soft("both")),
    Kind("soft_saturation", "F", "soft_saturation, upper", _soft("upper")),
    Kind("soft_saturation", "F", "soft_saturation, lower", _soft("lower")),
    Kind("diode_clamp", "F", "diode_clamp", _diode("upper"), _diode_told),
    Kind("diode_clamp", "F", "diode_clamp, lower", _diode("lower"), _diode_told),
    Kind("diode_clamp", "F", "diode_clamp, both", _diode("both"), _diode_told),
    Kind("curved_border", "F", "curved_border", _curved),
    Kind("unequal_slopes", "F", "unequal_slopes", _slopes, prepared=_tied),
    Kind("soft_knee", "F", "soft_knee", _one("width", lambda r: 1.6 * r.rig.half_gap_v)),
    Kind("plateau_droop", "F", "leak", _one("rate", lambda r: 4.0)),
    Kind("plateau_droop", "F", "leak across", _one("rate", lambda r: 4.0)),
    Kind("plateau_droop", "F", "bias current", _one("current", lambda r: 2.0 * r.high_w_v, signed=True)),
    Kind("dielectric_absorption", "G1", "absorption in G1", _absorption),
    Kind("dielectric_absorption", "F", "absorption", _absorption),
    Kind("dielectric_absorption", "F", "absorption on plateaus", _absorption),
    Kind("plateau_tilt", "F", "plateau_tilt", _one("k", lambda r: 0.1 * r.rig.s_l, signed=True)),
    Kind("second_play", "F", "second_play", _second),
    Kind("rate_dependent_gap", "F", "rate_dependent_gap", _one("k", lambda r: 0.8 * r.rig.half_gap_v / r.speed_v)),
    Kind("diode_contact", "F", "diode_contact", _one("n_vt", lambda r: 0.1 * r.rig.half_gap_v)),
    Kind("slew_limit", "F", "slew_limit", _slew),
    Kind("slew_limit", "F", "slew_limit, rounded", _rounded_slew),
    Kind("dead_time", "G2", "dead_time", _one("delay", lambda r: 4e-3), prepared=_in_time),
    Kind("adc_averaging", "sense", "adc_averaging", _one("length", lambda r: 20e-3)),
    Kind("feedthrough", "sense", "feedthrough", _one("k", lambda r: 0.1, signed=True)),
    Kind("offset_drift", "sense", "offset_drift", _one("rate", lambda r: r.rig.noise_v, signed=True)),
    Kind("gain_drift", "sense", "gain_drift", _one("rate", lambda r: 5e-3, signed=True)),
    Kind("ac_coupling", "sense", "ac_coupling", _slow(4.0), _slow_t),
    Kind("coloured_noise", "sense", "coloured_noise", _coloured, spectral=True),
    *(Kind("adc_clipping", "sense", "adc_clipping", _limits(Y_LOW, Y_HIGH, side)) for side in SIDES),
    Kind("adc_quantisation", "sense", "adc_quantisation", _one("lsb", lambda r: 30.0 * r.rig.noise_v), _step_told),
    Kind("adc_nonlinearity", "sense", "adc_nonlinearity", _bent_adc),
    Kind("rectifying_sensor", "sense", "rectifying_sensor", _one("lost", lambda r: 1.0)),
    Kind("spikes", "sense", "spikes", _spikes),
    Kind("clock_skew", "sense", "clock_skew", _one("ppm", lambda r: 400.0, signed=True)),
    Kind("missing_samples", "sense", "missing_samples", _lost, drawn=True),
)


def _ripple(rng: Rng, reach: Reach) -> Scaled:
    frequency = float(rng.uniform(65.0, 95.0))
    return lambda strength: {"share": 0.5 * strength, "frequency": frequency}


def _echo(rng: Rng, reach: Reach) -> Scaled:
    delay, up = between(rng, 4e-3, 30e-3), sign(rng)
    return lambda strength: {"share": 0.3 * up * strength, "delay": delay}


def _contact(rng: Rng, reach: Reach) -> Scaled:
    rate = between(rng, 1.0, 6.0)
    return lambda strength: {"rate": rate, "length": 30e-3 * strength}


def _stray(rng: Rng, reach: Reach) -> Scaled:
    frequency = between(rng, 65.0, 95.0) if rng.uniform() < 0.5 else between(rng, 310.0, 1900.0)
    return lambda strength: {"amplitude": 10.0 * reach.rig.noise_v * strength, "frequency": frequency}


def _whistle(rng: Rng, reach: Reach) -> Scaled:
    frequency = float(rng.uniform(310.0, 900.0))
    return lambda strength: {"amplitude": 0.05 * reach.u_v * strength, "frequency": frequency}


def _sawtooth(rng: Rng, reach: Reach) -> Scaled:
    frequency = between(rng, 65.0, 140.0)
    return lambda strength: {"size": 0.3 * reach.rig.half_gap_v * strength, "frequency": frequency}


def _popcorn(rng: Rng, reach: Reach) -> Scaled:
    rate = between(rng, 0.3, 8.0)
    return lambda strength: {"size": 20.0 * reach.rig.noise_v * strength, "rate": rate}


def _code(rng: Rng, reach: Reach) -> Scaled:
    level, up = float(rng.uniform(0.7 * reach.low_w_v, 0.7 * reach.high_w_v)), sign(rng)
    return lambda strength: {"step": 0.2 * up * reach.high_w_v * strength, "level": level}


def _bit(rng: Rng, reach: Reach) -> Scaled:
    return lambda strength: {"weight": 0.25 * reach.u_v * strength}


def _crack(rng: Rng, reach: Reach) -> Scaled:
    moment, up = float(rng.uniform(*np.quantile(reach.moving_s, [0.2, 0.8]))), sign(rng)
    return lambda strength: {"share": 0.2 * up * strength, "moment": moment}


def _warm_gap(rng: Rng, reach: Reach) -> Scaled:
    tau = between(rng, 0.3, 3.0)
    return lambda strength: {"k": 0.8 * strength, "tau": tau, "top": reach.v_v}


def _trigger(rng: Rng, reach: Reach) -> Scaled:
    level, up = float(rng.uniform(0.2, 0.6)) * min(reach.high_w_v, -reach.low_w_v), sign(rng)
    return lambda strength: {"size": 0.2 * up * reach.high_w_v * strength, "level": level}


def _sag(rng: Rng, reach: Reach) -> Scaled:
    top, tau, sag = max(reach.high_w_v, -reach.low_w_v), between(rng, 0.05, 0.5), float(rng.uniform(0.2, 0.6))
    return lambda strength: {"rail": top * (1.0 + sag - 0.6 * strength), "sag": sag, "tau": tau}


def _glitch(rng: Rng, reach: Reach) -> Scaled:
    tau, up = between(rng, 0.5e-3, 5e-3), sign(rng)
    return lambda strength: {"size": 0.2 * up * reach.u_v * strength, "tau": tau}


def _drifting(rng: Rng, reach: Reach) -> Scaled:
    tau = between(rng, 2e-3, 30e-3)
    return lambda strength: {"rate": 0.02 * strength, "tau": tau}


def _touched(rng: Rng, reach: Reach) -> Scaled:
    tau, moment = between(rng, 1e-3, 10e-3), float(rng.uniform(*np.quantile(reach.moving_s, [0.2, 0.8])))
    return lambda strength: {"share": strength, "tau": tau, "moment": moment}


def _varistor(before: bool) -> Draw:
    """Return the draw of one across the capacitor of the slowest pole of G1, or of G2."""
    def draw(rng: Rng, reach: Reach) -> Scaled:
        den, top = (reach.rig.g1_den, reach.v_v) if before else (reach.rig.g2_den, reach.high_w_v)
        tau = 1.0 / float(np.min(np.abs(np.roots(den))))
        return lambda strength: {"k": 0.5 * strength, "top": top, "tau": tau}

    return draw


def _detents(rng: Rng, reach: Reach) -> Scaled:
    pitch = float(rng.uniform(0.15, 0.4)) * reach.high_w_v
    return lambda strength: {"pull": 3.0 * pitch * strength, "pitch": pitch}


def _popcorn_gap(rng: Rng, reach: Reach) -> Scaled:
    rate, size = between(rng, 0.3, 5.0), 0.4 * sign(rng) * reach.rig.half_gap_v
    return lambda strength: {"rate": rate, "size": size * strength}


def _dent(rng: Rng, reach: Reach) -> Scaled:
    level, up = float(rng.uniform(-0.5, 0.5)) * reach.high_w_v, sign(rng)
    width = float(rng.uniform(0.05, 0.25)) * reach.high_w_v
    return lambda strength: {"size": 0.1 * up * reach.high_w_v * strength, "level": level, "width": width}


def _sagging(rng: Rng, reach: Reach) -> Scaled:
    tau = between(rng, 0.05, 1.0)
    return lambda strength: {"k": 0.3 / reach.high_w_v * strength, "tau": tau}


def _crosstalk(rng: Rng, reach: Reach) -> Scaled:
    level, up = float(rng.uniform(-0.5, 0.5)) * reach.u_v, sign(rng)
    return lambda strength: {"size": 10.0 * up * reach.rig.noise_v * strength, "level": level}


def _range(rng: Rng, reach: Reach) -> Scaled:
    level, up = float(rng.uniform(0.2, 0.5)) * min(reach.high_w_v, -reach.low_w_v), sign(rng)
    return lambda strength: {"share": 0.2 * up * strength, "level": level}


def _wavy(rng: Rng, reach: Reach) -> Scaled:
    period = float(rng.uniform(0.15, 0.5)) * reach.high_w_v
    return lambda strength: {"size": 0.05 * reach.high_w_v * strength, "period": period}


UNHEARD: tuple[Kind, ...] = (
    Kind("reference_ripple", "source", "reference_ripple", _ripple),
    Kind("source_line", "source", "source_line", _whistle),
    Kind("rippling_gain", "G1", "rippling_gain", _ripple),
    Kind("level_dependent_delay", "G1", "level_dependent_delay", _one("k", lambda r: 8e-3 / r.v_v)),
    Kind("stick_slip", "F", "stick_slip", _one("stuck", lambda r: 0.8 * r.rig.half_gap_v * r.rig.s_l)),
    Kind("wearing_gap", "F", "wearing_gap", _one("rate", lambda r: 5e-3)),
    Kind("crossover", "F", "crossover", _one("dead", lambda r: 0.3 * r.high_w_v)),
    Kind("lost_contact", "F", "lost_contact", _contact),
    Kind("echo", "G2", "echo", _echo),
    Kind("stray_line", "sense", "stray_line", _stray),
    Kind("telegraph", "sense", "telegraph", _popcorn),
    Kind("missing_code", "sense", "missing_code", _code),
    Kind("stuck_bit", "source", "stuck_bit", _bit),
    Kind("cracked_joint", "G1", "cracked_joint", _crack),
    Kind("warming_gap", "F", "warming_gap", _warm_gap),
    Kind("trigger", "F", "trigger", _trigger),
    Kind("sagging_rails", "F", "sagging_rails", _sag),
    Kind("one_way_lag", "G2", "one_way_lag", _one("tau", lambda r: 5e-3)),
    Kind("adc_ripple", "sense", "adc_ripple", _ripple),
    Kind("dac_glitch", "source", "dac_glitch", _glitch),
    Kind("tired_source", "source", "tired_source", _one("k", lambda r: 0.05 / r.u_v)),
    Kind("drifting_pole", "G1", "drifting_pole in G1", _drifting),
    Kind("drifting_pole", "G2", "drifting_pole in G2", _drifting),
    Kind("touched_part", "G1", "touched_part in G1", _touched),
    Kind("touched_part", "G2", "touched_part in G2", _touched),
    Kind("varistor", "G1", "varistor in G1", _varistor(before=True)),
    Kind("varistor", "G2", "varistor in G2", _varistor(before=False)),
    Kind("detents", "F", "detents", _detents),
    Kind("popcorn_gap", "F", "popcorn_gap", _popcorn_gap),
    Kind("plastic_gap", "F", "plastic_gap", _one("k", lambda r: 0.5 / r.v_v)),
    Kind("sawtooth", "G1", "sawtooth", _sawtooth),
    Kind("remembering_gap", "F", "remembering_gap", _one("k", lambda r: 0.5 / r.v_v)),
    Kind("one_way_slew", "F", "one_way_slew", lambda rng, r: lambda s: {"rate": r.speed_v * r.rig.s_l * (1.05 - s)}),
    Kind("dent", "F", "dent", _dent),
    Kind("sagging_supply", "G2", "sagging_supply", _sagging),
    Kind("crosstalk", "sense", "crosstalk", _crosstalk),
    Kind("wavy_adc", "sense", "wavy_adc", _wavy),
    Kind("dead_dac", "source", "dead_dac", _one("dead", lambda r: 0.4 * r.u_v)),
    Kind("jitter", "sense", "jitter", _one("sd", lambda r: 2e-3)),
    Kind("noisy_reference", "sense", "noisy_reference", _one("sd", lambda r: 0.1)),
    Kind("shared_supply", "sense", "shared_supply", lambda rng, r: lambda s: {"share": 0.2 * s, "top": r.u_v}),
    Kind("wandering_hold", "F", "wandering_hold", _one("sd", lambda r: r.high_w_v)),
    Kind("slow_g1", "G1", "slow_g1", lambda rng, r: lambda s: {"rate": r.speed_v * (1.0 - 0.97 * s)}),
    Kind("warm_joint", "sense", "warm_joint", _warm_joint),
    Kind("dimmed_source", "source", "dimmed_source", _one("share", lambda r: 0.3)),
    Kind("scattered_gap", "F", "scattered_gap", _one("sd", lambda r: 0.3 * r.rig.half_gap_v)),
    Kind("hurried_reading", "sense", "hurried_reading", _hurried),
    Kind("stale_reading", "sense", "stale_reading", _one("share", lambda r: 0.5)),
    Kind("giving_contact", "F", "giving_contact", _one("tau", lambda r: 20e-3)),
    Kind("kicking_contact", "F", "kicking_contact", _one("kick", lambda r: 0.1 * r.high_w_v)),
    Kind("ringing_contact", "F", "ringing_contact", _ringing),
    Kind("worked_gain", "F", "worked_gain", _worked),
    Kind("late_converter", "sense", "late_converter", _one("late", lambda r: 2e-3)),
    Kind("later_contact", "F", "later_contact", _one("k", lambda r: 0.3 * r.rig.half_gap_v / r.speed_v)),
    Kind("stirred_gap", "F", "stirred_gap", _stirred),
    Kind("debounced_contact", "F", "debounced_contact", _one("wait", lambda r: 20e-3)),
    Kind("switching_gain", "G2", "switching_gain", _range),
    Kind("rectified_offset", "G1", "rectified_offset", _rectified_offset),
)
