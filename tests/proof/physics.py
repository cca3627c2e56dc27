"""What does a concealed piece of physics do to the signals? Each from its own equation, one function a place.

Places, in the order of the signal path: ``v`` (after G1), ``play`` (the operator itself), ``w`` (after F), ``x``
(after G2), ``late`` (how late the reading is) and ``y`` (at the readings). A function takes the signal and a Scene and
returns the signal changed; WHERE says which function stands for a name, and at which place.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.special import wrightomega

from tests.proof.integrator import Array, Grid, between, linear_block, play, read_at, slewed
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


Change = Callable[[Array, Scene], Array]


def borders(v: Array, rig: Rig) -> tuple[Array, Array]:
    """Return the rising border s_l (v - d_l), which bounds w from below, and the falling one, from above."""
    return rig.s_l * (v - rig.d_l_v), rig.s_u * (v - rig.d_u_v)


def ideal_play(v: Array, scene: Scene) -> Array:
    """Return w of the ideal operator, at rest on w = 0 before the run if the borders allow it."""
    return play(*borders(v, scene.rig), 0.0, 1.0, 0.0)


# --- F ------------------------------------------------------------------------------------------------------------


def saturation(w: Array, scene: Scene) -> Array:
    """Clip to [lower, upper]: w behind the play, or the readings."""
    return np.clip(w, scene.values["lower"], scene.values["upper"])


def soft_saturation(w: Array, scene: Scene) -> Array:
    """Compress w to level * tanh(w / level)."""
    level = scene.values["level"]
    return level * np.tanh(w / level)


def soft_saturation_upper(w: Array, scene: Scene) -> Array:
    """Compress only positive w."""
    return np.where(w > 0.0, soft_saturation(w, scene), w)


def diode_clamp(w: Array, scene: Scene) -> Array:
    """Load positive w by a chain of diodes behind a resistor: w = w' + drop (exp(w' / knee) - 1), all in V.

    Solved by Wright's omega, omega + ln(omega) = z.
    """
    drop, knee = scene.values["drop"], scene.values["knee"]
    clamped = w + drop - knee * wrightomega(np.log(drop / knee) + (w + drop) / knee)
    return np.where(w > 0.0, clamped, w)


def leak(v: Array, scene: Scene) -> Array:
    """Let the hold capacitor discharge, dw/dt = -rate * w, wherever no border holds it."""
    keep = float(np.exp(-scene.values["rate"] * scene.grid.step_s))
    return play(*borders(v, scene.rig), 0.0, keep, 0.0)


def bias_current(v: Array, scene: Scene) -> Array:
    """Let a bias current charge the hold capacitor, dw/dt = +current [V/s], wherever no border holds it."""
    return play(*borders(v, scene.rig), 0.0, 1.0, scene.values["current"] * scene.grid.step_s)


def curved_border(v: Array, scene: Scene) -> Array:
    """Bend both borders: w = s (v - d) + k3 (v - d)^3."""
    rig, k3 = scene.rig, scene.values["k3"]
    rising, falling = v - rig.d_l_v, v - rig.d_u_v
    lower = rising * (rig.s_l + k3 * rising * rising)
    upper = falling * (rig.s_u + k3 * falling * falling)
    return play(lower, upper, 0.0, 1.0, 0.0)


def second_play(v: Array, scene: Scene) -> Array:
    """Mix in, with ``weight``, a second play whose gap is ``wider`` times as wide."""
    rig, wider, weight = scene.rig, scene.values["wider"], scene.values["weight"]
    second = play(rig.s_l * (v - wider * rig.d_l_v), rig.s_u * (v - wider * rig.d_u_v), 0.0, 1.0, 0.0)
    return (1.0 - weight) * ideal_play(v, scene) + weight * second


def rate_dependent_gap(v: Array, scene: Scene) -> Array:
    """Widen the gap with speed: contact on either side is made k |dv/dt| later."""
    speed = np.abs(np.gradient(v, scene.grid.step_s))
    lower, upper = borders(v, scene.rig)
    widened = scene.values["k"] * speed
    return play(lower - scene.rig.s_l * widened, upper + scene.rig.s_u * widened, 0.0, 1.0, 0.0)


def slew_limit(w: Array, scene: Scene) -> Array:
    """Follow w by at most rate [V/s]."""
    return slewed(w, scene.values["rate"] * scene.grid.step_s)


def absorption(w: Array, scene: Scene) -> Array:
    """Creep after every step: w' = (1 - fraction) w + fraction * w seen through 1/(1 + s tau)."""
    slow = _lag(w, scene.values["tau"], scene)
    return w + scene.values["fraction"] * (slow - w)


