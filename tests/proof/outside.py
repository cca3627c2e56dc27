"""What may be missing that no catalogue lists? Physics of the bench's own devising, to see what is said of the unheard.

Laws as in tests/proof/physics.py, with the same places. None of them is an effect of the product, and none may become
one: they stand for what a user's rig has and nobody thought of.
"""

import numpy as np
from numba import njit
from scipy.signal import lfilter

from tests.proof.integrator import Array, giving_play, kicking_play, play, read_when, sticking_play
from tests.proof.physics import Change, Place, Scene, borders, lag, slew_limit


def _clock_s(signal: Array, scene: Scene) -> Array:
    """Return the clock that all runs share in the middle of every step of a signal, s."""
    return np.asarray(scene.grid.start_s + (np.arange(signal.size) + 0.5) * scene.grid.step_s)


def reference_ripple(drive: Array, scene: Scene) -> Array:
    """Let the DAC's reference ripple: u times 1 + share sin(2 pi f t), locked to the clock."""
    time_s = _clock_s(drive, scene)
    return drive * (1.0 + scene.values["share"] * np.sin(2.0 * np.pi * scene.values["frequency"] * time_s))


def source_line(drive: Array, scene: Scene) -> Array:
    """Add a line to u, ``amplitude`` [V] at ``frequency`` [Hz], as the converter in a generator's supply does."""
    time_s = _clock_s(drive, scene)
    return drive + scene.values["amplitude"] * np.sin(2.0 * np.pi * scene.values["frequency"] * time_s)


def sawtooth(v: Array, scene: Scene) -> Array:
    """Add a sawtooth of ``size`` [V] and ``frequency`` [Hz] to v, as a supply that switches does."""
    time_s = scene.grid.start_s + scene.grid.run_s
    return v + scene.values["size"] * (2.0 * ((time_s * scene.values["frequency"]) % 1.0) - 1.0)


def rippling_gain(v: Array, scene: Scene) -> Array:
    """Let the gain of G1 ripple: v times 1 + share sin(2 pi f t), locked to the clock, as its supply does."""
    time_s = scene.grid.start_s + scene.grid.run_s
    return v * (1.0 + scene.values["share"] * np.sin(2.0 * np.pi * scene.values["frequency"] * time_s))


def level_dependent_delay(v: Array, scene: Scene) -> Array:
    """Let v come later the higher it stands, by k [s/V], as behind a capacitance that depends on its voltage."""
    time_s = scene.grid.run_s
    return read_when(v, time_s - scene.values["k"] * np.abs(v), scene.grid.step_s)


def stick_slip(v: Array, scene: Scene) -> Array:
    """Let w stick once it rested: it breaks loose only ``stuck`` [V] of w past a border, and then jumps onto it."""
    return sticking_play(*borders(v, scene.rig), scene.values["stuck"])


def giving_contact(v: Array, scene: Scene) -> Array:
    """Let w follow its border through ``tau`` [s] in contact, as a capacitor charged through a resistance does."""
    return np.asarray(giving_play(*borders(v, scene.rig), scene.grid.step_s / scene.values["tau"]))


def kicking_contact(v: Array, scene: Scene) -> Array:
    """Let either contact kick w by ``kick`` [V] away as it opens, as the charge of a switch does."""
    return np.asarray(kicking_play(*borders(v, scene.rig), scene.values["kick"]))


def later_contact(v: Array, scene: Scene) -> Array:
    """Make contact on rises alone k |dv/dt| later: one of two diodes is slow."""
    lower, upper = borders(v, scene.rig)
    later = scene.rig.s_l * scene.values["k"] * np.abs(np.gradient(v, scene.grid.step_s))
    return play(lower - later, upper, 0.0, 1.0, 0.0)


def ringing_contact(v: Array, scene: Scene) -> Array:
    """Let w swing by ``size`` [V] about the border at every new contact, at ``frequency`` [Hz], and die away.

    On the falling border ``falling`` times as far, as far where that is not given.
    """
    turn, size = 2.0 * np.pi * scene.values["frequency"] * scene.grid.step_s, scene.values["size"]
    return np.asarray(_rung(*borders(v, scene.rig), size, scene.values.get("falling", 1.0) * size, turn))


