"""What does an answer to six runs of 300,000 samples cost, effect by effect, counted in simulations of the plain model?

    python -m tests.benchmarks.six_runs 132               # seed: a sealed trial's rig and physics, one of every effect
    python -m tests.benchmarks.six_runs 132 saturation

Of what a trial plays (tests/proof/standard.py) the smaller staircase and the medium sine are left out, and the rest is
repeated. Both the answers and the simulations, before each of them, are timed on the processor's clock.
"""

import sys
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tests.proof.ask import asked
from tests.proof.kinds import LIBRARY
from tests.proof.stimuli import Stimulus, repeated
from tests.proof.trial import Key, Trial, drawn

SAMPLES = 300_000
LEFT_OUT = ("staircase_small", "sine_medium")


def six_runs(trial: Trial) -> Trial:
    """Return a trial with six runs to fit, each repeated until there are about ``SAMPLES`` in all."""
    kept = [stimulus for stimulus in trial.training if stimulus.name not in LEFT_OUT]
    once = sum(stimulus.segments[0].stop for stimulus in kept)
    return replace(trial, training=tuple(_repeated(stimulus, round(SAMPLES / once)) for stimulus in kept))


def _repeated(stimulus: Stimulus, repeats: int) -> Stimulus:
    """Return what is played once of a stimulus, so many times over."""
    first = stimulus.segments[0]
    again = repeated(stimulus.name, first.kind, stimulus.u[: first.stop], repeats)
    return replace(again, pause_s=stimulus.pause_s)


def main(arguments: Sequence[str]) -> None:
    """Measure and print."""
    seed, effects = int(arguments[0]), arguments[1:] or sorted({kind.id for kind in LIBRARY})
    costs = []
    for effect in effects:
        trial = six_runs(drawn(Key(seed, "single", effect, 0)))
        reply = asked(trial)
        costs.append((reply.processor_s / reply.simulation_s, reply.processor_s))
        z, names = trial.z[0], ", ".join(found["id"] for found in reply.said.get("effects", []))
        print(
            f"{effect:<24} z {z:6.0f} {reply.samples:7d} samples {costs[-1][1]:6.1f} s {costs[-1][0]:7.0f} simulations "
            f"{reply.said.get('verdict', 'failure')}: {names}", flush=True,
        )  # fmt: skip
    simulations, seconds = np.transpose(costs)
    for what, values in (("simulations", simulations), ("seconds", seconds)):
        print(f"{what}: median {np.median(values):.0f}, most {values.max():.0f}")


if __name__ == "__main__":
    main(sys.argv[1:])
