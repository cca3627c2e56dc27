"""What does the tool say of a trial, and what does the asking cost? The only file that meets the product."""

import signal
import time
import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from types import FrameType

from identify.chain import plain_chain, simulate
from identify.effects import catalogue
from identify.explain import explain
from identify.model import Model
from identify.readings import blemishes
from identify.trace import Step, Trace
from tests.proof.bench import Playable, Run, record
from tests.trials import model_of

MOST_S = 150.0  # of processor time: an answer that takes longer is none


@dataclass(frozen=True)
class Reply:
    """What was said (empty: it failed, and how), wall and processor seconds, and what one simulation costs.

    ``steps`` are the sentences of its progress with the processor seconds at which they were said.
    """

    said: dict[str, object]
    failure: str
    seconds: float
    processor_s: float
    simulation_s: float
    samples: int
    steps: list[tuple[str, float]] = field(default_factory=list)


def known_effects() -> frozenset[str]:
    """Return the ids of what can be named, as it is installed: effects on the chain and blemishes of readings."""
    return frozenset(catalogue()) | frozenset(blemishes())


def exact_twins() -> dict[str, tuple[str, ...]]:
    """Return, for every id of the catalogue, the ids that give the same data exactly, as the catalogue has it."""
    return {name: tuple(c.id for c in kind.confused_with if c.exact) for name, kind in catalogue().items()}


def parted(runs: Sequence[Run]) -> tuple[list[Trace], list[Trace]]:
    """Return the recordings to be fitted and those to be held out."""
    train, test = ([trace_of(run) for run in runs if run.held_out is held] for held in (False, True))
    return train, test


def asked(trial: Playable) -> Reply:
    """Record a trial, give the recordings and the rig file to the explainer, and return its reply."""
    train, test = parted(record(trial))
    model = model_of(trial.nominal)
    once_s = min(_simulated(model, train) for _ in range(3))
    steps: list[tuple[str, float]] = []
    said, failure, began, cpu = {}, "", time.perf_counter(), time.process_time()

    def note(sentence: str, _share: float) -> None:
        steps.append((sentence, round(time.process_time() - cpu, 3)))

    try:
        with limited(MOST_S):
            said = explain(model, train, test, note).to_dict()
    except Exception:  # a study reports every failure and goes on
        failure = traceback.format_exc(limit=-4)
    seconds, processor_s = time.perf_counter() - began, time.process_time() - cpu
    samples = sum(trace.size for trace in train)
    return Reply(said, failure, round(seconds, 3), round(processor_s, 3), round(once_s, 5), samples, steps)


@contextmanager
def limited(processor_s: float) -> Iterator[None]:
    """Raise TimeoutError where what runs inside takes more processor time; only in the main thread of a process."""

    def stop(_number: int, _frame: FrameType | None) -> None:
        raise TimeoutError(f"no answer within {processor_s:g} s of processor time")

    before = signal.signal(signal.SIGVTALRM, stop)
    signal.setitimer(signal.ITIMER_VIRTUAL, processor_s)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.signal(signal.SIGVTALRM, before)


def _simulated(model: Model, traces: list[Trace]) -> float:
    """Return the processor seconds in which the plain model answers all traces once, on the grid of the samples."""
    chain, began = plain_chain(model), time.process_time()
    for trace in traces:
        simulate(chain, trace)
    return time.process_time() - began


def trace_of(run: Run) -> Trace:
    """Return a recording of the bench as the product reads it."""
    steps = tuple(Step(s.label, s.kind, s.start, s.stop, s.repeat) for s in run.steps)
    return Trace(run.name, run.rate_hz, run.u, run.y, "held", run.start_s, steps)