@njit(cache=True)
def _rung(lower, upper, rising, falling, turn):  # type: ignore[no-untyped-def]  # compiled
    """Return a play between two borders whose contacts ring, ``turn`` [rad] a step, a tenth of critical damping."""
    out = np.empty(lower.size)
    w, side, off, speed = 0.0, 0, 0.0, 0.0
    for n in range(lower.size):
        new = 1 if w < lower[n] else -1 if w > upper[n] else 0
        w = min(upper[n], max(lower[n], w))
        if new not in (0, side):
            side, speed = new, speed + (rising if new > 0 else -falling)
        speed -= turn * off + 0.2 * turn * speed
        off += turn * speed
        out[n] = w + off
    return out


def wearing_gap(v: Array, scene: Scene) -> Array:
    """Let the gap widen with the clock: both crossings times 1 + rate t."""
    rig = scene.rig
    wider = 1.0 + scene.values["rate"] * (scene.grid.start_s + scene.grid.run_s)
    return play(rig.s_l * (v - wider * rig.d_l_v), rig.s_u * (v - wider * rig.d_u_v), 0.0, 1.0, 0.0)


def crossover(w: Array, scene: Scene) -> Array:
    """Lose the middle of w, as a class-B stage without bias does: nothing until ``dead`` [V], then w less that."""
    return np.sign(w) * np.maximum(np.abs(w) - scene.values["dead"], 0.0)


def lost_contact(w: Array, scene: Scene) -> Array:
    """Hold w while a contact is open: ``rate`` times a second, for ``length`` [s] each, anew in every run."""
    duration_s = scene.grid.run_s[-1]
    opens_s = scene.rng_of_run.uniform(0.0, duration_s, max(1, round(scene.values["rate"] * duration_s)))
    return _held(w, scene.grid.run_s, np.sort(opens_s), scene.values["length"])


@njit(cache=True)
def _held(signal, time_s, opens_s, length_s):  # type: ignore[no-untyped-def]  # compiled
    """Return the signal held for ``length_s`` from every one of the times ``opens_s`` on."""
    out = signal.copy()
    i, until_s = 0, -1.0
    for n in range(1, out.size):
        while i < opens_s.size and time_s[n] >= opens_s[i]:
            until_s = opens_s[i] + length_s
            i += 1
        if time_s[n] < until_s:
            out[n] = out[n - 1]
    return out


def echo(x: Array, scene: Scene) -> Array:
    """Add what was there ``delay`` [s] before, ``share`` of it."""
    return x + scene.values["share"] * read_when(x, scene.grid.run_s - scene.values["delay"], scene.grid.step_s)


def stray_line(y: Array, scene: Scene) -> Array:
    """Add a line that is none of the mains, ``amplitude`` [V] at ``frequency`` [Hz], as a switching supply does."""
    return y + scene.values["amplitude"] * np.sin(2.0 * np.pi * scene.values["frequency"] * scene.clock_s)


def telegraph(y: Array, scene: Scene) -> Array:
    """Let the zero jump up by ``size`` [V] and back at moments of chance, ``rate`` a second: popcorn noise."""
    return y + scene.values["size"] * _jumped(scene.clock_s, scene)


def _jumped(time_s: Array, scene: Scene) -> Array:
    """Return 1 and 0 in turn, changing at moments of chance, ``rate`` a second, of the clock from zero on."""
    mean_s = 1.0 / scene.values["rate"]
    moments_s = np.cumsum(scene.rng.exponential(mean_s, 200 + round(2.0 * time_s[-1] / mean_s)))
    return np.asarray(np.searchsorted(moments_s, time_s) % 2)


def missing_code(y: Array, scene: Scene) -> Array:
    """Jump by ``step`` [V] above the reading ``level`` [V], as a converter does where a bit weighs too much."""
    return y + scene.values["step"] * (y > scene.values["level"])


