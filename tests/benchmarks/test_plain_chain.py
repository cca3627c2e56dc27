"""Do the benchmarks run, and do the two sides of the comparison compute the same thing where they can?"""

import numpy as np
import pytest

from identify.model import LinearF
from tests.benchmarks import abreast, plain_chain, start_up
from tests.benchmarks.timing import Timed, ratio_of_rounds, side_by_side


@pytest.mark.parametrize("order", plain_chain.ORDERS)
@pytest.mark.parametrize("f", [plain_chain.WITHOUT_GAP, LinearF(8.0)], ids=["a gap of zero", "linear F"])
def test_both_sides_compute_the_same_when_there_is_no_gap(order, f):
    u = plain_chain.stimulus(5000)
    filtered = plain_chain.run_filters(order, u)
    assert np.ptp(filtered) > 10.0
    error = plain_chain.run_fused(plain_chain.chain_with(order, f), u) - filtered
    assert np.abs(error).max() < 1e-6  # a filter in powers of z loses digits where three poles lie close to one


@pytest.mark.parametrize("order", plain_chain.ORDERS)
def test_one_loop_and_the_stages_compute_the_same_with_a_gap(order):
    chain, u = plain_chain.chain_with(order, plain_chain.GAP), plain_chain.stimulus(100_000)
    fused = plain_chain.run_fused(chain, u)
    assert np.ptp(fused) > 10.0
    assert np.allclose(fused, plain_chain.run_staged(chain, u), rtol=0, atol=1e-10)
    assert np.abs(fused[:5000] - plain_chain.run_filters(order, u[:5000])).max() > 1.0


def test_the_table_has_a_row_for_every_order(capsys):
    plain_chain.main(["2000", "3"])
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("2000 samples, 3 rounds")
    assert [line.split()[0] for line in lines[2:]] == ["1", "2", "3"]


def test_values_abreast_and_simulated_one_by_one_change_the_answer_alike(capsys):
    for order in abreast.ORDERS:
        chain, seen = abreast.chain_with(order), abreast.seen(5000)
        found, expected = abreast.abreast(chain, seen), abreast.simulated(chain, seen)
        assert np.abs(expected).max(axis=1).min() > 1e-3
        assert np.abs(found - expected).max() < 1e-6 * np.abs(expected).max()
    abreast.main(["2000", "3"])
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()[2:]] == ["1", "2", "3"]


def test_start_up_is_measured_beside_an_idle_interpreter():
    (idle,) = start_up.measured({"python -c pass": start_up.COMMANDS["python -c pass"]}, 1)
    assert start_up.table([idle]).splitlines()[-1].split()[-1] == "1.00"


def test_works_take_turns_after_a_first_untimed_run():
    order = []
    one, other = side_by_side([("one", lambda: order.append(1)), ("other", lambda: order.append(2))], 3)
    assert order == [1, 2, 1, 2, 1, 2, 1, 2]
    assert len(one.seconds) == len(other.seconds) == 3


def test_ratios_are_taken_within_rounds():
    assert ratio_of_rounds(Timed("one", (2.0, 20.0, 3.0)), Timed("other", (1.0, 10.0, 1.0))) == 2.0
    assert (Timed("one", (2.0, 20.0, 3.0)).least, Timed("one", (2.0, 20.0, 3.0)).median) == (2.0, 3.0)
