"""What does a concealed piece of physics do to the signals? Each from its own equation, one function a place.

Places, in the order of the signal path: ``dac`` (the values the DAC is given), ``drive`` (what it puts out, its mean
over every sub-step), ``v`` (after G1), ``play`` (the operator itself), ``w`` (after F), ``x`` (after G2), ``late``
(the times of the readings), ``y`` (at the readings) and ``adc`` (at the readings, their noise included). A function
takes the signal and a Scene and returns the signal changed; WHERE says which function stands for a name, and at which
place. Every id of the catalogue in physics.md has its law here; tests/proof/outside.py has others.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.signal import lfilter
from scipy.special import wrightomega

from tests.proof.integrator import (
    Array,
    Grid,
    absorbing_play,
    between,
    charging,
    diode_play,
    leaning_play,
    linear_block,
    play,
    slewed,
    slewing,
    soft_play,
)
from tests.proof.rigs import Rig


@dataclass(frozen=True)
class Scene:
    """What a stage may know: the grid, the rig, the DAC, its own values (SI units) and random numbers of its own."""

    grid: Grid
    rig: Rig
    u: Array
    values: dict[str, float]
    seed: int

    @property
    def clock_s(self) -> Array:
        """Return the clock at every reading."""
        return self.grid.start_s + self.grid.sample_s

    @property
    def rng(self) -> np.random.Generator:
        """Return the random numbers of this stage, the same for every run of a case."""
        return np.random.default_rng([self.seed, 4242])

    @property
    def rng_of_run(self) -> np.random.Generator:
        """Return random numbers that no other run of the case has: what is new in every run."""
        return np.random.default_rng([self.seed, 4242, round(1e3 * self.grid.start_s)])


Change = Callable[[Array, Scene], Array]
CONTACTS = 100  # plays that stand for a rounded take-up


def borders(v: Array, rig: Rig) -> tuple[Array, Array]:
    """Return the rising border s_l (v - d_l), which bounds w from below, and the falling one, from above."""
    return rig.s_l * (v - rig.d_l_v), rig.s_u * (v - rig.d_u_v)


def ideal_play(v: Array, scene: Scene) -> Array:
    """Return w of the ideal operator, at rest on w = 0 before the run if the borders allow it."""
    return play(*borders(v, scene.rig), 0.0, 1.0, 0.0)


# --- source -------------------------------------------------------------------------------------------------------


def rounded(signal: Array, scene: Scene) -> Array:
    """Round to whole multiples of ``lsb``: what a DAC can put out, or an ADC can say."""
    return scene.values["lsb"] * np.round(signal / scene.values["lsb"])


def cubic(u: Array, scene: Scene) -> Array:
    """Bend the source: u + k u^3."""
    return u + scene.values["k"] * u**3


def clipped(signal: Array, scene: Scene) -> Array:
    """Clip to [lower, upper]: the source, w behind the play, or the readings with their noise."""
    return np.clip(signal, scene.values.get("lower", -np.inf), scene.values.get("upper", np.inf))


def source_pole(drive: Array, scene: Scene) -> Array:
    """Pass what the DAC puts out through 1/(1 + s tau), at rest before the run."""
    return between(linear_block(drive, (1.0,), (scene.values["tau"], 1.0), scene.grid.step_s))


def input_ac_coupling(drive: Array, scene: Scene) -> Array:
    """Pass what the DAC puts out through s/(s + 1/tau), at rest before the run."""
    return drive - source_pole(drive, scene)


# --- F ------------------------------------------------------------------------------------------------------------


def soft_saturation(w: Array, scene: Scene) -> Array:
    """Compress w to level * tanh(w / level)."""
    level = scene.values["level"]
    return level * np.tanh(w / level)


def upper(law: Change) -> Change:
    """Return the law for positive signals only."""
    return lambda signal, scene: np.where(signal > 0.0, law(np.maximum(signal, 0.0), scene), signal)


def lower(law: Change) -> Change:
    """Return the law, turned about zero, for negative signals only."""
    return lambda signal, scene: -upper(law)(-signal, scene)


def shunt_diode(w: Array, scene: Scene) -> Array:
    """Load w by a chain of diodes, ``series`` of R in line with it: w = (1 + series) i + x, i in volts on R.

    i = drop (exp(x / knee) - 1), all in V; solved for x by Wright's omega, omega + ln(omega) = z.
    """
    drop, knee, series = scene.values["drop"], scene.values["knee"], scene.values.get("series", 0.0)
    whole = drop * (1.0 + series)
    x = w + whole - knee * wrightomega(np.log(whole / knee) + (w + whole) / knee)
    return x + series * (w - x) / (1.0 + series)


def diode_pair(w: Array, scene: Scene) -> Array:
    """Load w by a diode of either polarity: the law of the current is odd; its inverse is read off a dense table."""
    drop, knee, series = scene.values["drop"], scene.values["knee"], scene.values.get("series", 0.0)
    top = knee * np.log1p(np.abs(w).max() / drop) * np.linspace(-1.0, 1.0, 400_001)
    current = 2.0 * drop * np.sinh(top / knee)
    return np.interp(w, (1.0 + series) * current + top, series * current + top)


soft_saturation_upper, soft_saturation_lower = upper(soft_saturation), lower(soft_saturation)
diode_clamp, diode_clamp_lower = upper(shunt_diode), lower(shunt_diode)


def leak(v: Array, scene: Scene) -> Array:
    """Let the hold capacitor discharge, dw/dt = -rate * w, wherever no border holds it."""
    keep = float(np.exp(-scene.values["rate"] * scene.grid.step_s))
    return play(*borders(v, scene.rig), 0.0, keep, 0.0)


def leak_across(v: Array, scene: Scene) -> Array:
    """Let the blocked diodes leak: on a plateau dw/dt = rate (s v - w), s the slope of the rising border."""
    follow = -float(np.expm1(-scene.values["rate"] * scene.grid.step_s))
    return leaning_play(*borders(v, scene.rig), scene.rig.s_l * v, follow)


def bias_current(v: Array, scene: Scene) -> Array:
    """Let a bias current charge the hold capacitor, dw/dt = +current [V/s], wherever no border holds it."""
    return play(*borders(v, scene.rig), 0.0, 1.0, scene.values["current"] * scene.grid.step_s)


def backlash(v: Array, scene: Scene) -> Array:
    """Put borders at D_L and D_U where the rig file knows none."""
    return ideal_play(v, replace(scene, rig=replace(scene.rig, d_l_v=scene.values["D_L"], d_u_v=scene.values["D_U"])))


def unequal_slopes(v: Array, scene: Scene) -> Array:
    """Let the falling border have ``ratio`` times the slope of the rising one."""
    return ideal_play(v, replace(scene, rig=replace(scene.rig, s_u=scene.values["ratio"] * scene.rig.s_l)))


def curved_border(v: Array, scene: Scene) -> Array:
    """Bend both borders: w = s (v - d) + k2 (v - d)^2 + k3 (v - d)^3."""
    rig, k2, k3 = scene.rig, scene.values.get("k2", 0.0), scene.values.get("k3", 0.0)
    rising, falling = v - rig.d_l_v, v - rig.d_u_v
    bounds = [a * (s + a * (k2 + a * k3)) for a, s in ((rising, rig.s_l), (falling, rig.s_u))]
    return play(*bounds, 0.0, 1.0, 0.0)


def soft_knee(v: Array, scene: Scene) -> Array:
    """Round the take-up: contact is made evenly over ``width`` [V] of v, as by many plays side by side."""
    rig = scene.rig
    return soft_play(v, rig.s_l, rig.d_l_v, rig.s_u, rig.d_u_v, scene.values["width"], CONTACTS)


def plateau_tilt(v: Array, scene: Scene) -> Array:
    """Let part of v pass beside the play: w + k v."""
    return ideal_play(v, scene) + scene.values["k"] * v


def second_play(v: Array, scene: Scene) -> Array:
    """Mix in, with ``weight``, a second play whose gap is ``gap`` [V] wide around the middle of the first."""
    rig, half, weight = scene.rig, 0.5 * scene.values["gap"], scene.values["weight"]
    middle = 0.5 * (rig.d_l_v + rig.d_u_v)
    second = ideal_play(v, replace(scene, rig=replace(rig, d_l_v=middle + half, d_u_v=middle - half)))
    return (1.0 - weight) * ideal_play(v, scene) + weight * second


def rate_dependent_gap(v: Array, scene: Scene) -> Array:
    """Widen the gap with speed: contact on either side is made k |dv/dt| later; where v turns it is at rest."""
    speed = np.abs(np.gradient(v, scene.grid.step_s))
    moves = np.diff(v)
    speed[1:-1][moves[1:] * moves[:-1] < 0.0] = 0.0
    lower, upper = borders(v, scene.rig)
    widened = scene.values["k"] * speed
    return play(lower - scene.rig.s_l * widened, upper + scene.rig.s_u * widened, 0.0, 1.0, 0.0)


def diode_contact(v: Array, scene: Scene) -> Array:
    """Take w along by diodes of ``n_vt`` [V]: v ahead of a border by e has w follow at 100 V/s exp(e / n_vt)."""
    rig, n_vt = scene.rig, scene.values["n_vt"]
    volts = (abs(rig.s_l) * n_vt, abs(rig.s_u) * n_vt)
    return np.asarray(diode_play(*borders(v, rig), *volts, 100.0 * scene.grid.step_s / n_vt))


def slew_limit(w: Array, scene: Scene) -> Array:
    """Follow w by at most rate [V/s]."""
    return slewed(w, scene.values["rate"] * scene.grid.step_s)


def rounded_slew(w: Array, scene: Scene) -> Array:
    """Let w be followed by an amplifier whose input stage saturates: dw'/dt = rate tanh((w - w') / (rate lag)).

    Fourth-order Runge-Kutta, w straight between the instants; that is not stable where the lag is shorter than a step,
    and there is no lag to be seen.
    """
    if scene.values["lag"] < 0.5 * scene.grid.step_s:
        return slew_limit(w, scene)
    return slewing(w, scene.values["rate"], scene.values["lag"], scene.grid.step_s)


def absorption(w: Array, scene: Scene) -> Array:
    """Creep after every step: w' = (1 - fraction) w + fraction * w seen through 1/(1 + s tau)."""
    slow = lag(w, scene.values["tau"], scene)
    return w + scene.values["fraction"] * (slow - w)


