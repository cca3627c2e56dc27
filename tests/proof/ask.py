"""What does the tool say of a trial, and what does the asking cost? The only file that meets the product."""

import time
import traceback
from dataclasses import dataclass, field

from identify.chain import plain_chain, simulate
from identify.effects import catalogue
from identify.explain import explain
from identify.trace import Step, Trace
from tests.proof.bench import Playable, Run, record
from tests.trials import model_of


@dataclass(frozen=True)
class Reply:
    """What was said (empty: it failed, and how), wall and processor seconds, and what one simulation costs.

    ``steps`` are the sentences of its progress with the seconds at which they were said.
    """

    said: dict[str, object]
    failure: str
    seconds: float
    processor_s: float
    simulation_s: float
    samples: int
    steps: list[tuple[str, float]] = field(default_factory=list)


def known_effects() -> frozenset[str]:
    """Return the ids of the catalogue as it is installed."""
    return frozenset(catalogue())


def asked(trial: Playable) -> Reply:
    """Record a trial, give the recordings and the rig file to the explainer, and return its reply."""
    runs = record(trial)
    train, test = ([trace_of(run) for run in runs if run.held_out is held] for held in (False, True))
    model = model_of(trial.nominal)
    once_s = min(_simulated(model, train) for _ in range(3))
    steps: list[tuple[str, float]] = []
    said, failure, began, cpu = {}, "", time.perf_counter(), time.process_time()
    try:
        found = explain(model, train, test, lambda s, _: steps.append((s, round(time.perf_counter() - began, 3))))
        said = found.to_dict()
    except Exception:  # a study reports every failure and goes on
        failure = traceback.format_exc(limit=-4)
    return Reply(
        said, failure, round(time.perf_counter() - began, 3), round(time.process_time() - cpu, 3), round(once_s, 5),
        sum(trace.size for trace in train), steps,
    )  # fmt: skip


def _simulated(model: object, traces: list[Trace]) -> float:
    """Return the seconds in which the plain model answers all traces once."""
    chain, began = plain_chain(model), time.perf_counter()
    for trace in traces:
        simulate(chain, trace)
    return time.perf_counter() - began


def trace_of(run: Run) -> Trace:
    """Return a recording of the bench as the product reads it."""
    steps = tuple(Step(s.label, s.kind, s.start, s.stop, s.repeat) for s in run.steps)
    return Trace(run.name, run.rate_hz, run.u, run.y, "held", run.start_s, steps)
