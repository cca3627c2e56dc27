"""Is it told that readings come before the rig could answer, and of nothing else?"""

from dataclasses import replace

import numpy as np
import pytest

from identify.explain.bench import Bench
from identify.explain.explain import explain
from identify.explain.hypothesis import Hypothesis
from identify.explain.out_of_step import told_early
from identify.explain.plain import prepared
from identify.holdout import split
from identify.trace import Trace
from tests.proof.cases import Concealed
from tests.proof.rigs import RC
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, recorded

NOISE_V = 0.01
STAIRS, SINE = staircase("stairs", FIG13_LEVELS_V, 0.05, 1), sine("sine", 10.0, 3.4, 10, 1)
MODEL = model_of(replace(RC, d_l_v=1.3, d_u_v=-1.2, s_l=7.8))


def played(*physics: Concealed) -> list[Trace]:
    return [recorded(RC, stimulus, physics, NOISE_V, i) for i, stimulus in enumerate((STAIRS, SINE))]


def early(trace: Trace, samples: int) -> Trace:
    return replace(trace, y=np.concatenate((trace.y[samples:], trace.y[trace.size - samples :])))


def fitted(traces: list[Trace]) -> tuple[Bench, Hypothesis]:
    return prepared(MODEL, split(MODEL, traces[:1], traces[1:]))


@pytest.mark.parametrize("samples", [1, 2, 3, 5, 23, 50])
def test_readings_that_come_early_are_told_by_how_much(samples: int) -> None:
    (told,) = told_early(*fitted([early(trace, samples) for trace in played()]))
    assert told.startswith(f"with the readings {samples} sample{'s' if samples > 1 else ''} (")
    assert "out of step" in told


@pytest.mark.parametrize(
    "physics",
    [(Concealed("dead_time", {"delay": 1e-3}),), (Concealed("saturation", {"upper": 9.0, "lower": -9.0}),), ()],
    ids=["late", "rails", "nothing"],
)
def test_what_no_later_reading_mends_is_not_told_so(physics: tuple[Concealed, ...]) -> None:
    assert told_early(*fitted(played(*physics))) == ()


@pytest.mark.parametrize("last", [20, 60, 200])
def test_what_is_wrong_with_the_end_of_a_run_alone_is_not_told_so(last: int) -> None:
    """Later readings move it out of the run, and nothing else."""

    def hit(trace: Trace) -> Trace:
        at = np.arange(trace.size)
        return replace(trace, y=trace.y + np.where(at >= trace.size - last, 90.0 * np.sin(at), 0.0))

    traces = [hit(trace) for trace in played()]
    bench, plain = fitted(traces)
    assert plain.misfit > 1.0
    assert told_early(bench, plain) == ()


def test_an_answer_without_a_name_says_it() -> None:
    traces = [early(trace, 1) for trace in played()]
    answer = explain(MODEL, traces[:1], traces[1:])
    assert answer.verdict == "unexplained"
    assert answer.warnings[0].startswith("with the readings 1 sample (100 µs) later nothing would be missing")
