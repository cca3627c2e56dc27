"""Is a reading that is off over a narrow stretch of its level found, and is nothing else taken for that?"""

from dataclasses import replace

import numpy as np
import pytest

from identify.effects import chain_of
from identify.evidence import Evidence
from identify.explain.bench import Bench
from identify.explain.locate import located
from identify.explain.narrow import narrow
from identify.explain.suspects import suspects
from identify.stage import Place
from tests.proof.cases import Concealed
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, observed, recorded

NOISE_V = 0.01
RUNS = (staircase("walk", FIG13_LEVELS_V, 0.1), sine("wave", 20.0, 3.0, 20, 1))


def bench(law=lambda y: y, physics: tuple[Concealed, ...] = ()) -> Bench:
    """Return two recordings of which every reading, before its noise, went through a law."""
    quiet = [recorded(OP_AMP, run, physics, 0.0, i, 3.0 * i, 8) for i, run in enumerate(RUNS)]
    rng = np.random.default_rng(2)
    noisy = [replace(t, y=law(t.y) + rng.normal(0.0, NOISE_V, t.size)) for t in quiet]
    return Bench(chain_of(model_of(OP_AMP)), tuple(observed(t, NOISE_V, 1) for t in noisy), (), ())


def dead_zone(y):
    return np.where(np.abs(y) < 0.2, 0.0, y)


def wide_code(y):
    return y + 0.04 * ((y > 2.0) & (y < 2.1))


@pytest.mark.parametrize(("law", "ends"), [(dead_zone, (-0.2, 0.2)), (wide_code, (2.0, 2.1))])
def test_a_narrow_stretch_is_found_by_its_ends_and_placed_at_the_sense(law, ends):
    """No map of 24 knots over 35 V sees it, nor a corner on a grid of 64."""
    there = bench(law)
    plain = there.fitted(there.plain, ())
    found = narrow(Evidence(plain.fit, there.observations))
    assert found is not None
    assert found[0].knots[0] == pytest.approx(ends[0], abs=0.08)
    assert found[0].knots[-1] == pytest.approx(ends[1], abs=0.08)
    assert found[1] > 2.0 * np.log(1000.0)
    told = located(there, plain)
    assert told.significant
    assert told.best.place == Place.SENSE
    assert told.best.form == "corners of the level"
    assert told.share > 0.5


def bent(y):
    return y + 0.1 * (y / 10.0) ** 3


LAG = (Concealed("source_pole", {"tau": 2e-4}),)


def test_noise_has_no_narrow_stretch():
    there = bench()
    evidence = Evidence(there.fitted(there.plain, (), 0).fit, there.observations)
    assert narrow(evidence) is None


@pytest.mark.parametrize(("law", "physics"), [(bent, ()), (lambda y: y, LAG)])
def test_what_is_not_narrow_is_another_law_though_a_staircase_rests_at_single_levels(law, physics):
    there = bench(law, physics)
    told = located(there, there.fitted(there.plain, ()))
    assert told.significant
    assert told.best.form != "corners of the level"


def test_few_readings_show_none():
    there = bench(dead_zone)
    few = [replace(o, trace=o.trace.until(3000), use=o.use[:3000]) for o in there.observations]
    evidence = Evidence(there.fitted(there.plain, (), 0).fit, few)
    assert narrow(evidence) is None
    assert suspects(evidence)[0].correction.name == "unnamed"