def stuck_bit(u: Array, scene: Scene) -> Array:
    """Let the bit of the DAC that weighs ``weight`` [V] stick at one: u is that much higher where it should be zero."""
    return u + scene.values["weight"] * (np.floor(u / scene.values["weight"]) % 2.0 == 0.0)


def dead_dac(u: Array, scene: Scene) -> Array:
    """Let the DAC put out nothing below ``dead`` [V] either way, and all of it beyond."""
    return np.where(np.abs(u) < scene.values["dead"], 0.0, u)


def cracked_joint(v: Array, scene: Scene) -> Array:
    """Let v be larger by ``share`` from the clock time ``moment`` [s] on: a resistor beside it has let go."""
    time_s = scene.grid.start_s + scene.grid.run_s
    return v * (1.0 + scene.values["share"] * (time_s > scene.values["moment"]))


def warming_gap(v: Array, scene: Scene) -> Array:
    """Let the gap widen with heat: both crossings times 1 + k q, q what v^2 (in units of top^2) warms in tau [s]."""
    rig = scene.rig
    wider = 1.0 + scene.values["k"] * lag((v / scene.values["top"]) ** 2, scene.values["tau"], scene)
    return play(rig.s_l * (v - wider * rig.d_l_v), rig.s_u * (v - wider * rig.d_u_v), 0.0, 1.0, 0.0)


def trigger(w: Array, scene: Scene) -> Array:
    """Add ``size`` [V] while a Schmitt trigger is up: it goes up at w = ``level`` [V], and down again at -``level``."""
    return w + scene.values["size"] * _up(w, scene.values["level"])


@njit(cache=True)
def _up(signal, level):  # type: ignore[no-untyped-def]  # compiled
    """Return 1 where a trigger that goes up at ``level`` and down at minus that is up, 0 where it is down."""
    out = np.zeros(signal.size)
    up = 0.0
    for n in range(signal.size):
        if signal[n] > level:
            up = 1.0
        elif signal[n] < -level:
            up = 0.0
        out[n] = up
    return out


def sagging_rails(w: Array, scene: Scene) -> Array:
    """Clip w to +-``rail`` [V], less ``sag`` of what |w| was on average over the last ``tau`` [s]."""
    rail = scene.values["rail"] - scene.values["sag"] * lag(np.abs(w), scene.values["tau"], scene)
    return np.clip(w, -rail, rail)


def one_way_lag(x: Array, scene: Scene) -> Array:
    """Follow x at once when it falls, and behind a pole of ``tau`` [s] when it rises: a stage that only pulls down."""
    return _rising(x, -np.expm1(-scene.grid.step_s / scene.values["tau"]))


@njit(cache=True)
def _rising(signal, follow):  # type: ignore[no-untyped-def]  # compiled
    """Return a signal that is followed at once downwards and by the share ``follow`` a step upwards."""
    out = np.empty(signal.size)
    level = signal[0]
    for n in range(signal.size):
        level = signal[n] if signal[n] < level else level + follow * (signal[n] - level)
        out[n] = level
    return out


def adc_ripple(y: Array, scene: Scene) -> Array:
    """Let the ADC's reference ripple: y times 1 + share sin(2 pi f t), locked to the clock."""
    return y * (1.0 + scene.values["share"] * np.sin(2.0 * np.pi * scene.values["frequency"] * scene.clock_s))


def dac_glitch(drive: Array, scene: Scene) -> Array:
    """Add a pulse of ``size`` [V] that dies away in ``tau`` [s] wherever u changes its sign: a DAC's largest bit."""
    grid, sub = scene.grid, drive.size // scene.u.size
    pulses = np.zeros(drive.size)
    pulses[sub * (np.flatnonzero(np.diff(scene.u > 0.0)) + 1)] = scene.values["size"]
    return drive + lfilter([1.0], [1.0, -np.exp(-grid.step_s / scene.values["tau"])], pulses)


