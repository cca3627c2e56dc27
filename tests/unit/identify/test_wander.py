"""Is what noise in front of the gap leaves by chance told from physics that comes back with what is played?"""

from dataclasses import replace

import pytest

from identify.effects import catalogue, chain_of
from identify.explain.hypothesis import Hypothesis
from identify.explain.wander import all_wanders
from identify.fit import chi_squared, fit
from identify.stage import Place
from identify.trace import Step
from tests.proof.cases import Concealed
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import sine
from tests.trials import model_of, observed, recorded

NOISE_V, SD_V, BANDWIDTH_HZ = 0.01, 0.03, 30.0
WAVE = sine("wave", 10.0, 3.0, 5, 2)
NOISY = catalogue()["process_noise"](Place.G1, "white")
PRESENT = Concealed("process_noise", {"sd": SD_V, "bandwidth": BANDWIDTH_HZ})


def believed(effects, physics, segments=WAVE.segments) -> bool:
    """Return whether all that is left beside ``effects``, the borders fitted, is taken for chance."""
    steps = tuple(Step(s.label, s.kind, s.start, s.stop, s.repeat) for s in segments)
    run = observed(replace(recorded(OP_AMP, WAVE, physics, NOISE_V, fine=8), steps=steps), NOISE_V, 4)
    chain = chain_of(model_of(OP_AMP))
    for effect in effects:
        chain = effect.put_in(chain, {"sd": SD_V, "bandwidth": BANDWIDTH_HZ})
    found = fit(chain, [run], fixed=[p.name for p in chain.parameters() if p.name not in ("F.D_L", "F.D_U")])
    chi2 = chi_squared(found.chain, run)
    return all_wanders(Hypothesis(tuple(effects), found, chi2, run.count), (run,))


def test_what_noise_in_front_of_the_gap_leaves_is_its_own_chance():
    assert believed((NOISY,), (PRESENT,))
    assert not believed((), (PRESENT,))  # nothing in the model acts by chance


@pytest.mark.parametrize(("segments", "may"), [(WAVE.segments, False), ((), True)], ids=["repeats", "none"])
def test_what_comes_back_with_the_stimulus_is_not_chance_where_repeats_tell(segments, may):
    bypass = Concealed("feedthrough", {"k": 0.04})  # within what such noise would scatter
    assert believed((NOISY,), (bypass,), segments) is may
