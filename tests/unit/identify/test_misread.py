"""Are recordings that were read wrongly into the program told as that, and none that were not?"""

from dataclasses import replace

import numpy as np
import pytest

from identify.explain.cautions import cautions
from identify.explain.misread import told_misread
from identify.explain.plain import prepared
from identify.holdout import split
from identify.trace import Trace
from tests.proof.ask import known_effects
from tests.proof.rigs import RC, toleranced
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, recorded

NOISE_V = 0.01
MODEL = model_of(toleranced(RC, 3, 0.05))
STIMULI = (staircase("stairs", FIG13_LEVELS_V, 0.08, 1), sine("sine", 10.0, 3.4, 10, 1))


@pytest.fixture(scope="module")
def runs() -> list[Trace]:
    return [recorded(RC, stimulus, (), NOISE_V, i, 3.0 * i) for i, stimulus in enumerate(STIMULI)]


def told(traces: list[Trace]) -> tuple[str, ...]:
    _, plain = prepared(MODEL, split(MODEL, traces), list(known_effects()))
    return told_misread(MODEL, plain)


def test_exchanged_columns_are_told_beside_the_answer(runs: list[Trace]) -> None:
    data = split(MODEL, [replace(run, u=run.y, y=run.u) for run in runs])
    bench, plain = prepared(MODEL, data, list(known_effects()))
    verdicts = ("unexplained", "explained")
    said = {verdict: [*cautions(MODEL, bench, plain, plain, (), data, verdict)] for verdict in verdicts}
    assert any("u for y" in warning for warning in said["unexplained"])
    assert not any("u for y" in warning for warning in said["explained"])


@pytest.mark.parametrize(("times", "sentence"), [(1e3, "1000 times as slow"), (1e-3, "1000 times as fast")])
def test_times_in_another_unit_are_told(runs: list[Trace], times: float, sentence: str) -> None:
    (found,) = told([replace(run, rate_hz=times * run.rate_hz) for run in runs])
    assert sentence in found


def test_what_is_read_rightly_is_not_told_as_misread(runs: list[Trace]) -> None:
    """Neither what the plain model explains, nor what it leaves of another rig, or of readings of another run."""
    assert told(runs) == ()
    assert told([replace(run, y=np.square(run.y)) for run in runs]) == ()
    assert told([replace(run, y=np.roll(run.y, run.size // 3)) for run in runs]) == ()


def test_readings_that_are_mostly_noise_say_nothing_of_how_they_were_read(runs: list[Trace]) -> None:
    noise = np.random.default_rng(3)
    louder = [replace(run, u=run.y + noise.normal(0.0, 20.0, run.size), y=run.u) for run in runs]
    assert told(louder) == ()