def absorption_on_plateaus(v: Array, scene: Scene) -> Array:
    """Share the held charge with the dielectric: w + fraction q stays on plateaus, dq/dt = (w - q) / tau always."""
    follow = scene.grid.step_s / scene.values["tau"]
    return absorbing_play(*borders(v, scene.rig), scene.values["fraction"], follow)


# --- dynamics -----------------------------------------------------------------------------------------------------


def extra_pole(signal: Array, scene: Scene) -> Array:
    """Pass the signal through 1/(1 + s tau), settled before the run."""
    return lag(signal, scene.values["tau"], scene)


def adc_averaging(signal: Array, scene: Scene) -> Array:
    """Read the mean over the last ``length`` [s]: what was gathered until now less what had been then."""
    length_s, step_s = scene.values["length"], scene.grid.step_s
    gathered = cumulative_trapezoid(signal, dx=step_s, initial=0.0)
    at = np.arange(signal.size) * step_s
    before = np.interp(at - length_s, at, gathered) + signal[0] * np.minimum(at - length_s, 0.0)  # settled until then
    return np.asarray((gathered - before) / length_s)


def nonlinear_capacitor(signal: Array, scene: Scene) -> Array:
    """Let the capacitor of the low-pass of ``tau`` before this place be C (1 - k2 s^2)."""
    return charging(signal, scene.values["tau"], scene.values["k2"], scene.grid.step_s)


