"""Does the benchmark of cost run, and is the work an identification does as little as it counts?"""

import numpy as np
import pytest

from identify import fit, stepping
from identify.joint import identify
from identify.observe import FINEST, Observation
from tests.benchmarks import cost
from tests.proof.rigs import OP_AMP
from tests.trials import model_of

JACOBIAN = 4  # simulations a Jacobian may cost


@pytest.fixture
def work(monkeypatch):
    """Return a list to which every pass over a run adds what it costs, in simulations of that run."""
    done = []
    sensitivities, corrected, misfits = fit.sensitivities, stepping.corrected, Observation.misfits

    def counted(cost_of, original):
        def wrapped(*arguments):
            done.append(cost_of)
            return original(*arguments)

        return wrapped

    monkeypatch.setattr(fit, "sensitivities", counted(JACOBIAN, sensitivities))
    monkeypatch.setattr(stepping, "corrected", counted(FINEST + 1, corrected))
    monkeypatch.setattr(Observation, "misfits", counted(1, misfits))
    return done


def test_the_default_protocol_is_identified_within_the_work_of_300_simulations(work):
    traces = cost.recordings(cost.DEFAULT)
    found = identify(model_of(OP_AMP), traces)
    assert found.fit.converged
    assert found.rms_v == pytest.approx(OP_AMP.noise_v, rel=0.01)
    assert sum(work) / len(traces) < 250


def test_the_derivatives_of_12_parameters_are_timed_beside_the_simulation():
    found = cost.derivatives(3000, 2)
    assert found.count == 12
    assert all(len(t.seconds) == 2 for t in (found.simulation, found.jacobian, found.normal))


def test_the_table_counts_in_simulations():
    found = cost.derivatives(3000, 3)
    lines = cost.in_simulations(found, cost.Whole(10, found.simulation, found.simulation, found.normal)).splitlines()
    assert lines[1].split()[-2] == "1.00"
    assert len(lines) == 8


def test_recordings_are_of_a_rig_that_is_off():
    (trace,) = cost.recordings(("fig13_staircase.yaml",))
    assert trace.size == 62478
    assert np.ptp(trace.y) > 10.0