# --- dynamics -----------------------------------------------------------------------------------------------------


def extra_pole(signal: Array, scene: Scene) -> Array:
    """Pass the signal through 1/(1 + s tau), settled before the run."""
    return _lag(signal, scene.values["tau"], scene)


def resonance(signal: Array, scene: Scene) -> Array:
    """Pass the signal through wn^2 / (s^2 + 2 zeta wn s + wn^2), settled before the run."""
    wn, zeta = scene.values["w_n"], scene.values["zeta"]
    return linear_block(between(signal), (wn**2,), (1.0, 2.0 * zeta * wn, wn**2), scene.grid.step_s, signal[0])


def _lag(signal: Array, tau_s: float, scene: Scene) -> Array:
    return linear_block(between(signal), (1.0,), (tau_s, 1.0), scene.grid.step_s, signal[0])


# --- sense --------------------------------------------------------------------------------------------------------


def feedthrough(y: Array, scene: Scene) -> Array:
    """Add k times what the DAC holds at the moment of reading: y[k] comes before u[k] acts, so it sees u[k-1]."""
    before = np.concatenate([[0.0], scene.u[:-1]])
    return y + scene.values["k"] * before


def hum_at_y(y: Array, scene: Scene) -> Array:
    """Add the line to the readings, locked to the clock and not to the run."""
    return y + _line(scene.clock_s, scene)


def hum_at_v(v: Array, scene: Scene) -> Array:
    """Add the line in front of the gap, locked to the clock."""
    return v + _line(scene.grid.start_s + scene.grid.run_s, scene)


def _line(clock_s: Array, scene: Scene) -> Array:
    """Return the fundamental, third and fifth harmonic: amplitudes in V, phases from the case's seed."""
    phases = scene.rng.uniform(0.0, 2.0 * np.pi, 3)
    turn = 2.0 * np.pi * scene.values["frequency"] * clock_s
    sizes_v = (scene.values["amplitude"], scene.values["third"], scene.values["fifth"])
    return sum(a * np.sin(n * turn + phase) for a, n, phase in zip(sizes_v, (1, 3, 5), phases, strict=True))


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
    return x - _lag(x, scene.values["tau"], scene)


Place = Literal["v", "play", "w", "x", "late", "y"]


def dead_time(x: Array, scene: Scene) -> Array:
    """Read x ``delay`` late."""
    return read_at(x, scene.grid, scene.values["delay"])


WHERE: dict[str, tuple[Place, Change]] = {
    "hum at G1": ("v", hum_at_v),
    "extra_pole in G1": ("v", extra_pole),
    "leak": ("play", leak),
    "bias current": ("play", bias_current),
    "curved_border": ("play", curved_border),
    "second_play": ("play", second_play),
    "rate_dependent_gap": ("play", rate_dependent_gap),
    "saturation": ("w", saturation),
    "soft_saturation": ("w", soft_saturation),
    "soft_saturation, upper": ("w", soft_saturation_upper),
    "diode_clamp": ("w", diode_clamp),
    "slew_limit": ("w", slew_limit),
    "absorption": ("w", absorption),
    "extra_pole in G2": ("x", extra_pole),
    "resonance in G2": ("x", resonance),
    "ac_coupling": ("x", ac_coupling),
    "dead_time": ("late", dead_time),
    "feedthrough": ("y", feedthrough),
    "gain_drift": ("y", gain_drift),
    "rectifying_sensor": ("y", rectifying_sensor),
    "offset_drift": ("y", offset_drift),
    "adc_nonlinearity": ("y", adc_nonlinearity),
    "adc_clipping": ("y", saturation),
    "hum at sense": ("y", hum_at_y),
}