def tired_source(drive: Array, scene: Scene) -> Array:
    """Let the source weaken with what it has given: u times 1 - k q, q the integral of |u| in the run [V s]."""
    return drive * (1.0 - scene.values["k"] * np.cumsum(np.abs(drive)) * scene.grid.step_s)


def drifting_pole(signal: Array, scene: Scene) -> Array:
    """Let a lag of ``tau`` [s] come in with the clock: a share rate t of the signal is behind it."""
    time_s = scene.grid.start_s + scene.grid.run_s
    return signal + scene.values["rate"] * time_s * (lag(signal, scene.values["tau"], scene) - signal)


def touched_part(signal: Array, scene: Scene) -> Array:
    """Put ``share`` of the signal behind a lag of ``tau`` [s] from the clock time ``moment`` [s] on."""
    after = scene.grid.start_s + scene.grid.run_s > scene.values["moment"]
    return signal + scene.values["share"] * after * (lag(signal, scene.values["tau"], scene) - signal)


def varistor(signal: Array, scene: Scene) -> Array:
    """Load the capacitor of a filter by a varistor: tau ds/dt = s_0 - s - k s (s / top)^4, k its share at ``top`` [V].
    """
    values = scene.values
    return np.asarray(_loaded(signal, values["k"], values["top"], scene.grid.step_s / values["tau"]))


@njit(cache=True)
def _loaded(signal, k, top, steps):  # type: ignore[no-untyped-def]  # compiled
    """Return what is left of a filter's answer: what it lacks follows -k s (s / top)^4 through tau, by Heun's method.
    """
    out = np.empty(signal.size)
    less, before = 0.0, 0.0
    for n in range(signal.size):
        level = before + less
        one = -steps * (less + k * level * (level / top) ** 4)
        level = signal[n] + less + one
        two = -steps * (less + one + k * level * (level / top) ** 4)
        less += 0.5 * (one + two)
        before = signal[n]
        out[n] = before + less
    return out


def detents(v: Array, scene: Scene) -> Array:
    """Let w, while no border holds it, be drawn into detents ``pitch`` [V] apart, by ``pull`` [V/s] where it is most.
    """
    pull, pitch = scene.values["pull"] * scene.grid.step_s, scene.values["pitch"]
    return np.asarray(_drawn_in(*borders(v, scene.rig), pull, pitch))


@njit(cache=True)
def _drawn_in(lower, upper, pull, pitch):  # type: ignore[no-untyped-def]  # compiled
    """Return the level between two borders, drawn on from where it was."""
    out, w = np.empty(lower.size), 0.0
    for n in range(lower.size):
        w -= pull * np.sin(2.0 * np.pi * w / pitch)
        w = min(max(w, lower[n]), upper[n])
        out[n] = w
    return out


def remembering_gap(v: Array, scene: Scene) -> Array:
    """Let both crossings grow by k [1/V] of how far v went before it turned last."""
    rig = scene.rig
    wider = 1.0 + scene.values["k"] * _turned(v)
    return play(rig.s_l * (v - wider * rig.d_l_v), rig.s_u * (v - wider * rig.d_u_v), 0.0, 1.0, 0.0)


def popcorn_gap(v: Array, scene: Scene) -> Array:
    """Let the crossing of rises jump out by ``size`` [V] and back at moments of chance, ``rate`` a second: its zener.
    """
    rig, further = scene.rig, scene.values["size"] * _jumped(scene.grid.start_s + scene.grid.run_s, scene)
    return play(rig.s_l * (v - rig.d_l_v - further), rig.s_u * (v - rig.d_u_v), 0.0, 1.0, 0.0)


def plastic_gap(v: Array, scene: Scene) -> Array:
    """Let both crossings grow by k [1/V] of how far v ever went in the run: a gap that gives way for good."""
    rig = scene.rig
    wider = 1.0 + scene.values["k"] * np.maximum.accumulate(np.abs(v))
    return play(rig.s_l * (v - wider * rig.d_l_v), rig.s_u * (v - wider * rig.d_u_v), 0.0, 1.0, 0.0)


