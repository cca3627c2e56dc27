"""Do estimates scatter as little as the Cramer-Rao bound allows, and do 95 % intervals hold the truth 95 times in 100?

``python -m tests.benchmarks.efficiency [--realisations 300] [--decibels 32 11 10] [--first 0] [--keep FOLDER]``

The paper's simulation (eqs. 40a-c; its staircase and its sines) is answered once by the integrator of tests/proof; only
the noise differs between realisations. The bound comes from the integrator's sensitivities at the truth, never from the
fit. Both figures scatter: over 300 realisations rms / bound by 1 / sqrt(600) = 4 %, coverage by 1.3 %.
"""

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from identify.identification import Identification
from identify.interval import Interval
from identify.joint import identify
from identify.trace import Array, Step, Trace
from rig.plan import Plan, plan
from rig.protocol import read_protocol
from tests.benchmarks.paper_experiments import rig_file
from tests.proof import paper_simulation as paper
from tests.proof.paper_simulation import G1_GAIN, G2_GAIN, NAMES, TRUTH, Played

STIMULI = ("staircase", "sines")
SUBSTEPS = {"staircase": 32, "sines": 128}  # of the integrator: halving them moves no answer by 1e-3 of the bound
HELP = 0.05  # share of its bound that a rough idea of the rig may take off an identifiable quantity
DIFFERENCE = 1e-5


@dataclass(frozen=True)
class Experiment:
    """What was played, what a bench without noise would read, and the information in it on the rig's values."""

    plans: tuple[Plan, ...]
    clean: tuple[Array, ...]
    information: Array

    @property
    def power(self) -> float:
        """Return the signal power of eq. (41), V^2: that of the staircase."""
        return float(np.mean(np.square(self.clean[0])))

    def noise_v(self, decibels: float) -> float:
        """Return the noise of one reading at a signal-to-noise ratio."""
        return float(np.sqrt(self.power / 10.0 ** (decibels / 10.0)))


