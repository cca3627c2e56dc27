"""Is noise in front of the gap only believed where the readings scatter as it says?"""

import numpy as np
import pytest

from identify.effects import catalogue, chain_of
from identify.explain.chance import scatters_all, scatters_more
from identify.fit import fit
from identify.stage import Grid, Place
from tests.proof.cases import Concealed
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import sine
from tests.trials import model_of, observed, recorded

NOISE_V, SUBSTEPS, BANDWIDTH_HZ = 0.01, 4, 30.0
WAVE = sine("wave", 10.0, 3.0, 5, 2)
NOISY = catalogue()["process_noise"]


def told(form: str, sd_v: float, physics, ask=scatters_more) -> bool:
    """Fit the borders beside noise of this size, which makes up for its mean, and ask."""
    effect = NOISY(Place.G1, form)
    chain = effect.put_in(chain_of(model_of(OP_AMP)), {"sd": sd_v, "bandwidth": BANDWIDTH_HZ})
    run = observed(recorded(OP_AMP, WAVE, physics, NOISE_V, fine=8), NOISE_V, SUBSTEPS)
    held = [p.name for p in chain.parameters() if p.name not in ("F.D_L", "F.D_U")]
    return ask(fit(chain, [run], fixed=held).chain, effect, (run,))


@pytest.mark.parametrize(("form", "law"), [("white", "process_noise"), ("low-pass", "process_noise, low-passed")])
def test_noise_that_is_there_scatters_no_more_than_the_readings(form: str, law: str) -> None:
    assert not told(form, 0.03, (Concealed(law, {"sd": 0.03, "bandwidth": BANDWIDTH_HZ}),))


@pytest.mark.parametrize("form", ["white", "low-pass"])
def test_noise_that_the_readings_do_not_show_is_not_there(form: str) -> None:
    assert told(form, 0.03, ())


@pytest.mark.parametrize(("form", "law"), [("white", "process_noise"), ("low-pass", "process_noise, low-passed")])
def test_what_is_left_beside_noise_that_is_there_may_all_be_its_scatter(form: str, law: str) -> None:
    noise = Concealed(law, {"sd": 0.03, "bandwidth": BANDWIDTH_HZ})
    assert told(form, 0.03, (noise,), scatters_all)
    rail = Concealed("saturation", {"lower": -3.0, "upper": 3.0})
    assert not told(form, 0.03, (noise, rail), scatters_all)


def test_other_physics_scatters_nothing() -> None:
    effect = catalogue()["saturation"](Place.F, "upper")
    chain = effect.put_in(chain_of(model_of(OP_AMP)), {"upper": 3.0})
    run = observed(recorded(OP_AMP, WAVE, (), NOISE_V, fine=8), NOISE_V, SUBSTEPS)
    assert not scatters_more(chain, effect, (run,))
    assert not scatters_all(chain, effect, (run,))


@pytest.mark.parametrize("form", ["white", "low-pass"])
def test_a_course_has_the_size_and_the_bandwidth_that_are_said(form: str) -> None:
    grid = Grid("run", 1e-4, 1, 0.0)
    course = NOISY(Place.G1, form).course((0.02, 300.0), grid, 200_000, np.random.default_rng(1))
    assert float(np.std(course)) == pytest.approx(0.02, rel=0.05)
    power, frequency = np.abs(np.fft.rfft(course)) ** 2, np.fft.rfftfreq(course.size, grid.step_s)
    below = float(np.sum(power[frequency <= 300.0]) / np.sum(power))
    assert below == pytest.approx(1.0 if form == "white" else 0.52, abs=0.05)