@njit(cache=True)
def _turned(signal):  # type: ignore[no-untyped-def]  # compiled
    """Return how far the signal was from zero where it turned last."""
    out = np.empty(signal.size)
    last, up, turned = 0.0, True, 0.0
    for n in range(signal.size):
        if (signal[n] < last) if up else (signal[n] > last):
            up, turned = not up, abs(last)
        last = signal[n]
        out[n] = turned
    return out


def one_way_slew(w: Array, scene: Scene) -> Array:
    """Let w rise by no more than ``rate`` [V/s], and fall as it likes."""
    return _rising_slowly(w, scene.values["rate"] * scene.grid.step_s)


@njit(cache=True)
def _rising_slowly(signal, most):  # type: ignore[no-untyped-def]  # compiled
    """Return the signal followed by a stage that rises by ``most`` a step at most."""
    out = signal.copy()
    for n in range(1, signal.size):
        out[n] = min(signal[n], out[n - 1] + most)
    return out


def dent(w: Array, scene: Scene) -> Array:
    """Add a bump of ``size`` [V] at w = ``level`` [V], ``width`` [V] wide: a worn track."""
    return w + scene.values["size"] * np.exp(-(((w - scene.values["level"]) / scene.values["width"]) ** 2))


def sagging_supply(x: Array, scene: Scene) -> Array:
    """Let what is put out lose a share k [1/V] of what |x| was on average over the last ``tau`` [s]."""
    return x * (1.0 - scene.values["k"] * lag(np.abs(x), scene.values["tau"], scene))


def crosstalk(y: Array, scene: Scene) -> Array:
    """Add ``size`` [V] while u is above ``level`` [V]: a logic line runs beside the sense wire."""
    before = np.concatenate([[0.0], scene.u[:-1]])
    return y + scene.values["size"] * (before > scene.values["level"])


def wavy_adc(y: Array, scene: Scene) -> Array:
    """Bend the readings by a wave of ``size`` [V] and ``period`` [V], as a folding converter does."""
    return y + scene.values["size"] * np.sin(2.0 * np.pi * y / scene.values["period"])


def jitter(y: Array, scene: Scene) -> Array:
    """Read y too early or too late by chance, ``sd`` [s]: the faster it moves, the more that scatters."""
    slope = np.gradient(y) * scene.grid.rate_hz
    return y + slope * scene.rng_of_run.normal(0.0, scene.values["sd"], y.size)


def noisy_reference(y: Array, scene: Scene) -> Array:
    """Let the ADC's reference be noisy: y times 1 + e, e white and of rms ``sd``."""
    return y * (1.0 + scene.rng_of_run.normal(0.0, scene.values["sd"], y.size))


def shared_supply(y: Array, scene: Scene) -> Array:
    """Let readings shrink by ``share`` where the generator puts out ``top`` [V] either way: one supply feeds both."""
    before = np.concatenate([[0.0], scene.u[:-1]])
    return y * (1.0 - scene.values["share"] * np.abs(before) / scene.values["top"])


def wandering_hold(v: Array, scene: Scene) -> Array:
    """Let w walk at random inside the gap, ``sd`` [V] in a second: what holds it there gathers noise."""
    step_v = scene.values["sd"] * np.sqrt(scene.grid.step_s) * scene.rng_of_run.normal(size=v.size)
    return pushed_about(*borders(v, scene.rig), step_v)


@njit(cache=True)
def pushed_about(lower, upper, step):  # type: ignore[no-untyped-def]  # compiled
    """Return what moves by a step of its own between two borders, which keep it in."""
    out = np.empty(lower.size)
    w = 0.0
    for n in range(lower.size):
        w = min(upper[n], max(lower[n], w + step[n]))
        out[n] = w
    return out


