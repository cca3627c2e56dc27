"""What do the paper's tables become when an efficient estimator looks at the same amount of data?

``python -m tests.benchmarks.paper_tables [--realisations 10] [--seed 0]``

Tables 3 to 7 and the best fit rate of eq. (42): the truth, what the paper printed, its own method and ours side by side
on the same readings, and the Cramer-Rao bound. The readings come from the integrator of tests/proof. *Measured* is ours
without any rational form of G1 and G2 (or the reason why there is no number), *joint* the fit of all runs together.
"""

import argparse
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain

import numpy as np

from identify.harmonic import paper
from identify.harmonic.measured import Known, Measured, MeasuredPoint, measured
from identify.harmonic.periods import Period, periods
from identify.harmonic.steady import frequency_response
from identify.identification import Identification
from identify.joint import identify
from identify.model import Backlash, Rational
from identify.trace import Array
from tests.benchmarks.paper_experiments import (
    LEVELS,
    MAINS_HZ,
    REAL_TRUTH,
    TABLE_3,
    W1,
    Experiment,
    M,
    information,
    level_slopes,
    real_information,
    real_rig,
    real_tone,
    real_walk,
    rig_file,
    settled_levels,
    tone,
    values_with,
    walk,
)  # fmt: skip
from tests.proof import paper_simulation as simulated
from tests.proof.paper_simulation import TRUTH
from tests.proof.rigs import OP_AMP, toleranced
from tests.trials import model_of

Printed = dict[int, tuple[float, float]]
Limits = tuple[float | None, float | None]
W1_HZ = W1 / (2.0 * np.pi)
SINES = (1, 5, 10)
BAND = 25  # w1: the measurement band of Table 2
ROWS = np.array([4, 8, 12, 16, 20, 26])  # k of Table 3
PRINTED_3 = {
    32.0: (-2.14, 0.251, 3.755, 4.65, 2.25, -3.01), 64.6: (-2.144, 0.25, 3.774, 4.623, 2.246, -3.02),
    11.0: (-1.65, 0.34, 3.01, 5.4, 2.52, -2.43), 10.0: (-1.03, 0.06, 1.62, 2.0, 3.77, -5.15),
}  # fmt: skip
PRINTED_4: dict[float, Printed] = {  # |G1| and its phase at w1, 5 w1 and 10 w1
    34.45: {1: (0.97, -0.038), 5: (1.01, -0.153), 10: (0.96, -0.32)},
    71.6: {1: (1.02, -0.033), 5: (1.004, -0.142), 10: (0.92, -0.26)},
    9.9: {1: (1.35, -0.046), 5: (0.71, -0.24), 10: (1.28, -0.21)},
    9.0: {1: (1.31, -0.16), 5: (0.43, -0.36)},
}
PRINTED_5: dict[float, Printed] = {  # |G2| and its phase at k w1; the labels of the rows put right (physics.md 1.7)
    34.45: {1: (1.01, -0.14), 2: (1.02, -0.29), 3: (0.97, -0.44), 4: (0.94, -0.59), 5: (0.98, -0.64)},
    71.6: {1: (0.994, -0.131), 2: (0.998, -0.26), 3: (1.01, -0.41), 4: (0.983, -0.52), 5: (0.93, -0.7)},
    9.9: {1: (1.10, -0.15), 2: (0.87, -0.38), 3: (0.82, -0.55), 4: (1.08, -0.64), 5: (0.84, -0.48)},
    9.0: {1: (1.92, 0.44), 2: (2.01, -0.51), 3: (0.33, -0.17), 4: (0.15, -0.83), 5: (1.78, -1.01)},
}
PRINTED_6 = {1: (0.17, -1.43), 2: (0.071, -1.53), 5: (0.026, -1.59)}
PRINTED_7 = {1: (0.87, -0.52), 2: (0.59, -0.83), 3: (0.51, -1.11), 4: (0.32, -1.26)}


