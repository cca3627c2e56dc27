"""How often does the identification end at the truth, from a rig file that is wrong in every value, or has none?

``python -m tests.benchmarks.random_rigs [--rigs 300] [--seed 0] [--first 0] [--no-values]``
"""

import argparse
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import permutations

import numpy as np
from scipy.stats import chi2, norm

from identify.blocks import LinearBlock
from identify.chain import plain_chain
from identify.fit import chi_squared
from identify.identification import FrequencyPoint, Identification
from identify.interval import Interval
from identify.joint import identify
from identify.model import Backlash, Model, Rational
from identify.trace import Step, Trace
from tests.proof.random_rigs import Bench, Block, RandomRig, drawn, response
from tests.proof.stimuli import Segment

SIGMAS = 3.0
BEYOND = float(2.0 * norm.sf(SIGMAS))  # share of a normal beyond 3 standard deviations


@dataclass(frozen=True)
class Outcome:
    """How one rig ended: quantities off by their standard errors, and the distance of all parameters together.

    ``distance`` is twice the log-likelihood ratio of estimate and truth, the Mahalanobis distance without its
    linearisation; ``limit`` is what a chi-square of as many parameters exceeds as often as a normal does 3 sigma.
    ``said`` are the warnings of the answer (None: it was refused).
    """

    number: int
    what: str
    off: dict[str, float]
    distance: float
    mahalanobis: float
    limit: float
    over_noise: float
    said: tuple[str, ...]
    seconds: float

    @property
    def at_truth(self) -> bool:
        """Return whether all parameters together lie within the 3-sigma region around the truth."""
        return abs(self.distance) <= self.limit

    @property
    def within(self) -> bool:
        """Return whether every single quantity lies within 3 standard errors of the truth."""
        return all(abs(z) <= SIGMAS for z in self.off.values())

    def line(self) -> str:
        """Return the rig in one line."""
        worst = max(self.off, key=lambda name: abs(self.off[name]), default="nothing told")
        z = self.off.get(worst, float("nan"))
        state = "ok  " if self.at_truth else "SAID" if self.said else "MUTE"
        return (
            f"{self.number:4d} {state} {self.what:34s} distance {self.distance:10.1f} (linear {self.mahalanobis:9.1f}, "
            f"limit {self.limit:.1f})  worst {z:+.1f} SE {worst:22s} rms/noise {self.over_noise:.3f} "
            f"{self.seconds:5.1f} s  {'; '.join(self.said)[:150]}"
        )


def traces_of(bench: Bench) -> list[Trace]:
    """Return the recordings in the product's form."""
    return [
        Trace(s.name, s.rate_hz, s.u, y, steps=tuple(map(_step, s.segments)))
        for s, y in zip(bench.stimuli, bench.readings, strict=True)
    ]


def _step(segment: Segment) -> Step:
    return Step(segment.label, segment.kind, segment.start, segment.stop, segment.repeat)


def model_of(rig: RandomRig) -> Model:
    """Return the product's model with the values of ``rig``."""
    return Model(
        "random", Rational(rig.g1.num, rig.g1.den), Backlash(rig.s_l, rig.d_l_v, rig.s_u, rig.d_u_v),
        Rational(rig.g2.num, rig.g2.den, rig.delay_s),
    )  # fmt: skip


def without_values(model: Model) -> Model:
    """Return a model of which only the orders are known, and whether there is a dead time."""
    g1, g2 = (Rational((1.0,) * len(b.num), (1.0,) * len(b.den), b.dead_time_s) for b in (model.g1, model.g2))
    late = ("G2.dead_time",) if g2.dead_time_s > 0.0 else ()
    unknown = ("G1", "F", "G2", "G2.gain", *late)
    return replace(model, g1=g1, f=Backlash(1.0, 1.0, 1.0, -1.0), g2=g2, unknown=unknown)