def warm_joint(y: Array, scene: Scene) -> Array:
    """Add what a joint of two metals gives that y warms: ``k`` [V] times (y / top) squared, ``tau`` [s] late."""
    share = -np.expm1(-1.0 / (scene.grid.rate_hz * scene.values["tau"]))
    heat = lfilter([share], [1.0, share - 1.0], np.square(y / scene.values["top"]))
    return y + scene.values["k"] * np.asarray(heat)


def hurried_reading(y: Array, scene: Scene) -> Array:
    """Read too little of y the faster it moves: ``k`` less at ``top`` [V/s], in proportion below."""
    rate = np.abs(np.gradient(y)) * scene.grid.rate_hz
    return np.asarray(y * (1.0 - scene.values["k"] * np.minimum(rate / scene.values["top"], 1.0)))


def dimmed_source(drive: Array, scene: Scene) -> Array:
    """Take ``share`` of u away for the first 3 ms of every half period of the mains, as beside a dimmer."""
    time_s = _clock_s(drive, scene)
    return np.asarray(drive * (1.0 - scene.values["share"] * (np.mod(time_s, 0.01) < 0.003)))


def _moved_of_late(signal: Array, scene: Scene) -> Array:
    """Return how fast a signal moved of late, in units of ``top`` [V/s], behind ``tau`` [s]; it rests before."""
    rate = np.abs(np.gradient(signal, scene.grid.step_s)) / scene.values["top"]
    return lag(rate, scene.values["tau"], scene, rest=0.0)


def worked_gain(w: Array, scene: Scene) -> Array:
    """Let w shrink by k of how much it moved of late: abs(dw/dt), in units of ``top`` [V/s], behind ``tau`` [s]."""
    return np.asarray(w * (1.0 - scene.values["k"] * _moved_of_late(w, scene)))


def stirred_gap(v: Array, scene: Scene) -> Array:
    """Move both borders out by ``k`` [V] times how much v moved of late: abs(dv/dt), in units of ``top`` [V/s]."""
    wider, rig = scene.values["k"] * _moved_of_late(v, scene), scene.rig
    return play(rig.s_l * (v - rig.d_l_v - wider), rig.s_u * (v - rig.d_u_v + wider), 0.0, 1.0, 0.0)


def rectified_offset(v: Array, scene: Scene) -> Array:
    """Add k times the size of v behind ``tau`` [s]: a part of v is rectified and charges a capacitor in its path."""
    return np.asarray(v + scene.values["k"] * lag(np.abs(v), scene.values["tau"], scene))


def late_converter(y: Array, scene: Scene) -> Array:
    """Read every second time ``late`` [s] after the instant: two converters in turn, of which one is late."""
    late_s = np.where(np.arange(y.size) % 2 == 1, scene.values["late"], 0.0)
    return np.asarray(y - late_s * np.gradient(y) * scene.grid.rate_hz)


def scattered_gap(v: Array, scene: Scene) -> Array:
    """Let every turn of v find another gap: both crossings further out by a chance of ``sd`` [V], anew at each turn."""
    rig, way = scene.rig, np.sign(np.diff(v, prepend=0.0))
    moving = np.flatnonzero(way)
    turn = np.zeros(v.size, dtype=np.intp)
    turn[moving] = np.concatenate([[0], np.cumsum(np.diff(way[moving]) != 0.0)]) if moving.size else 0
    turn = np.maximum.accumulate(turn)
    wider = scene.rng_of_run.normal(0.0, scene.values["sd"], int(turn[-1]) + 1)[turn]
    return play(rig.s_l * (v - rig.d_l_v - wider), rig.s_u * (v - rig.d_u_v + wider), 0.0, 1.0, 0.0)


def stale_reading(y: Array, scene: Scene) -> Array:
    """Give the reading before once more, in a ``share`` of them by chance: the converter was not ready."""
    stale = scene.rng_of_run.uniform(size=y.size) < scene.values["share"]
    stale[0] = False
    return np.asarray(y[np.maximum.accumulate(np.where(stale, 0, np.arange(y.size)))])