def self_heating(signal: Array, scene: Scene) -> Array:
    """Let the gain fall with what the square of the signal has heated: s (1 - k T), T' = (s^2 - T) / tau, V^2."""
    power, tau = 0.5 * (signal[1:] ** 2 + signal[:-1] ** 2), scene.values["tau"]
    heat = linear_block(power, (1.0,), (tau, 1.0), scene.grid.step_s)
    return signal * (1.0 - scene.values["k"] * heat)


def process_noise(v: Array, scene: Scene) -> Array:
    """Add noise of ``sd`` [V], white up to ``bandwidth`` [Hz], to v; new in every run."""
    lines = np.fft.rfft(scene.rng_of_run.normal(0.0, 1.0, v.size))
    kept = np.fft.rfftfreq(v.size, scene.grid.step_s) <= scene.values["bandwidth"]
    return v + scene.values["sd"] * np.fft.irfft(lines * kept, v.size) / np.sqrt(np.mean(kept))


def low_passed_noise(v: Array, scene: Scene) -> Array:
    """Add noise of ``sd`` [V] behind a first-order low-pass of ``bandwidth`` [Hz] to v; new in every run."""
    keep = float(np.exp(-2.0 * np.pi * scene.values["bandwidth"] * scene.grid.step_s))
    shocks = scene.rng_of_run.normal(0.0, scene.values["sd"], v.size)
    shocks[1:] *= np.sqrt(1.0 - keep * keep)
    return v + lfilter([1.0], [1.0, -keep], shocks)


