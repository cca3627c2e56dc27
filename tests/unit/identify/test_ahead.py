"""Do means of a few readings lead a fit most of its way, and do all readings have to confirm what it gains there?"""

from dataclasses import replace

import pytest

from identify.chain import plain_chain
from identify.explain.ahead import gone_ahead
from identify.fit import fit, total_chi_squared
from identify.thinning import fewest
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, observed, recorded

NOISE_V = 0.01
PLAYED = (staircase("walk", FIG13_LEVELS_V, 0.05, 4), sine("sine", 4.0, 3.0, 4, 6))


@pytest.fixture(scope="module")
def seen():
    """Return a recording, and a chain whose G1 is slower than that of the rig by a tenth."""
    traces = [recorded(OP_AMP, s, (), NOISE_V, seed=3, start_s=9.0 * i) for i, s in enumerate(PLAYED)]
    chain = plain_chain(model_of(OP_AMP))
    slower = chain.with_values({"G1.den.s1": 1.1 * chain.values["G1.den.s1"]})
    return tuple(observed(trace, NOISE_V) for trace in traces), slower


def test_means_lead_a_fit_nearly_as_far_as_all_readings_do(seen):
    observations, begun = seen
    asked = []

    def search(few):
        asked.append(few)
        return fit(begun, few)

    ahead, whole = gone_ahead(begun, observations, search), fit(begun, observations)
    (few,) = asked
    assert 5 * sum(o.count for o in few) <= sum(o.count for o in observations)
    gained = total_chi_squared(begun, observations) - whole.cost
    assert gained > 1000.0
    assert whole.cost <= ahead.cost < whole.cost + 0.02 * gained
    left = total_chi_squared(ahead.chain, observations)
    prior = ahead.cost - left
    assert 0.0 <= prior < 20.0  # what it costs is that of all readings, and what the priors cost


@pytest.mark.parametrize(("share", "believed"), [(1.0, True), (0.6, True), (0.3, False), (-1.0, False)])
def test_what_readings_do_not_confirm_is_not_believed(seen, share, believed, monkeypatch):
    """A search that claims to gain more than it did, of means that tell of more than the readings do."""
    observations, begun = seen
    found = fit(begun, fewest(begun, observations))
    gained = total_chi_squared(begun, observations) - total_chi_squared(found.chain, observations)

    def total(chain, those):
        whole = those is observations
        return 1e6 - ((share if whole else 1.0) * gained if chain is found.chain else 0.0)

    monkeypatch.setattr("identify.explain.ahead.total_chi_squared", total)
    assert (gone_ahead(begun, observations, lambda few: found) is not None) is believed


def test_nothing_leads_where_there_are_few_readings_or_the_search_fails(seen):
    observations, begun = seen
    short = tuple(o.until(1000) for o in observations)
    assert gone_ahead(begun, short, lambda few: pytest.fail("too few for means")) is None
    failed = replace(fit(begun, short, iterations=1), cost=float("inf"))
    assert gone_ahead(begun, observations, lambda few: failed) is None
    lost = begun.with_values({"G1.den.s1": float("nan")})
    assert gone_ahead(lost, observations, lambda few: failed) is None
