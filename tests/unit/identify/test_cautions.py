"""Is the reader told what weakens an answer, and only then?"""

from identify.effects import catalogue
from identify.explain.cautions import cautions
from identify.explain.plain import prepared
from identify.holdout import split
from identify.stage import Place
from tests.proof.ask import known_effects
from tests.proof.rigs import RC
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, recorded

STIMULI = (staircase("stairs", FIG13_LEVELS_V, 0.02), sine("sine", 20.0, 3.4, 3, 1))


def test_three_laws_together_may_be_one_that_nobody_listed():
    model = model_of(RC)
    data = split(model, [recorded(RC, stimulus, (), 0.01, i, 3.0 * i) for i, stimulus in enumerate(STIMULI)])
    bench, plain = prepared(model, data, list(known_effects()))
    places = {"feedthrough": Place.SENSE, "self_heating": Place.F, "extra_pole": Place.G2}
    laws = [catalogue()[name](place) for name, place in places.items()]
    for count in (2, 3):
        some = tuple(laws[:count])
        better = bench.fitted(bench.with_effects(some, {}), some)
        said = [text for text in cautions(model, bench, plain, better, (), data, "explained") if "together" in text]
        assert len(said) == (count == 3)
        assert not said or "feedthrough, self_heating and extra_pole" in said[0]