# --- Table 3 and eq. (42) -----------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Levels:
    """The 26 levels of the staircase by the paper's method and by ours, V, over realisations, shape (runs, 26)."""

    noise_v: float
    truth: Array
    paper: Array
    ours: Array

    @property
    def bound(self) -> Array:
        """Return the Cramer-Rao bound on the sd of every level."""
        slopes = level_slopes(TABLE_3)
        covariance = np.linalg.inv(slopes.T @ slopes) * self.noise_v**2 / M
        return np.sqrt(np.diag(slopes @ covariance @ slopes.T))


def levels(made: Experiment, decibels: float, seeds: Sequence[int]) -> Levels:
    """Return the levels at one signal-to-noise ratio; ours are those of the borders found.

    Settled readings do not tell G1 and G2, which are held at the truth; free, an overshoot of G1 within their reach
    shifts the borders (physics.md 1.6), which the paper rules out.
    """
    noise_v, theirs, ours = made.noise_v(decibels), [], []
    model = replace(rig_file(0.0), f=rig_file().f, fixed=("G1", "G2", "delay"))
    for seed in seeds:
        trace = made.trace(noise_v, seed)
        theirs.append(paper.table_1(LEVELS, made.readings(trace)).means_v)
        found = identify(model, [trace])
        ours.append(settled_levels(normalised_borders(found)))
    return Levels(noise_v, settled_levels(TABLE_3), np.array(theirs), np.array(ours))


def normalised_borders(found: Identification) -> Backlash:
    """Return the borders of an answer, V_p = G2(0) = 1."""
    return Backlash(*(found.borders[name].value for name in ("S_L", "D_L", "S_U", "D_U")))


def best_fit_rate(truth: Array, found: Array, half: slice) -> float:
    """Return BFR of eq. (42), %; U = 0 of the same half stands for the mean."""
    zero = truth[half][np.flatnonzero(LEVELS[half] == 0.0)[0]]
    return 100.0 * max(1.0 - float(np.linalg.norm(truth[half] - found[half]) / np.linalg.norm(truth[half] - zero)), 0.0)


def table_3(seeds: Sequence[int]) -> Iterator[str]:
    """Tell Table 3 and eq. (43)."""
    made = walk(values_with(TABLE_3))
    yield "Table 3: settled levels X_k in V, M = 200 readings each"
    for decibels, printed in PRINTED_3.items():
        found = levels(made, decibels, seeds)
        rms = [float(np.sqrt(np.mean(np.square(x - found.truth)))) for x in (found.paper, found.ours)]
        yield f"\n{decibels:g} dB, noise {found.noise_v:.4g} V      " + "".join(f"{f'k = {k}':>10s}" for k in ROWS)
        shown = {
            "truth": found.truth[ROWS - 1], "printed in the paper": np.array(printed),
            "the paper's method": found.paper[0][ROWS - 1], "ours": found.ours[0][ROWS - 1],
        }  # fmt: skip
        for name, row in shown.items():
            yield f"{name:28s}" + "".join(f"{x:10.4f}" for x in row)
        yield f"{'bound on the sd':28s}" + "".join(f"{x:10.2g}" for x in found.bound[ROWS - 1])
        printed_rms = float(np.sqrt(np.mean(np.square(np.array(printed) - found.truth[ROWS - 1]))))
        bound = float(np.sqrt(np.mean(np.square(found.bound))))
        yield (
            f"rms error of the 26 levels over {len(seeds)} realisations: the paper's method {rms[0]:.2g}, "
            f"ours {rms[1]:.2g}, bound {bound:.2g}; the 6 levels printed {printed_rms:.2g}"
        )
        rates = [[best_fit_rate(found.truth, x, h) for h in (slice(0, 13), slice(13, 26))]
                 for x in (found.paper[0], found.ours[0])]
        yield (
            f"BFR (42), loading and unloading: printed 99 and 97.8 % (32 dB), the paper's method {rates[0][0]:.3f} and "
            f"{rates[0][1]:.3f} %, ours {rates[1][0]:.3f} and {rates[1][1]:.3f} %"
        )


