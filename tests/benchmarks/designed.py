"""Does identification reach the intervals that ``rig design`` promises, on recordings of an independent integrator?

``python -m tests.benchmarks.designed [realisations] [time in s]``

A protocol is designed for the op-amp rig, written and read back; the integrator of tests/proof plays it; identification
starts from a rig file that is 15 % off. Per quantity: the standard error expected of the protocol as written, the rms
error over the realisations of the noise in units of it, and how often the truth lies within 1.96 of it.
"""

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from identify.chain import plain_chain
from identify.coordinate import coordinates_of
from identify.joint import identify
from identify.model import Backlash, Model
from identify.observe import Observation
from identify.planning.information import Expected, information
from identify.planning.quantities import corners_hz, quantities
from identify.trace import Array, Trace
from rig.design import Wish, design
from rig.plan import Plan
from rig.rigfile import model_to_yaml
from tests.proof.bench import answer
from tests.proof.integrator import Grid
from tests.proof.rigs import OP_AMP, Rig
from tests.trials import model_of

FINE = 64  # sub-steps of a sample in the integrator
OFF = 1.15  # of every value of the rig file that identification starts from


@dataclass(frozen=True)
class Reached:
    """One quantity: what was expected, and the errors of every realisation in standard errors."""

    expected: Expected
    errors: Array

    @property
    def ratio(self) -> float:
        """Return the rms error over the expected standard error."""
        return float(np.sqrt(np.mean(np.square(self.errors))))

    @property
    def cover(self) -> float:
        """Return the share of realisations whose expected interval holds the truth."""
        return float(np.mean(np.abs(self.errors) < 1.96))


def planned(model: Model, wish: Wish) -> Plan:
    """Return the protocol that ``rig design`` writes for a model, as it reads back."""
    with TemporaryDirectory() as folder:
        rig = Path(folder) / "rig.yaml"
        rig.write_text(model_to_yaml(model))
        return design(rig, Path(folder) / "best.yaml", wish, lambda sentence, share: None).plan


def reached(rig: Rig, plan: Plan, realisations: int, fine: int = FINE) -> list[Reached]:
    """Return every quantity's expected standard error beside the errors found, seeds 0, 1 ..."""
    model = model_of(rig)
    clean = answer(rig, plan.u, Grid(plan.rate_hz, plan.u.size, fine, 0.0))
    silent = Trace("run", plan.rate_hz, plan.u, clean, steps=plan.steps)
    chain = plain_chain(model)
    coordinates = coordinates_of(chain, chain.values, ["run"])
    seen = Observation(silent, np.ones(silent.size, dtype=bool), rig.noise_v)
    expected = information(chain, coordinates, [seen]).expected()
    found = [_found(model, _noisy(silent, rig.noise_v, seed)) for seed in range(realisations)]
    errors = (np.array(found) - [e.quantity.value for e in expected]) / [e.sd for e in expected]
    return [Reached(e, column) for e, column in zip(expected, errors.T, strict=True)]


def _noisy(trace: Trace, noise_v: float, seed: int) -> Trace:
    noise = np.random.default_rng([seed, 4]).normal(0.0, noise_v, trace.size)
    return replace(trace, y=np.asarray(trace.y) + noise)


def _found(model: Model, trace: Trace) -> list[float]:
    """Return the quantities as identified from a rig file that is off."""
    assert isinstance(model.f, Backlash)
    f = Backlash(model.f.s_l / OFF, model.f.d_l_v * OFF, model.f.s_u / OFF, model.f.d_u_v * OFF)
    g1, g2 = (replace(b, den=(*(a * OFF for a in b.den[:-1]), b.den[-1])) for b in (model.g1, model.g2))
    chain = identify(replace(model, g1=g1, f=f, g2=g2), [trace]).fit.chain
    return [q.value for q in quantities(chain, (), corners_hz(plain_chain(model), trace.rate_hz))]


def main(arguments: list[str]) -> None:
    """Measure and print."""
    realisations = int(arguments[0]) if arguments else 30
    plan = planned(model_of(OP_AMP), Wish(float(arguments[1]) if len(arguments) > 1 else 10.0, 10.0))
    labels = ", ".join(dict.fromkeys(step.label for step in plan.steps))
    print(f"{plan.duration_s:g} s at {plan.rate_hz:g} Hz: {labels}; {realisations} realisations")
    print(f"{'':<18} {'expected sd':>12} {'rms error':>10} {'within 95 %':>12}")
    for row in reached(OP_AMP, plan, realisations):
        print(f"{row.expected.quantity.name:<18} {row.expected.sd:12.3g} {row.ratio:10.3f} {row.cover:12.3f}")


if __name__ == "__main__":
    main(sys.argv[1:])