def outcome(seed: int, number: int, values: bool = True) -> Outcome:
    """Return how the identification of one rig ends, from its file's wrong values or from its orders alone."""
    bench = drawn(seed, number)
    told = model_of(bench.nominal) if values else without_values(model_of(bench.nominal))
    began = time.perf_counter()
    try:
        found = identify(told, traces_of(bench))
    except ValueError as error:
        return Outcome(number, _what(bench.rig), {}, float("inf"), float("inf"), 0.0, float("inf"), (str(error),),
                       time.perf_counter() - began)
    seconds = time.perf_counter() - began
    distance, linear = distances(bench, found)
    limit = float(chi2.isf(BEYOND, len(found.fit.coordinates)))
    return Outcome(number, _what(bench.rig), _off(bench.rig, found), distance, linear, limit,
                   found.rms_v / bench.rig.noise_v, _said(found), seconds)


def _said(found: Identification) -> tuple[str, ...]:
    """Return the warnings that speak of the fit, not of the protocol."""
    asked = {advice.sentence for advice in found.advice}
    return tuple(sentence for sentence in found.warnings if sentence not in asked)


def _what(rig: RandomRig) -> str:
    """Return the structure of a rig in a few words."""
    def block(b: Block) -> str:
        ringing = "~" if np.any(np.abs(np.roots(b.den).imag) > 0.0) else ""
        return f"{len(b.den) - 1}{ringing}{'z' if len(b.num) > 1 else ''}{'-' if b.num[-1] < 0.0 else ''}"

    rest = f"{' skewed' if rig.s_l != rig.s_u else ''}{' late' if rig.delay_s else ''}"
    return f"G1 {block(rig.g1)} G2 {block(rig.g2)}{rest}"


def _off(rig: RandomRig, found: Identification) -> dict[str, float]:
    """Return every identifiable quantity's error in standard errors, in the scale of the rig file's DC gains."""
    true = _in_scale_of(rig, found.model).f
    assert isinstance(true, Backlash)
    truth = {"S_L": true.s_l, "D_L": true.d_l_v, "S_U": true.s_u, "D_U": true.d_u_v}
    off = {n: _errors(i, truth[n]) for n, i in found.own_scale.items()}
    for name, block, fitted, points in (
        ("G1", (rig.g1, 0.0), found.model.g1, found.own_points.g1),
        ("G2", (rig.g2, rig.delay_s), found.model.g2, found.own_points.g2),
    ):
        for point in points:
            off |= _off_at(name, block, fitted.dc_gain, point)
    return {**off, "delay": _errors(found.delay, rig.delay_s)} if rig.delay_s > 0.0 else off


def _errors(interval: Interval, truth: float) -> float:
    """Return how many standard errors a value is off."""
    return (interval.value - truth) / ((interval.high - interval.low) / (2 * 1.96))


def _off_at(name: str, truth: tuple[Block, float], dc_gain: float, point: FrequencyPoint) -> dict[str, float]:
    """Return the errors of gain and phase at one frequency, both over those at 0 Hz, in standard errors."""
    block, delay_s = truth
    omega, gain, phase = 2.0 * np.pi * point.frequency_hz, point.gain, point.phase_rad
    true = response(block, omega) / response(block, 0.0) * np.exp(-1j * omega * delay_s)
    turn = phase.value - float(np.angle(true)) - (np.pi if dc_gain < 0.0 else 0.0)
    sds = (np.log(gain.high / gain.low) / (2 * 1.96), (phase.high - phase.low) / (2 * 1.96))
    return {
        f"abs({name}) at {point.frequency_hz:.4g} Hz": float(np.log(gain.value / abs(dc_gain * true)) / sds[0]),
        f"arg({name}) at {point.frequency_hz:.4g} Hz": float(((turn + np.pi) % (2.0 * np.pi) - np.pi) / sds[1]),
    }