def experiment(cut: float = 1.0, coarser: int = 1) -> Experiment:
    """Return the paper's simulation; ``cut`` keeps that share of every sine, ``coarser`` divides the sub-steps."""
    plans = tuple(_cut(_planned(name), cut if name == "sines" else 1.0) for name in STIMULI)
    played = tuple(Played(p.u, p.rate_hz, SUBSTEPS[name] // coarser) for name, p in zip(STIMULI, plans, strict=True))
    coarse = tuple(replace(p, substeps=p.substeps // 2) for p in played)
    return Experiment(plans, tuple(paper.answer(TRUTH, p) for p in played), paper.information(coarse))


def _planned(name: str) -> Plan:
    protocol = read_protocol(f"protocols/paper_simulation_{name}.yaml")
    return plan(protocol, protocol.rate_hz)


def _cut(whole: Plan, share: float) -> Plan:
    """Return a plan whose steps keep a share of their samples; 100 and 50 periods stay whole numbers of periods."""
    if share == 1.0:
        return whole
    u, steps = [], []
    for step in whole.steps:
        size = round(share * (step.stop - step.start))
        first = sum(part.size for part in u)
        steps.append(replace(step, start=first, stop=first + size))
        u.append(whole.u[step.start : step.start + size])
    return replace(whole, u=np.concatenate(u), steps=tuple(steps))


def traces(made: Experiment, noise_v: float, seed: int) -> tuple[Trace, ...]:
    """Return the recordings of one realisation."""
    rng = np.random.default_rng([seed, 401])
    return tuple(
        Trace(name, p.rate_hz, p.u, x + rng.normal(0.0, noise_v, x.size),
              steps=tuple(Step(s.label, s.kind, s.start, s.stop, s.repeat) for s in p.steps))
        for name, p, x in zip(STIMULI, made.plans, made.clean, strict=True)
    )  # fmt: skip


def told(found: Identification) -> dict[str, Interval]:
    """Return every quantity of an answer by name."""
    assert found.certainty is not None
    quantities = dict(found.borders)
    for name, points in (("G1", found.g1), ("G2", found.g2)):
        for point in points:
            quantities[f"|{name}| at {point.frequency_hz:.4g} Hz"] = point.gain
            quantities[f"arg {name} at {point.frequency_hz:.4g} Hz"] = point.phase_rad
    linear = [name for name in NAMES if not name.startswith("F.")]
    return quantities | {name: found.certainty.interval(name) for name in linear}


def true(values: Array, names: Sequence[str]) -> Array:
    """Return the quantities ``names`` of a rig, in closed form."""
    return np.array([_true(values, name) for name in names])


def _true(values: Array, name: str) -> float:
    if name in NAMES:
        return float(values[NAMES.index(name)])
    if f"F.{name}" in NAMES:  # V_p = G1(0): this G1 does not overshoot
        value = float(values[NAMES.index(f"F.{name}")])
        return value * G1_GAIN * G2_GAIN if name.startswith("S") else value / G1_GAIN
    kind, at = name.split(" at ")
    block, hz = kind[-3:].strip("|").split()[-1], float(at.split()[0])
    steps = np.linspace(0.0, hz, 400)  # the phase is followed from 0 Hz on
    response = paper.response(values, block, steps)
    return float(np.abs(response[-1]) if kind.startswith("|") else np.unwrap(np.angle(response))[-1])


def bounds(made: Experiment, names: Sequence[str], noise_v: float, known: bool = False) -> Array:
    """Return the Cramer-Rao bound on the sd of every quantity.

    ``known`` adds what a rig file says of any rig: the coefficients of its blocks and its dead time to a factor of e.
    """
    rows = np.array([
        (true(TRUTH + step, names) - true(TRUTH - step, names)) / (2.0 * np.sum(step))
        for step in DIFFERENCE * np.diag(np.abs(TRUTH))
    ])  # fmt: skip
    blocks = np.array([not name.startswith("F.") for name in NAMES])
    information = made.information / noise_v**2 + np.diag(known * blocks / np.square(TRUTH))
    scale = 1.0 / np.sqrt(np.diag(information))
    inverse = np.linalg.inv(information * np.outer(scale, scale)) * np.outer(scale, scale)
    return np.asarray(np.sqrt(np.einsum("iq,ij,jq->q", rows, inverse, rows)))


@dataclass(frozen=True)
class Measured:
    """What came out of several realisations for one quantity."""

    name: str
    value: float
    bound: float
    helped: float
    ratio: float
    bias: float
    coverage: float

    @property
    def identifiable(self) -> bool:
        """Return whether the data alone tell the quantity: knowing the order of magnitude of values helps little."""
        return self.helped > (1.0 - HELP) * self.bound


def realised(made: Experiment, noise_v: float, seeds: Sequence[int]) -> Iterator[dict[str, Interval]]:
    """Yield the quantities of one realisation after the other."""
    for seed in seeds:
        yield told(identify(rig_file(), traces(made, noise_v, seed)))


def measured(made: Experiment, noise_v: float, answers: Sequence[dict[str, Interval]]) -> list[Measured]:
    """Return rms over bound, bias over bound, and coverage of every quantity."""
    names = list(answers[0])
    truth, bound, helped = true(TRUTH, names), bounds(made, names, noise_v), bounds(made, names, noise_v, known=True)
    values = np.array([[answer[name].value for name in names] for answer in answers])
    covered = [[a[n].low <= t <= a[n].high for n, t in zip(names, truth, strict=True)] for a in answers]
    ratio = np.sqrt(np.mean(np.square(values - truth), axis=0)) / bound
    bias = (np.mean(values, axis=0) - truth) / bound
    rows = zip(names, truth, bound, helped, ratio, bias, np.mean(covered, axis=0), strict=True)
    return [Measured(name, *map(float, row)) for name, *row in rows]


def table(found: Sequence[Measured]) -> Iterator[str]:
    """Tell every quantity in a line, last those that the data alone do not tell."""
    yield f"{'quantity':24s} {'truth':>10s} {'bound':>10s} {'rms/bound':>9s} {'bias/bound':>10s} {'coverage':>8s}"
    for m in sorted(found, key=lambda m: not m.identifiable):
        mark = "" if m.identifiable else f"  not told by the data alone: a rough idea leaves {m.helped / m.bound:.2f}"
        figures = f"{m.value:10.4g} {m.bound:10.3g} {m.ratio:9.3f} {m.bias:10.2f} {100.0 * m.coverage:6.1f} %"
        yield f"{m.name:24s} {figures}{mark}"


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--realisations", type=int, default=300)
    parser.add_argument("--decibels", type=float, nargs="*", default=[32.0, 11.0, 10.0])
    parser.add_argument("--first", type=int, default=0, help="seed of the first realisation")
    parser.add_argument("--keep", type=Path, help="a folder for the answers, as .npz")
    asked = parser.parse_args()
    made, seeds = experiment(), range(asked.first, asked.first + asked.realisations)
    by = 100.0 / np.sqrt(2.0 * len(seeds)), 100.0 * np.sqrt(0.95 * 0.05 / len(seeds))
    print(f"{len(seeds)} realisations: rms/bound scatters by {by[0]:.1f} %, coverage by {by[1]:.1f} %")
    for decibels in asked.decibels:
        noise_v = made.noise_v(decibels)
        answers = list(realised(made, noise_v, seeds))
        if asked.keep:
            rows = {name: [[a[name].value, a[name].low, a[name].high] for a in answers] for name in answers[0]}
            np.savez(asked.keep / f"efficiency_{decibels:g}dB.npz", **{k: np.array(v) for k, v in rows.items()})
        print(f"\n{decibels:g} dB, noise {noise_v:.4g} V")
        print("\n".join(table(measured(made, noise_v, answers))), flush=True)


if __name__ == "__main__":
    main()