# --- how a table of gains and phases is told ------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Part:
    """One block in one table: at which multiples of w1, and what is known there from each side.

    ``limits`` returns the Cramer-Rao bounds on the relative sd of a gain, without a rational form and with one.
    """

    name: str
    w1_hz: float
    orders: Sequence[int]
    printed: dict[int, tuple[float, float]]
    truth: Callable[[int], complex]
    method: dict[int, complex]
    read: Sequence[MeasuredPoint]
    joint: Rational
    limits: Callable[[int], tuple[float | None, float | None]]

    def rows(self) -> Iterator[str]:
        """Tell one row a multiple of w1, and below why some have no measured number."""
        yield (
            f"{self.name:6s}{'truth':>16s}{'printed':>16s}{'paper method':>16s}{'ours, measured':>28s}"
            f"{'ours, joint':>17s}{'bound measured':>16s}{'bound joint':>13s}"
        )
        reasons = []
        for n in self.orders:
            point = harmonic(self.read, n * self.w1_hz)
            shown = self.printed[n][0] * np.exp(1j * self.printed[n][1]) if n in self.printed else None
            joint = complex(frequency_response(self.joint, [n * self.w1_hz])[0]) / self.joint.dc_gain
            texts = "".join(gain_text(value) for value in (self.truth(n), shown, self.method.get(n)))
            measured_limit, joint_limit = (percent(limit) for limit in self.limits(n))
            yield f"{n:<6d}{texts}{point_text(point)} {gain_text(joint)}{measured_limit:>16s}{joint_limit:>13s}"
            if point is not None and point.because:
                reasons.append(f"  no number at {n} w1: {point.because}")
        yield from reasons


def harmonic(points: Sequence[MeasuredPoint], frequency_hz: float) -> MeasuredPoint | None:
    """Return the point of one frequency that comes from harmonics."""
    near = (p for p in points if p.origin == "harmonics" and abs(p.frequency_hz / frequency_hz - 1.0) < 1e-3)
    return next(near, None)


def gain_text(value: complex | None) -> str:
    """Return gain and phase."""
    return f"{'-':>16s}" if value is None else f"{abs(value):9.4f} {np.angle(value):6.3f}"


def point_text(point: MeasuredPoint | None) -> str:
    """Return a measured gain with its standard deviation, and its phase; ``none`` where there is no number."""
    if point is None or point.gain is None:
        return f"{'none':>28s}"
    phase = f"{point.phase_rad.value:7.3f}" if point.phase_rad else f"{'none':>7s}"
    return f"{point.gain.value:9.4f} +-{percent(spread(point)):>9s}{phase}"


def spread(point: MeasuredPoint | None) -> float | None:
    """Return the relative standard deviation of a gain."""
    return None if point is None or point.gain is None else float(np.log(point.gain.high / point.gain.value) / 1.96)


def percent(value: float | None) -> str:
    """Return a share in per cent."""
    return "none" if value is None else f"{100.0 * value:.2g} %"


def by_order(hz: Array, gains: Array, w1_hz: float) -> dict[int, complex]:
    """Return gains by the multiple of w1 they belong to."""
    return {round(f / w1_hz): complex(g) for f, g in zip(hz, gains, strict=True)}


def without_delay(gains: paper.Gains, truth: complex) -> paper.Gains:
    """Return gains of the paper's method after the one delay no data fix is moved onto the truth at w1."""
    delay_s = float(np.angle(truth / gains.g1[0])) / (2.0 * np.pi * gains.g1_hz[0])
    one, two = (np.exp(2j * np.pi * sign * hz * delay_s) for sign, hz in ((1.0, gains.g1_hz), (-1.0, gains.g2_hz)))
    return replace(gains, g1=gains.g1 * one, g2=gains.g2 * two)


def relative_sd(covariance: Array, at: Array, gain: Callable[[Array], complex]) -> float:
    """Return the bound on the relative sd of a gain from the covariance of the values it depends on."""
    rows = [
        (np.log(abs(gain(at + move))) - np.log(abs(gain(at - move)))) / (2.0 * np.sum(move))
        for move in 1e-5 * np.diag(np.abs(at))
    ]
    return float(np.sqrt(np.array(rows) @ covariance @ np.array(rows)))


def inverted(information: Array) -> Array:
    """Return the inverse of a matrix whose values differ by many decades."""
    scale = 1.0 / np.sqrt(np.diag(information))
    return np.asarray(np.linalg.inv(information * np.outer(scale, scale)) * np.outer(scale, scale))