def debounced_contact(v: Array, scene: Scene) -> Array:
    """Let either contact be made only when v has pushed for ``wait`` [s]: w then jumps onto its border."""
    return np.asarray(_waited(*borders(v, scene.rig), scene.values["wait"] / scene.grid.step_s))


@njit(cache=True)
def _waited(lower, upper, wait):  # type: ignore[no-untyped-def]  # compiled
    """Return a play of which a border takes w along only after it has pushed for ``wait`` steps."""
    out = np.empty(lower.size)
    w, pushed = 0.0, 0.0
    for n in range(lower.size):
        pushed = 0.0 if lower[n] <= w <= upper[n] else pushed + 1.0
        if pushed > wait:
            w = min(upper[n], max(lower[n], w))
        out[n] = w
    return out


def switching_gain(x: Array, scene: Scene) -> Array:
    """Let x be larger by ``share`` from where it exceeds ``level`` [V] until it falls below minus that: a range."""
    return x * (1.0 + scene.values["share"] * _up(x, scene.values["level"]))


OUTSIDE: dict[str, tuple[Place, Change]] = {
    "debounced_contact": ("play", debounced_contact),
    "switching_gain": ("x", switching_gain),
    "reference_ripple": ("drive", reference_ripple),
    "source_line": ("drive", source_line),
    "rippling_gain": ("v", rippling_gain),
    "level_dependent_delay": ("v", level_dependent_delay),
    "stick_slip": ("play", stick_slip),
    "giving_contact": ("play", giving_contact),
    "kicking_contact": ("play", kicking_contact),
    "ringing_contact": ("play", ringing_contact),
    "worked_gain": ("w", worked_gain),
    "late_converter": ("y", late_converter),
    "stirred_gap": ("play", stirred_gap),
    "rectified_offset": ("v", rectified_offset),
    "later_contact": ("play", later_contact),
    "wearing_gap": ("play", wearing_gap),
    "crossover": ("w", crossover),
    "lost_contact": ("w", lost_contact),
    "echo": ("x", echo),
    "stray_line": ("y", stray_line),
    "telegraph": ("y", telegraph),
    "missing_code": ("y", missing_code),
    "stuck_bit": ("dac", stuck_bit),
    "cracked_joint": ("v", cracked_joint),
    "warming_gap": ("play", warming_gap),
    "trigger": ("w", trigger),
    "sagging_rails": ("w", sagging_rails),
    "one_way_lag": ("x", one_way_lag),
    "adc_ripple": ("y", adc_ripple),
    "dac_glitch": ("drive", dac_glitch),
    "tired_source": ("drive", tired_source),
    "drifting_pole in G1": ("v", drifting_pole),
    "drifting_pole in G2": ("x", drifting_pole),
    "touched_part in G1": ("v", touched_part),
    "touched_part in G2": ("x", touched_part),
    "varistor in G1": ("v", varistor),
    "varistor in G2": ("x", varistor),
    "detents": ("play", detents),
    "popcorn_gap": ("play", popcorn_gap),
    "plastic_gap": ("play", plastic_gap),
    "sawtooth": ("v", sawtooth),
    "remembering_gap": ("play", remembering_gap),
    "one_way_slew": ("w", one_way_slew),
    "dent": ("w", dent),
    "sagging_supply": ("x", sagging_supply),
    "crosstalk": ("y", crosstalk),
    "wavy_adc": ("y", wavy_adc),
    "dead_dac": ("dac", dead_dac),
    "jitter": ("y", jitter),
    "noisy_reference": ("y", noisy_reference),
    "shared_supply": ("y", shared_supply),
    "wandering_hold": ("play", wandering_hold),
    "slow_g1": ("v", slew_limit),  # the amplifier of G1 is too slow, not that of F
    "warm_joint": ("y", warm_joint),
    "hurried_reading": ("y", hurried_reading),
    "dimmed_source": ("drive", dimmed_source),
    "scattered_gap": ("play", scattered_gap),
    "stale_reading": ("y", stale_reading),
}
