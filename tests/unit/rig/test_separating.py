"""May what is to separate two physics be longer than anything that is compared whole?"""

import numpy as np
import pytest

from identify.trace import Trace
from rig.limits import Limits
from rig.separating import MOST_SAMPLES, _room
from rig.workflow import Runs
from tests.proof.rigs import OP_AMP
from tests.trials import model_of


@pytest.mark.parametrize(("samples", "expected_s"), [(10**6, 20.0), (10**8, MOST_SAMPLES / 50_000.0)])
def test_a_protocol_is_as_long_as_the_recordings_or_as_is_compared_whole(samples, expected_s):
    silent = np.broadcast_to(0.0, samples)
    runs = Runs((Trace("run", 50_000.0, silent, silent),), (), model_of(OP_AMP))
    assert _room(runs, Limits(-5.0, 5.0), None).time_s == pytest.approx(expected_s)
