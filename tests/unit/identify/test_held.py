"""Is a level that F holds from before a run told, and does it spoil no answer?"""

from dataclasses import replace

import numpy as np
import pytest

from identify.explain.explain import explain
from identify.held import held_v, told_held
from identify.holdout import counted
from identify.joint import identify
from identify.model import LinearF
from identify.trace import Trace
from tests.proof.cases import Concealed
from tests.proof.rigs import LINEAR, RC
from tests.proof.stimuli import FIG13_LEVELS_V, Stimulus, sine, staircase
from tests.trials import model_of, recorded

NOISE_V = 0.01
STAIRS, SINE = staircase("stairs", FIG13_LEVELS_V, 0.05, 1), sine("sine", 10.0, 3.4, 10, 1)
BEFORE = 4000  # samples: up, and at rest again
MODEL = model_of(replace(RC, d_l_v=1.3, d_u_v=-1.2, s_l=7.8))


def after(stimulus: Stimulus, level_v: float, *physics: Concealed, seed: int = 1) -> Trace:
    """Return a run that begins when another has left w at a level, V."""
    left = np.repeat([np.sign(level_v) * (abs(level_v) / RC.s_l + RC.d_l_v), 0.0], BEFORE // 2)
    whole = recorded(RC, Stimulus("both", np.concatenate([left, stimulus.u]), ()), physics, NOISE_V, seed)
    return Trace(stimulus.name, whole.rate_hz, whole.u[BEFORE:], whole.y[BEFORE:])


@pytest.mark.parametrize("stimulus", [STAIRS, SINE], ids=lambda s: s.name)
@pytest.mark.parametrize("level_v", [0.05, 2.0, 9.9, -9.9])
def test_a_level_that_is_held_is_read_and_what_it_changes_does_not_count(stimulus: Stimulus, level_v: float) -> None:
    trace = after(stimulus, level_v)
    found_v, samples = held_v(trace, MODEL, NOISE_V)
    assert found_v == pytest.approx(level_v, abs=0.03)
    use = counted(trace, MODEL, NOISE_V)
    fresh = recorded(RC, stimulus, (), 0.0)
    assert np.max(np.abs(trace.y - fresh.y)[use]) < 5.0 * NOISE_V
    assert samples <= int(np.argmax(use)) < trace.size // 2
    assert "held from before" in told_held([trace, trace], MODEL, NOISE_V)[0]
    assert len(told_held([trace, trace], MODEL, NOISE_V)) == 1


@pytest.mark.parametrize("level_v", [2.0, 10.0, -10.0])
def test_runs_that_follow_others_lack_nothing(level_v: float) -> None:
    """Without a word for it, an offset that depends on how far the signal ever went was told, at the reading."""
    traces = [after(stimulus, level_v, seed=i) for i, stimulus in enumerate((STAIRS, SINE))]
    answer = explain(MODEL, traces[:1], traces[1:])
    assert answer.verdict == "consistent"
    assert [warning.partition(":")[0] for warning in answer.warnings] == ["stairs", "sine"]
    found = identify(MODEL, traces)
    assert found.rms_v < 1.02 * NOISE_V
    assert found.fit.chain.values["F.D_L"] == pytest.approx(1.25, abs=1e-3)


def test_physics_is_found_in_a_run_that_follows_another() -> None:
    late = Concealed("dead_time", {"delay": 1e-3})
    answer = explain(MODEL, [after(STAIRS, 2.0, late)], [after(SINE, 2.0, late)])
    assert (answer.verdict, [effect.id for effect in answer.effects]) == ("explained", ["dead_time"])


@pytest.mark.parametrize(
    ("trace", "model"),
    [
        (recorded(RC, STAIRS, (), NOISE_V, 1), MODEL),
        (recorded(RC, STAIRS, (Concealed("feedthrough", {"k": 0.02}),), NOISE_V, 1), MODEL),
        (after(sine("small", 5.0, 0.5, 4, 1), 2.0), MODEL),  # nothing takes the level along
        (replace(after(STAIRS, 2.0), from_rest=False), MODEL),
        (after(STAIRS, 2.0), replace(MODEL, f=LinearF())),
        (recorded(LINEAR, STAIRS, (), NOISE_V, 1), model_of(LINEAR)),
    ],
    ids=["fresh", "feedthrough", "stuck", "in motion", "no gap known", "no gap"],
)
def test_no_level_is_told_where_none_is_or_none_matters(trace: Trace, model: object) -> None:
    assert held_v(trace, model, NOISE_V) == (0.0, 0)  # type: ignore[arg-type]
