"""Is a line told from what one stimulus makes at the same frequency?"""

from dataclasses import replace

import numpy as np
import pytest

from identify.effects import chain_of
from identify.explain.bench import Bench
from identify.explain.steady import steady
from identify.stage import Place
from identify.unnamed.lines import Line
from identify.unnamed.maps import LevelMap
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import sine
from tests.trials import model_of, observed, recorded

NOISE_V, HZ = 0.01, 83.0
LINE = Line(Place.SENSE, (HZ,))


def heard(*amplitudes_v: float) -> bool:
    """Return whether a line with an amplitude and a phase of its own in every run is taken for one."""
    traces = []
    for i, amplitude in enumerate(amplitudes_v):
        trace = recorded(OP_AMP, sine(f"wave {i}", 20.0, 3.0, 4, 1), (), NOISE_V, i, 3.0 * i, 8)
        turn = 2.0 * np.pi * HZ * np.arange(trace.size) / trace.rate_hz
        traces.append(replace(trace, y=trace.y[:] + amplitude * np.sin(turn + i)))
    bench = Bench(chain_of(model_of(OP_AMP)), tuple(observed(trace, NOISE_V, 1) for trace in traces), (), ())
    plain = bench.fitted(bench.plain, ())
    fitted = bench.fitted(LINE.put_in(plain.fit.chain), ())
    assert fitted.misfit < 0.1 < plain.misfit
    flat = LevelMap(Place.SENSE, (-1.0, 0.0, 1.0, 2.0))
    assert steady(plain, flat, fitted), "what has no amplitude of its own in every run is not asked"
    return steady(plain, LINE, fitted)


@pytest.mark.parametrize("amplitudes_v", [(0.05, 0.05, 0.05), (0.05, 0.04, 0.06)])
def test_a_line_is_there_in_every_run(amplitudes_v):
    assert heard(*amplitudes_v)


@pytest.mark.parametrize("amplitudes_v", [(0.05, 0.0, 0.0), (0.1, 0.1, 0.01, 0.01)])
def test_what_some_runs_lack_is_no_line(amplitudes_v):
    assert not heard(*amplitudes_v)
