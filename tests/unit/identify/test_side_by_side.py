"""Do corrections race on means of samples where these show what they do, and on all samples where they do not?"""

from dataclasses import replace

import pytest

from identify import thinning
from identify.effects import chain_of
from identify.explain.bench import Bench
from identify.explain.hypothesis import Hypothesis
from identify.explain.side_by_side import LAST, SHOWN, raced
from identify.explain.suspect import Suspect, overlooked
from tests.proof.cases import Concealed
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, observed, recorded

NOISE_V = 0.01
PLAYED = (staircase("stairs", FIG13_LEVELS_V, 0.12, 2), sine("sine", 31.25, 8.0, 25, 1))


@pytest.fixture(scope="module")
def slow() -> Bench:
    """Return a bench with a bent border in its recordings, which is met as slowly as the source moves."""
    bent = (Concealed("curved_border", {"k2": 0.0, "k3": 0.03}),)
    runs = [recorded(OP_AMP, s, bent, NOISE_V, seed=3, start_s=9.0 * i) for i, s in enumerate(PLAYED)]
    return Bench(chain_of(model_of(OP_AMP)), tuple(observed(run, NOISE_V, 1) for run in runs), (), ())


@pytest.fixture(scope="module")
def base(slow: Bench) -> Hypothesis:
    return slow.fitted(slow.plain, ())


@pytest.fixture(scope="module")
def others(slow: Bench, base: Hypothesis) -> list[Suspect]:
    return overlooked(slow.suspects(base), ())[:20]  # those that come first


def laps(slow: Bench, base: Hypothesis, others: list[Suspect], monkeypatch: pytest.MonkeyPatch) -> dict[int, list[str]]:
    """Return the forms of corrections that were fitted, by how many samples they were fitted to; all were let race."""
    asked: dict[int, list[str]] = {}
    fitted = Bench.fitted

    def noted(bench, chain, effects, iterations=0, *rest, **told):
        forms = [stage.form for stage in chain.added]
        asked.setdefault(sum(o.count for o in bench.observations), []).extend(forms)
        return fitted(bench, chain, effects, iterations, *rest, **told)

    with monkeypatch.context() as patched:
        patched.setattr(Bench, "fitted", noted)
        raced(slow, base, others, -1.0)
    return asked


def test_a_race_on_means_ends_with_the_same_law_on_all_samples(slow, base, others, monkeypatch):
    assert len(slow.evidence(base).residual) < 0.4 * base.count
    (first, fitted), *rest = raced(slow, base, others, -1.0)
    assert len(rest) == LAST - 1
    assert all(h.data is slow.observations for _, h in ((first, fitted), *rest))
    monkeypatch.setattr(thinning, "LEAST", 10 * base.count)
    every = replace(slow, asked={})
    assert every.evidence(base).fine is every.evidence(base)
    alone, on_all = raced(every, base, others, -1.0)[0]
    assert (alone.correction.form, alone.correction.place) == (first.correction.form, first.correction.place)
    assert base.misfit > 10.0
    assert max(fitted.misfit, on_all.misfit) < base.noise_known


def test_what_means_hide_races_on_all_samples(slow, base, monkeypatch):
    """A quick correction is told by what it changes in single samples, which means lose or make larger."""
    evidence, shown, hidden = slow.evidence(base), [], []
    for s in (s for s in slow.suspects(base) if s.correction.quick):
        chain = s.correction.put_in(evidence.chain, s.values)
        before, after = (float(change @ change) for change in (evidence.fine.change(chain), evidence.change(chain)))
        (shown if SHOWN < after / before < 1.0 / SHOWN else hidden).append(s)
    assert hidden
    asked = laps(slow, base, [*shown[:6], *hidden], monkeypatch)
    few, every = sorted(asked)
    assert every == base.count
    assert {s.correction.form for s in hidden} <= set(asked[every])
    assert {s.correction.form for s in shown[:6]} == set(asked[few])
