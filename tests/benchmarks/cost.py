"""What do derivatives and a whole identification cost, counted in simulations, and does the cost grow with the samples?

    python -m tests.benchmarks.cost                     # 1 million samples, 7 rounds; then 1e5 1e6 1e7 samples
    python -m tests.benchmarks.cost 2e5 3 1e5 1e6       # samples, rounds; the sizes that are compared

Every count is taken in turns with the simulation it is counted in, on the processor's clock.
"""

import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from identify.chain import Chain, plain_chain, simulate
from identify.derivatives.sensitivities import sensitivities
from identify.joint import identify
from identify.model import Backlash, Model, Rational
from identify.observe import Observation
from identify.simulate import SUBSTEPS
from identify.trace import Trace
from rig.plan import plan
from rig.protocol import read_protocol
from rig.session import shipped
from tests.benchmarks import large_recording
from tests.benchmarks.timing import Timed, ratio_of_rounds, side_by_side
from tests.proof.bench import answer
from tests.proof.integrator import Grid
from tests.proof.rigs import OP_AMP, toleranced
from tests.trials import model_of

# The system the paper simulates (eqs. 40a-40c): three poles and a zero, four borders, three poles and a delay.
PAPER = Model(
    "simulated system of the paper", Rational((0.499, 2.49999), (1.0, 6.5, 8.0, 2.5)),
    Backlash(1.76, 0.36, 1.76, -1.78), Rational((0.08,), (1.0, 1.6, 0.68, 0.08), 5.0),
)  # fmt: skip
RATE_HZ = 20.0
DEFAULT = ("fig13_staircase.yaml", "sine_ladder.yaml")  # protocols of the op-amp rig


@dataclass(frozen=True)
class Derivatives:
    """Durations for one run: simulating it, all of its derivatives, the normal equations made from them."""

    count: int
    samples: int
    simulation: Timed
    jacobian: Timed
    normal: Timed


@dataclass(frozen=True)
class Whole:
    """Durations for the default protocol: simulating it on the samples' grid and as ``rig simulate`` does, and all."""

    samples: int
    simulation: Timed
    fine: Timed
    identification: Timed


def sizes(chain: Chain) -> dict[str, float]:
    """Return the size of every parameter of a chain."""
    return {p.name: abs(chain.values[p.name]) or p.scale for p in chain.parameters()}


def derivatives(samples: int, rounds: int) -> Derivatives:
    """Time the derivatives of the paper's system by all of its parameters."""
    t = np.arange(samples) / RATE_HZ
    u = 3.0 * np.sin(0.2 * t) + 2.0 * np.sin(0.77 * t)
    chain, trace = plain_chain(PAPER), Trace("run", RATE_HZ, u, np.zeros(samples))
    seen, asked = Observation(trace, np.ones(samples, dtype=bool), 0.07), sizes(chain)
    timed = side_by_side(
        [
            ("simulation", lambda: simulate(chain, trace)),
            ("Jacobian", lambda: [None for _ in sensitivities(chain, asked, seen).chunks]),
            ("normal equations", lambda: sensitivities(chain, asked, seen).normal()),
        ],
        rounds, time.process_time,
    )  # fmt: skip
    return Derivatives(len(asked), samples, *timed)


def recordings(protocols: Sequence[str]) -> list[Trace]:
    """Return what the independent integrator answers to protocols on a rig whose parts are off by up to 3 %."""
    rig, found = toleranced(OP_AMP, 3, 0.03), []
    for seed, name in enumerate(protocols):
        played = plan(read_protocol(shipped(name)))
        clean = answer(rig, played.u, Grid(played.rate_hz, played.u.size, 32, 0.0), (), seed)
        y = clean + rig.noise_v * np.random.default_rng(seed).standard_normal(clean.size)
        found.append(Trace(name, played.rate_hz, played.u, y, steps=played.steps))
    return found


def whole(protocols: Sequence[str], rounds: int) -> Whole:
    """Time the identification of recordings of the op-amp rig from its rig file's values."""
    traces, model = recordings(protocols), model_of(OP_AMP)
    chain = plain_chain(model)
    timed = side_by_side(
        [
            ("simulation", lambda: [simulate(chain, trace) for trace in traces]),
            ("rig simulate", lambda: [simulate(chain, trace, SUBSTEPS) for trace in traces]),
            ("identification", lambda: identify(model, traces)),
        ],
        rounds, time.process_time,
    )  # fmt: skip
    return Whole(sum(trace.size for trace in traces), *timed)


def in_simulations(found: Derivatives, all_of_it: Whole) -> str:
    """Return the counts as a table."""
    lines = [
        f"{found.samples} samples of the paper's system, {found.count} parameters, least of "
        f"{len(found.simulation.seconds)} rounds",
        *(
            f"  {t.name:<17} {1e9 * t.least / found.samples:7.1f} ns a sample "
            f"{ratio_of_rounds(t, found.simulation):7.2f} simulations"
            for t in (found.simulation, found.jacobian, found.normal)
        ),
        f"{all_of_it.samples} samples of the default protocol",
        *(
            f"  {t.name:<17} {1e3 * t.least:7.1f} ms {ratio_of_rounds(t, all_of_it.simulation):7.1f} simulations "
            f"{ratio_of_rounds(t, all_of_it.fine):7.1f} as rig simulate does them"
            for t in (all_of_it.simulation, all_of_it.fine, all_of_it.identification)
        ),
    ]
    return "\n".join(lines)


def growth(samples: int) -> str:
    """Return time and memory for a run of that many samples: derivatives here, ``rig identify`` in its own process."""
    found = derivatives(samples, 1)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.h5"
        large_recording.record(path, samples)
        identified = large_recording.identified(path)
    times = (found.simulation.least, found.normal.least, identified.seconds)
    return f"{samples:10d} {times[0]:13.3f} {times[1]:18.3f} {times[2]:14.1f} {identified.peak_bytes / 1e6:9.0f}"


def main(arguments: list[str]) -> None:
    """Measure and print."""
    samples = int(float(arguments[0])) if arguments else 1_000_000
    rounds = int(arguments[1]) if len(arguments) > 1 else 7
    with threadpool_limits(1, "blas"):
        print(in_simulations(derivatives(samples, rounds), whole(DEFAULT, rounds)), flush=True)
        print(f"{'samples':>10} {'simulation s':>13} {'normal equations s':>18} {'rig identify s':>14} {'peak MB':>9}")
        for size in arguments[2:] or ["1e5", "1e6", "1e7"]:
            print(growth(int(float(size))), flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