def resonance(signal: Array, scene: Scene) -> Array:
    """Pass the signal through wn^2 / (s^2 + 2 zeta wn s + wn^2), settled before the run."""
    wn, zeta = scene.values["w_n"], scene.values["zeta"]
    return linear_block(between(signal), (wn**2,), (1.0, 2.0 * zeta * wn, wn**2), scene.grid.step_s, signal[0])


def lag(signal: Array, tau_s: float, scene: Scene, rest: float | None = None) -> Array:
    """Return a signal behind a pole, settled before the run: at its first value, or at ``rest``."""
    before = signal[0] if rest is None else rest
    return linear_block(between(signal), (1.0,), (tau_s, 1.0), scene.grid.step_s, before)


# --- sense --------------------------------------------------------------------------------------------------------


def feedthrough(y: Array, scene: Scene) -> Array:
    """Add k times what the DAC holds at the moment of reading: y[k] comes before u[k] acts, so it sees u[k-1]."""
    before = np.concatenate([[0.0], scene.u[:-1]])
    return y + scene.values["k"] * before


MAINS_LINES = {1: "amplitude", 2: "second", 3: "third", 4: "fourth", 5: "fifth"}


def hum_at_y(y: Array, scene: Scene) -> Array:
    """Add the line to the readings, locked to the clock and not to the run."""
    return y + _line(scene.clock_s, scene)


def hum_at_v(v: Array, scene: Scene) -> Array:
    """Add the line in front of the gap, locked to the clock."""
    return v + _line(scene.grid.start_s + scene.grid.run_s, scene)


def hum_of_gap(v: Array, scene: Scene) -> Array:
    """Let the line push the borders apart and together, locked to the clock."""
    apart = _line(scene.grid.start_s + scene.grid.run_s, scene)
    lower, upper = borders(v, scene.rig)
    return play(lower - scene.rig.s_l * apart, upper + scene.rig.s_u * apart, 0.0, 1.0, 0.0)


def _line(clock_s: Array, scene: Scene) -> Array:
    """Return the lines whose amplitudes, V, there are, phases from the case's seed."""
    turn = 2.0 * np.pi * scene.values["frequency"] * clock_s
    lines = [(n, scene.values[name]) for n, name in MAINS_LINES.items() if name in scene.values]
    phases = scene.rng.uniform(0.0, 2.0 * np.pi, len(lines))
    return sum(a * np.sin(n * turn + phase) for (n, a), phase in zip(lines, phases, strict=True))


def offset_drift(y: Array, scene: Scene) -> Array:
    """Add rate [V/s] times the clock; zero at clock 0."""
    return y + scene.values["rate"] * scene.clock_s


def gain_drift(y: Array, scene: Scene) -> Array:
    """Multiply by 1 + rate [1/s] times the clock."""
    return y * (1.0 + scene.values["rate"] * scene.clock_s)


def rectifying_sensor(y: Array, scene: Scene) -> Array:
    """Lose ``lost`` (1: all) of the sign: y' = (1 - lost) y + lost |y|."""
    lost = scene.values["lost"]
    return (1.0 - lost) * y + lost * np.abs(y)


def adc_nonlinearity(y: Array, scene: Scene) -> Array:
    """Bend the readings: y' = y + k2 y^2 + k3 y^3."""
    return y + scene.values["k2"] * y**2 + scene.values["k3"] * y**3


def ac_coupling(x: Array, scene: Scene) -> Array:
    """Pass x through s/(s + 1/tau), settled before the run."""
    return x - lag(x, scene.values["tau"], scene)


def dead_time(times_s: Array, scene: Scene) -> Array:
    """Read what was there ``delay`` before."""
    return times_s - scene.values["delay"]


def clock_skew(times_s: Array, scene: Scene) -> Array:
    """Read ``ppm`` millionths too early, counted from the start of the run: a fast clock of the ADC."""
    return times_s * (1.0 - 1e-6 * scene.values["ppm"])