def distances(bench: Bench, found: Identification) -> tuple[float, float]:
    """Return twice the log-likelihood ratio of estimate and truth, and the Mahalanobis distance between them."""
    true = plain_chain(_in_scale_of(bench.rig, found.model))
    observations = [replace(o, substeps=8, noise_v=bench.rig.noise_v, left_out=None) for o in found.observations]
    ratio = sum(chi_squared(true, o) - chi_squared(found.fit.chain, o) for o in observations)
    options = [dict(true.values)]
    for name in ("G1", "G2"):
        stage = next(s for s in true.stages if isinstance(s, LinearBlock) and s.name == name)
        names = [p.name for p in stage.parameters()]
        options = [{**o, **dict(zip(names, v, strict=False))} for o in options for v in _sectioned(stage.start.den)]
    inverse = np.linalg.pinv(found.fit.covariance, hermitian=True)
    gaps = (
        np.array([c.theta(values[c.name]) - t for c, t in zip(found.fit.coordinates, found.fit.theta, strict=True)])
        for values in options
    )
    return float(ratio), min(float(gap @ inverse @ gap) for gap in gaps)


def _in_scale_of(rig: RandomRig, model: Model) -> Model:
    """Return the true rig with the DC gains of ``model``, which F makes up for."""
    true = model_of(rig)
    one, two = (m.dc_gain / t.dc_gain for m, t in ((model.g1, true.g1), (model.g2, true.g2)))
    slope, crossing = 1.0 / (one * two), one
    f = Backlash(rig.s_l * slope, rig.d_l_v * crossing, rig.s_u * slope, rig.d_u_v * crossing)
    if crossing < 0.0:  # both gains of the other sign: the borders change places
        f = Backlash(f.s_u, f.d_u_v, f.s_l, f.d_l_v)
    blocks = [replace(t, num=tuple(g * b for b in t.num)) for g, t in ((one, true.g1), (two, true.g2))]
    return replace(true, g1=blocks[0], f=f, g2=blocks[1])


def _sectioned(den: Sequence[float]) -> list[tuple[float, ...]]:
    """Return the values of every way to write a denominator in sections."""
    found = []
    for order in set(permutations(np.roots(den).tolist())):
        pairs = [order[i : i + 2] for i in range(0, len(order), 2)]
        parts = [np.poly(pair) for pair in pairs]
        if all(np.max(np.abs(np.imag(part))) < 1e-9 * np.max(np.abs(part)) for part in parts):
            found.append(tuple(float(v) for part in parts for v in np.real(part / part[-1])[:-1]))
    return found


def summary(outcomes: Sequence[Outcome]) -> str:
    """Return the shares, and every failure."""
    told, seconds = [o for o in outcomes if o.off], [o.seconds for o in outcomes]
    zs = np.array([z for o in told for z in o.off.values()])
    failed = [o for o in outcomes if not o.at_truth]
    lines = [
        f"rigs: {len(outcomes)}; refused {len(outcomes) - len(told)}",
        f"all parameters together within 3 sigma of the truth: {len(outcomes) - len(failed)} of {len(outcomes)} "
        f"({100.0 * (1.0 - len(failed) / len(outcomes)):.1f} %)",
        f"the rest say that they failed: {sum(bool(o.said) for o in failed)} of {len(failed)}",
        f"linear Mahalanobis distance within the limit: {sum(o.mahalanobis <= o.limit for o in told)}",
        f"single quantities within 3 standard errors: {np.mean(np.abs(zs) <= SIGMAS):.4%} of {zs.size}; "
        f"rigs with all of theirs: {sum(o.within for o in told)}",
        f"rigs at the truth that warn all the same: {sum(o.at_truth and bool(o.said) for o in outcomes)}",
        f"seconds a rig: median {np.median(seconds):.2f}, most {max(seconds):.1f}",
    ]
    return "\n".join([*lines, *(o.line() for o in failed)])


def main(arguments: Sequence[str]) -> None:
    """Print a line for every rig, then the summary."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rigs", type=int, default=300)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--no-values", action="store_true")
    chosen = parser.parse_args(arguments)
    outcomes = []
    for number in range(chosen.first, chosen.first + chosen.rigs):
        outcomes.append(outcome(chosen.seed, number, not chosen.no_values))
        print(outcomes[-1].line(), flush=True)
    print(summary(outcomes))


if __name__ == "__main__":
    main(sys.argv[1:])
