"""Are borders, G1 and G2 told from sines alone? ``python -m tests.benchmarks.sines_only [realisations]``

The recordings are the independent integrator's. Every realisation has other noise, and a start up to 30 % off in each
value. First, rigs without rails under ``protocols/sines_only.yaml`` (16 s): how far each value ends from the truth, in
its own standard errors, and how often its 95 % interval holds the truth. Beside it the standard errors from as long a
recording of a staircase and sines. Then the rig of the paper's simulation under sines like the paper's, two amplitudes
at each of its frequencies: all slow against its blocks, so that dead time and coefficients stand in for one another and
only the borders and the blocks as a whole are told. For the whole there is the gain in likelihood of the estimate over
the truth: a chi-square with as many degrees of freedom as values; below 0 the search ended beside the best values.
"""

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from identify.fit import chi_squared
from identify.identification import Identification
from identify.joint import identify
from identify.model import Backlash, Model, Rational
from identify.trace import Array, Step, Trace
from identify.uncertainty.certainty import Certainty
from tests.proof import paper_simulation
from tests.proof.bench import answer
from tests.proof.integrator import Grid
from tests.proof.rigs import OP_AMP, SKEWED, Rig
from tests.proof.stimuli import FIG13_LEVELS_V
from tests.trials import model_of

NOISE_V = 0.010
FINE = 8  # sub-steps of a sample in the integrator
# Hz and V, as in the protocol.
RUNGS = ((3, 1.75), (3, 2.45), (9, 2.5), (9, 3.45), (21, 4.65), (21, 6.5), (27, 5.85), (27, 8.1))
RATE_HZ = 9000.0
PAPER_RUNGS = ((1, 3.5, 20), (1, 2.0, 20), (5, 3.5, 40), (5, 2.0, 40), (10, 3.5, 40), (10, 2.0, 40))  # w1, V, periods
PAPER_SAMPLES = 640  # of a period at w1 = 0.01 rad/s
PAPER_NOISE_V = 0.07
OFF = 0.3


@dataclass(frozen=True)
class Bench:
    """What a bench played and its answer without noise, the true values, and the model at any values."""

    name: str
    clean: Trace
    noise_v: float
    truth: dict[str, float]
    model: Callable[[dict[str, float]], Model]

    def recorded(self, seed: int) -> Trace:
        """Return the recording with noise of its own."""
        noise = np.random.default_rng([seed, 1]).normal(0.0, self.noise_v, self.clean.size)
        return replace(self.clean, y=self.clean.y[:] + noise)

    def started(self, seed: int) -> Model:
        """Return the rig file: every value off by up to ``OFF``."""
        off = 1.0 + OFF * np.random.default_rng([seed, 2]).uniform(-1.0, 1.0, len(self.truth))
        return self.model({name: value * f for (name, value), f in zip(self.truth.items(), off, strict=True)})

    def identified(self, seed: int) -> Identification:
        """Return the answer to one realisation."""
        return identify(self.started(seed), [self.recorded(seed)])


def walked(parts: list[tuple[str, Array, int]]) -> tuple[Array, tuple[Step, ...]]:
    """Return stimuli one after the other, u in V and its steps; each is (label, u of one pass, passes)."""
    u, steps, at = [], [], 0
    for label, once, passes in parts:
        for repeat in range(passes):
            steps.append(Step(label, "sine", at, at + once.size, repeat))
            u.append(once)
            at += once.size
    return np.concatenate(u), tuple(steps)


def sine(frequency_hz: float, amplitude_v: float, seconds: float) -> tuple[str, Array, int]:
    """Return two passes of u = U cos(w t), eq. (20)."""
    t = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    return f"{frequency_hz:g} Hz, {amplitude_v:g} V", amplitude_v * np.cos(2.0 * np.pi * frequency_hz * t), 2


def sines_alone(rig: Rig, seconds: float = 1.0) -> Bench:
    """Return ``protocols/sines_only.yaml`` on a rig without rails; a pass of each sine lasts ``seconds``."""
    return _bench(rig, [sine(f, a, seconds) for f, a in RUNGS])


def staircase_and_sines(rig: Rig, seconds: float = 1.0) -> Bench:
    """Return as long a recording, half of it a staircase of 0.6 times the paper's levels, half sines."""
    levels = np.repeat(0.6 * np.asarray(FIG13_LEVELS_V), round(4.0 * seconds * RATE_HZ / len(FIG13_LEVELS_V)))
    return _bench(rig, [("stairs", levels, 2), *(sine(f, a, seconds) for f, a in RUNGS if f in (9, 27))])