# --- Tables 4 and 5 -----------------------------------------------------------------------------------------------


def steady(made: Experiment, noise_v: float, seed: int = 0) -> tuple[Period, ...]:
    """Return the averaged period of a sine."""
    return periods(made.trace(noise_v, seed), 75.0, noise_v)


def measured_bound(sines: Sequence[Experiment], noise_v: float) -> Measured:
    """Return what the sines would tell without a rational form, as sure as the Cramer-Rao bound allows.

    The curvature of the harmonic equations at the truth; borders as sure as the levels of the staircase make them, the
    delay known.
    """
    clean = [p for made in sines for p in steady(made, 0.0)]
    clean = [replace(p, sd_v=noise_of_lines(p.u.size, p.count, noise_v)) for p in clean]
    slopes, at = level_slopes(Backlash(*TRUTH[2:6])), np.unique([p.played[0] * p.base_hz for p in clean])
    covariance = np.zeros((4 + at.size, 4 + at.size))
    covariance[:4, :4] = np.linalg.inv(slopes.T @ slopes) * noise_v**2 / M
    return measured(clean, Known(rig_file(0.0), at, covariance))


def noise_of_lines(size: int, count: int, noise_v: float) -> Array:
    """Return the sd of the lines of an averaged period under white noise."""
    sd = np.full(size // 2 + 1, noise_v * np.sqrt(2.0 / size / count))
    sd[0] /= np.sqrt(2.0)
    return sd


def simulated_gain(name: str, n: int, values: Array = TRUTH) -> complex:
    """Return G1 or G2 of the simulated rig at n w1."""
    return complex(simulated.response(values, name, np.array([n * W1_HZ]))[0])


@dataclass(frozen=True, eq=False)
class Simulation:
    """The staircase and the sines of the simulated rig, and the information in them for noise of 1 V."""

    stairs: Experiment
    sines: tuple[Experiment, ...]
    information: Array

    @classmethod
    def of(cls, *sines: Experiment) -> "Simulation":
        """Return the simulation with these sines."""
        stairs = walk()
        return cls(stairs, sines, np.asarray(sum(information(made) for made in (stairs, *sines))))

    def parts(self, noise_v: float, seed: int, printed: Sequence[Printed]) -> Iterator[Part]:
        """Return the blocks as each method sees them in one realisation: G1 at the sines, G2 at k w1."""
        traces = [made.trace(noise_v, seed) for made in (self.stairs, *self.sines)]
        borders = paper.borders(paper.table_1(LEVELS, self.stairs.readings(traces[0])))
        seen = [p for made in self.sines for p in steady(made, noise_v, seed)]
        gains = without_delay(paper.table_2(seen, borders, BAND * W1_HZ), simulated_gain("G1", 1))
        found, best = identify(rig_file(), traces), measured_bound(self.sines, noise_v)
        covariance = inverted(self.information) * noise_v**2
        orders = (sorted({round(p.played[0] * p.base_hz / W1_HZ) for p in seen}), range(1, 6))
        for name, method, read, ideal, joint, n, told in zip(
            ("G1", "G2"), ((gains.g1_hz, gains.g1), (gains.g2_hz, gains.g2)), (found.measured.g1, found.measured.g2),
            (best.g1, best.g2), found.blocks, orders, printed, strict=True,
        ):  # fmt: skip
            yield Part(
                name, W1_HZ, n, told, partial(simulated_gain, name), by_order(*method, W1_HZ), read, joint,
                partial(self._limits, name, ideal, covariance),
            )

    def _limits(self, name: str, ideal: Sequence[MeasuredPoint], covariance: Array, n: int) -> Limits:
        best = spread(harmonic(ideal, n * W1_HZ))
        return best, relative_sd(covariance, TRUTH, partial(simulated_gain, name, n))


def tables_4_and_5(seed: int) -> Iterator[str]:
    """Tell Tables 4 and 5; the noise is that of the sine at w1."""
    made = Simulation.of(*(tone(times, 3.5) for times in SINES))
    for decibels, printed in PRINTED_4.items():
        noise_v = made.sines[0].noise_v(decibels)
        tables = made.parts(noise_v, seed, (printed, PRINTED_5[decibels]))
        for title, part in zip(("Table 4: G1(j l w1)", "Table 5: G2(j k w1)"), tables, strict=True):
            yield f"\n{title}, {decibels:g} dB"
            yield from part.rows()
    noise_v = made.sines[0].noise_v(34.45)
    yield "\nThe same amount better spent: 50 periods at w1 with 3.5 V and 50 with 2 V, 34.45 dB"
    for part in Simulation.of(tone(1, 3.5, 50), tone(1, 2.0, 50)).parts(noise_v, seed, ({}, {})):
        yield from part.rows()


# --- Tables 6 and 7 -----------------------------------------------------------------------------------------------


def real_gain(name: str, n: int, values: Array = REAL_TRUTH) -> complex:
    """Return G1 or G2 of the rig of eqs. (46)-(47) at n times 50 Hz."""
    rig = real_rig(values)
    num, den = (rig.g1_num, rig.g1_den) if name == "G1" else (rig.g2_num, rig.g2_den)
    return complex(frequency_response(Rational(num, den), [n * MAINS_HZ])[0])


def real_parts(sines: Sequence[Experiment], seed: int, printed: Sequence[Printed]) -> Iterator[Part]:
    """Return the blocks of the real rig as each method sees them in one realisation with 10 mV of noise."""
    noise_v, stairs = OP_AMP.noise_v, real_walk()
    traces = [made.trace(noise_v, seed) for made in (stairs, *sines)]
    borders = paper.borders(paper.table_1(0.6 * LEVELS, stairs.readings(traces[0])))
    seen = [p for trace in traces[1:] for p in periods(trace, 0.25, noise_v)]
    gains = without_delay(paper.table_2(seen, borders, 4.5 * MAINS_HZ), real_gain("G1", 1))
    found = identify(model_of(toleranced(OP_AMP, seed, 0.1)), traces)
    covariance = inverted(np.asarray(sum(real_information(made) for made in (stairs, *sines)))) * noise_v**2
    orders = (sorted({round(p.played[0] * p.base_hz / MAINS_HZ) for p in seen}), range(1, 5))
    for name, method, read, joint, n, told in zip(
        ("G1", "G2"), ((gains.g1_hz, gains.g1), (gains.g2_hz, gains.g2)), (found.measured.g1, found.measured.g2),
        found.blocks, orders, printed, strict=True,
    ):  # fmt: skip
        yield Part(
            name, MAINS_HZ, n, told, partial(real_gain, name), by_order(*method, MAINS_HZ), read, joint,
            lambda k, name=name, read=read: (
                spread(harmonic(read, k * MAINS_HZ)), relative_sd(covariance, REAL_TRUTH, partial(real_gain, name, k))
            ),
        )  # fmt: skip


def tables_6_and_7(seed: int) -> Iterator[str]:
    """Tell Tables 6 and 7: the rig of eqs. (46)-(47) with 10 mV of noise, U = 10 V at 50, 100 and 250 Hz."""
    sines = [real_tone(times, 10.0) for times in (1, 2, 5)]
    for title, part in zip(("Table 6: G1(j l w1)", "Table 7: G2(j k w1)"),
                           real_parts(sines, seed, (PRINTED_6, PRINTED_7)), strict=True):
        yield f"\n{title} of the rig of eqs. (46)-(47), w1 = 2 pi 50 Hz, U = 10 V, 10 mV of noise"
        yield from part.rows()
    swings = ", ".join(f"{float(np.ptp(made.clean[made.used])):.3g} V" for made in sines)
    yield f"  swing of the settled output without noise at l = 1, 2, 5: {swings}"
    yield "\nThe same amount better spent: 50 periods at 50 Hz with 10 V and 50 with 8.5 V"
    for part in real_parts([real_tone(1, 10.0, 50), real_tone(1, 8.5, 50)], seed, ({}, {})):
        yield from part.rows()


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--realisations", type=int, default=10, help="of Table 3")
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    seeds = range(asked.seed, asked.seed + asked.realisations)
    for line in chain(table_3(seeds), tables_4_and_5(asked.seed), tables_6_and_7(asked.seed)):
        print(line, flush=True)


if __name__ == "__main__":
    main()