def coloured_noise(y: Array, scene: Scene) -> Array:
    """Add noise of ``sd`` [V] whose power falls as 1 / f^slope from the length of the run to half the rate."""
    shape = np.maximum(np.arange(y.size // 2 + 1), 1.0) ** (-0.5 * scene.values["slope"])
    shape[0] = 0.0
    lines = shape * np.fft.rfft(scene.rng_of_run.normal(0.0, 1.0, y.size))
    power = np.sum(shape**2) * 2.0 / y.size
    return y + scene.values["sd"] * np.fft.irfft(lines, y.size) / np.sqrt(power)


def spikes(y: Array, scene: Scene) -> Array:
    """Throw single readings off by ``size`` [V], up or down, ``rate`` times a second on the clock of the case."""
    last_s = scene.grid.start_s + y.size / scene.grid.rate_hz
    moments = np.cumsum(scene.rng.exponential(1.0, 1000 + round(2.0 * last_s * scene.values["rate"])))
    signs = np.where(scene.rng.permutation(moments.size) % 2 == 0, 1.0, -1.0)
    index = np.floor((moments / scene.values["rate"] - scene.grid.start_s) * scene.grid.rate_hz)
    here = (index >= 0.0) & (index < y.size)
    out = y.copy()
    out[index[here].astype(int)] += scene.values["size"] * signs[here]
    return out


def missing_samples(y: Array, scene: Scene) -> Array:
    """Lose ``count`` readings at ``position`` [s] on the clock of the case: what follows in that run comes early."""
    at = round((scene.values["position"] - scene.grid.start_s) * scene.grid.rate_hz)
    if not 0 <= at < y.size:
        return y
    count = round(scene.values["count"])
    return np.concatenate([y[:at], y[at + count :], np.full(min(count, y.size - at), y[-1])])


Place = Literal["dac", "drive", "v", "play", "w", "x", "late", "y", "adc"]


WHERE: dict[str, tuple[Place, Change]] = {
    "dac_quantisation": ("dac", rounded),
    "source_nonlinearity": ("dac", cubic),
    "input_clipping": ("dac", clipped),
    "source_pole": ("drive", source_pole),
    "input_ac_coupling": ("drive", input_ac_coupling),
    "hum at G1": ("v", hum_at_v),
    "hum at F": ("play", hum_of_gap),
    "extra_pole in G1": ("v", extra_pole),
    "nonlinear capacitor in G1": ("v", nonlinear_capacitor),
    "absorption in G1": ("v", absorption),
    "resonance in G1": ("v", resonance),
    "process_noise": ("v", process_noise),
    "process_noise, low-passed": ("v", low_passed_noise),
    "backlash": ("play", backlash),
    "unequal_slopes": ("play", unequal_slopes),
    "leak": ("play", leak),
    "leak across": ("play", leak_across),
    "bias current": ("play", bias_current),
    "curved_border": ("play", curved_border),
    "soft_knee": ("play", soft_knee),
    "plateau_tilt": ("play", plateau_tilt),
    "second_play": ("play", second_play),
    "rate_dependent_gap": ("play", rate_dependent_gap),
    "diode_contact": ("play", diode_contact),
    "saturation": ("w", clipped),
    "soft_saturation": ("w", soft_saturation),
    "soft_saturation, upper": ("w", soft_saturation_upper),
    "soft_saturation, lower": ("w", soft_saturation_lower),
    "diode_clamp": ("w", diode_clamp),
    "diode_clamp, lower": ("w", diode_clamp_lower),
    "diode_clamp, both": ("w", diode_pair),
    "slew_limit": ("w", slew_limit),
    "slew_limit, rounded": ("w", rounded_slew),
    "absorption": ("w", absorption),
    "absorption on plateaus": ("play", absorption_on_plateaus),
    "self-heating in G1": ("v", self_heating),
    "self-heating in F": ("w", self_heating),
    "extra_pole in G2": ("x", extra_pole),
    "nonlinear capacitor in G2": ("x", nonlinear_capacitor),
    "resonance in G2": ("x", resonance),
    "adc_averaging": ("x", adc_averaging),
    "ac_coupling": ("x", ac_coupling),
    "dead_time": ("late", dead_time),
    "clock_skew": ("late", clock_skew),
    "feedthrough": ("y", feedthrough),
    "gain_drift": ("y", gain_drift),
    "rectifying_sensor": ("y", rectifying_sensor),
    "offset_drift": ("y", offset_drift),
    "adc_nonlinearity": ("y", adc_nonlinearity),
    "coloured_noise": ("y", coloured_noise),
    "hum at sense": ("y", hum_at_y),
    "spikes": ("adc", spikes),
    "adc_clipping": ("adc", clipped),
    "adc_quantisation": ("adc", rounded),
    "missing_samples": ("adc", missing_samples),
}
