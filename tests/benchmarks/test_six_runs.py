"""Is the case that is measured one of six runs and some 300,000 samples, each run a stimulus over and over?"""

import numpy as np
import pytest

from tests.benchmarks.six_runs import SAMPLES, six_runs
from tests.proof.trial import Key, drawn


def test_six_runs_of_a_trial_are_repeated_to_the_length_that_was_asked_for() -> None:
    trial = drawn(Key(132, "single", "saturation", 0))
    longer = six_runs(trial)
    assert len(longer.training) == 6
    assert sum(stimulus.u.size for stimulus in longer.training) == pytest.approx(SAMPLES, rel=0.15)
    assert (longer.rig, longer.physics, longer.held_out) == (trial.rig, trial.physics, trial.held_out)
    for stimulus in longer.training:
        once = next(s for s in trial.training if s.name == stimulus.name)
        pieces = [stimulus.u[s.start : s.stop] for s in stimulus.segments]
        assert len(pieces) > len(once.segments)
        assert all(np.array_equal(piece, once.u[: pieces[0].size]) for piece in pieces)
        assert stimulus.pause_s == once.pause_s
