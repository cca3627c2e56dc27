"""Does a fit end where the data say, and not where plain values or coarse grids have led it?"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from identify.effects import catalogue, chain_of
from identify.explain import explain
from identify.explain.bench import Bench
from identify.explain.hypothesis import Hypothesis
from identify.explain.plain import prepared
from identify.explain.race import begun_anew
from identify.fit import fit
from identify.holdout import split
from identify.stage import Place
from tests.proof.cases import Concealed
from tests.proof.rigs import OP_AMP, Rig, toleranced
from tests.proof.stimuli import FIG13_LEVELS_V, Stimulus, staircase
from tests.trials import model_of, observed, recorded

RAIL = catalogue()["saturation"](Place.F, "lower")
RATE_HZ = 5000.0
TURNS = np.polyval([46.0, 0.8, 0.0], np.arange(2160) / RATE_HZ)
CHIRP = Stimulus("chirp", 3.0 * np.sin(2.0 * np.pi * TURNS), (), RATE_HZ)
RIG = Rig("rig", (1.0,), (0.0215, 1.0), 7.84, 1.65, 9.21, -1.86, (1.0,), (0.0032, 1.0), 1.2e-3)


@pytest.mark.parametrize("seed", [1, 2])
def test_a_lag_is_not_passed_over_for_a_law_that_plain_values_help_where_data_tell_little(seed: int) -> None:
    """A capacitor that bends was named with 0.996, of plain values 20 % off, and the pole was not even fitted."""
    one = recorded(RIG, CHIRP, (Concealed("extra_pole in G1", {"tau": 1.67e-3}),), RIG.noise_v, seed)
    (finding,) = explain(model_of(toleranced(RIG, seed, 0.05)), [one]).effects
    assert (finding.id, finding.could_also_be[0].id) in (("extra_pole", "source_pole"), ("source_pole", "extra_pole"))
    assert finding.parameters["tau"][0].low < 1.67e-3 < finding.parameters["tau"][0].high


def test_only_lags_that_were_given_up_behind_a_law_that_is_none_are_fitted_from_the_rig_file() -> None:
    begun, plain = [], Hypothesis((), SimpleNamespace(converged=True), 1100.0, 1000)
    pole, gap = catalogue()["extra_pole"](Place.G1), catalogue()["rate_dependent_gap"](Place.F)

    def tried(effect, chi2, converged=False):
        chain = chain_of(model_of(OP_AMP)).with_values({"F.D_L": 1.0})
        fit = SimpleNamespace(converged=converged, chain=effect.put_in(chain, {}))
        return Hypothesis((effect,), fit, chi2, 1000)

    def fitted(chain, effects):
        begun.append((effects[0].id, chain.values["F.D_L"]))
        return tried(effects[0], 1001.0, True)

    of_rig_file = chain_of(model_of(OP_AMP))
    bench = SimpleNamespace(fitted=fitted, from_rig_file=Bench(of_rig_file, (), (), ()).from_rig_file)
    base, rail, behind = replace(plain, chi2=5000.0), tried(RAIL, 1000.0), tried(pole, 2000.0)
    hopeless, done = tried(gap, 4500.0), tried(gap, 2000.0, converged=True)
    assert [h.chi2 for h in begun_anew(bench, base, [rail, behind, hopeless, done])] == [1000.0, 1001.0, 4500.0, 2000.0]
    assert begun == [("extra_pole", 1.25)] * 2  # as long as it was, and twice
    for start, laws in ((base, [tried(gap, 1000.0), behind]), (replace(base, effects=(RAIL,)), [rail, behind])):
        assert begun_anew(bench, start, laws) == laws
    assert begun_anew(bench, base, []) == []


SLOW = Rig("slow", (1.0,), (6.7e-8, 6.97e-3, 1.0), 6.9, 0.55, 5.5, -0.46, (1.0,), (1.28e-8, 3.81e-3, 1.0), 1.44e-3)
LEVELS = np.repeat(np.random.default_rng(1).uniform(-1.5, 1.5, 400), 10)
READ_SLOWLY = Stimulus("levels", LEVELS, (), 2000.0)  # the fast poles of either block take a fiftieth of a sample


def test_a_fit_ends_at_its_optimum_though_coarse_grids_do_not_show_what_the_values_do() -> None:
    """It ended 160 of chi-squared above, which a law of no catalogue at F explained, and p was 1e-24."""
    seen = (observed(recorded(SLOW, READ_SLOWLY, (), SLOW.noise_v, 1), SLOW.noise_v, 1),)
    bench = Bench(chain_of(model_of(toleranced(SLOW, 1, 0.05))), seen, (), ())
    bench = bench.refined(bench.plain)
    best = fit(bench.plain, bench.observations, iterations=60)
    assert bench.fitted(bench.plain, ()).chi2 < best.cost + 1.0


RAILS = Concealed("saturation", {"lower": -4.0, "upper": 4.0})


@pytest.mark.parametrize(("physics", "finely"), [((), 1), ((RAILS,), 0)])
def test_the_plain_fit_is_brought_to_its_end_where_nothing_may_be_missing(
    physics: tuple[Concealed, ...], finely: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []

    def brought(bench: Bench, hypothesis: Hypothesis) -> Hypothesis:
        asked.append(hypothesis.misfit)
        return hypothesis

    monkeypatch.setattr(Bench, "finely", brought)
    model = model_of(OP_AMP)
    walk = recorded(OP_AMP, staircase("walk", FIG13_LEVELS_V, 0.02), physics, 0.01, 1, fine=8)
    prepared(model, split(model, [walk]))
    assert len(asked) == finely