def _bench(rig: Rig, parts: list[tuple[str, Array, int]]) -> Bench:
    u, steps = walked(parts)
    y = answer(rig, u, Grid(RATE_HZ, u.size, FINE))
    truth = {"F.S_L": rig.s_l, "F.D_L": rig.d_l_v, "F.S_U": rig.s_u, "F.D_U": rig.d_u_v}
    for name, den in (("G1", rig.g1_den), ("G2", rig.g2_den)):
        truth |= {f"{name}.den.s{k}": den[-1 - k] / den[-1] for k in (2, 1)}
    return Bench(rig.name, Trace(rig.name, RATE_HZ, u, y, steps=steps), NOISE_V, truth, lambda v: _model(rig, v))


def _model(rig: Rig, v: dict[str, float]) -> Model:
    one, two = (Rational((1.0,), (v[f"{g}.den.s2"], v[f"{g}.den.s1"], 1.0)) for g in ("G1", "G2"))
    f = Backlash(v["F.S_L"], v["F.D_L"], v["F.S_U"], v["F.D_U"])
    return replace(model_of(rig), g1=one, f=f, g2=two)


def paper() -> Bench:
    """Return the paper's simulated rig under sines at w1, 5 w1 and 10 w1, two amplitudes each."""
    rate_hz = PAPER_SAMPLES * 0.01 / (2.0 * np.pi)
    turn = 2.0 * np.pi * np.arange(PAPER_SAMPLES) / PAPER_SAMPLES
    u, steps = walked([(f"{n} w1, {a} V", a * np.cos(n * turn), periods // n) for n, a, periods in PAPER_RUNGS])
    y = paper_simulation.answer(paper_simulation.TRUTH, paper_simulation.Played(u, rate_hz, 16))
    truth = dict(zip(paper_simulation.NAMES, paper_simulation.TRUTH.tolist(), strict=True))
    return Bench("paper's simulation", Trace("paper", rate_hz, u, y, steps=steps), PAPER_NOISE_V, truth, _paper_model)


def _paper_model(v: dict[str, float]) -> Model:
    gain = paper_simulation.G1_GAIN
    g1 = Rational((gain,), (v["G1.den.s2"], v["G1.den.s1"], 1.0))
    g2 = Rational((1.0,), (v["G2.den.s3"], v["G2.den.s2"], v["G2.den.s1"], 1.0), v["G2.dead_time"])
    return Model("paper", g1, Backlash(v["F.S_L"], v["F.D_L"], v["F.S_U"], v["F.D_U"]), g2, PAPER_NOISE_V)


def off(told: Certainty, truth: dict[str, float]) -> Iterator[tuple[str, float, float]]:
    """Yield every value the data tell: its name, its distance from the truth in standard errors, its standard error."""
    for name, true in truth.items():
        if name in told.names:
            k = told.names.index(name)
            sd = float(np.sqrt(told.covariance[k, k]))
            yield name, (told.values[name] - true) / sd, sd


def gain(bench: Bench, found: Identification) -> float:
    """Return twice the log-likelihood of the estimate less that of the truth."""
    o = found.observations[0]
    truth = np.sum(np.square((o.trace.y[:] - bench.clean.y[:])[o.use])) / o.noise_v**2
    return float(truth - chi_squared(found.fit.chain, o))


def _held(told: Certainty, name: str, true: float) -> bool:
    """Return whether the answer's own 95 % interval holds a true value."""
    interval = told.interval(name)
    return interval.low <= true <= interval.high


def table(bench: Bench, realisations: int, beside: Bench | None) -> None:
    """Print one bench."""
    found = [bench.identified(seed) for seed in range(realisations)]
    gains = np.array([gain(bench, f) for f in found])
    print(f"\n{bench.name}: {bench.clean.size} samples, {np.sum(gains > 0.0)} of {realisations} starts led to the best")
    spread = f"{gains.min():.1f} to {gains.max():.1f}, mean {gains.mean():.1f}"
    print(f"  gain over the truth {spread}; {len(bench.truth)} values")
    rows = [{n: (z, sd) for n, z, sd in off(f.certainty, bench.truth)} for f in found]
    other = {n: sd for n, _, sd in off(beside.identified(0).certainty, beside.truth)} if beside else {}
    print(f"  {'value':<14}{'truth':>10}{'se, sines':>12}{'rms off/se':>12}{'held':>8}  se, staircase and sines")
    for name in rows[0]:
        z = np.array([row[name][0] for row in rows if name in row])
        told = f"{other[name]:>12.2g}" if name in other else ""
        print(f"  {name:<14}{bench.truth[name]:>10.4g}{rows[0][name][1]:>12.2g}{np.sqrt(np.mean(z**2)):>12.2f}"
              f"{100.0 * np.mean([_held(f.certainty, name, bench.truth[name]) for f in found]):>6.0f} %{told}")


def main(realisations: int) -> None:
    """Print one table a bench."""
    for rig in (OP_AMP, SKEWED):
        table(sines_alone(rig), realisations, staircase_and_sines(rig))
    table(paper(), realisations, None)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 40)
