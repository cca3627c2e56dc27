"""Is a recording that stays in its file identified as one in memory is?"""

from dataclasses import replace

import numpy as np
import pytest

from identify import noise, staircase
from identify.joint import identify
from identify.trace import Step, blocks
from tests.proof.rigs import RC
from tests.proof.stimuli import FIG13_LEVELS_V, sine
from tests.proof.stimuli import staircase as stairs
from tests.trials import model_of, noisy, recorded, shelved

STAIRS = noisy(recorded(RC, stairs("stairs", FIG13_LEVELS_V[::2], 0.3)), 0.01, 1)
WAVE = noisy(recorded(RC, sine("sine", 10.0, 6.0, 10, 5)), 0.01, 2)
SINE = replace(WAVE, steps=(Step("sine", "sine", 0, WAVE.size),))
LOSSY = replace(SINE, name="lossy", valid=np.arange(SINE.size) % 997 != 5, from_rest=False)
MODEL = model_of(RC)
CASES = {
    "held": (STAIRS, SINE, LOSSY),
    "measured": (replace(STAIRS, intersample="linear"), replace(SINE, intersample="linear")),
}


@pytest.mark.parametrize("traces", CASES.values(), ids=CASES)
def test_the_answer_is_the_same_to_the_last_bit(traces):
    assert identify(MODEL, [shelved(t) for t in traces]).to_dict() == identify(MODEL, traces).to_dict()


def test_the_answer_hardly_depends_on_how_much_is_read_at_once(monkeypatch):
    traces = CASES["held"]
    whole = identify(MODEL, traces)
    for module in (noise, staircase):
        monkeypatch.setattr(module, "blocks", lambda start, stop: blocks(start, stop, 3001))
    cut = identify(MODEL, [shelved(t) for t in traces])
    assert cut.noise.rms_v == pytest.approx(whole.noise.rms_v, rel=1e-12)
    assert [p.branch for p in cut.staircase] == [p.branch for p in whole.staircase]
    for name, border in whole.borders.items():
        assert cut.borders[name].value == pytest.approx(border.value, rel=1e-9)
