"""Does the benchmark of streams tell of whole streams, and does a recording take no memory that grows with the run?"""

import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from rig.plan import Limits, Plan
from rig.recorded import Entry, Equipment
from rig.recording import Writer
from tests.benchmarks import streaming


def test_a_stream_of_four_inputs_is_whole(tmp_path: Path) -> None:
    with streaming.device() as made:
        done = streaming.stream(made.address, 20_000.0, 0.5, tmp_path)
    assert done.whole, done.reason
    assert done.samples == 10_000
    assert 0 < done.cpu_s < done.wall_s + 1.0


def test_what_is_printed_is_of_whole_streams(capsys) -> None:
    streaming.main(["speed", "--seconds", "0.1", "--rate", "1e5"])
    streaming.main(["endurance", "--minutes", "0.005"])
    fast, _, product, raw, _, slow, *_ = capsys.readouterr().out.splitlines()
    assert fast == "whole: True (all 10000 samples recorded)"
    assert slow.startswith("whole: True (all 15000 samples recorded), 15000 samples of 4 inputs")
    for row in (product, raw):
        assert float(row.split()[-3]) == pytest.approx(10_000 * 8 / 1e6, abs=0.06)
        assert float(row.split()[-2]) > 0


def test_recording_and_closing_take_memory_that_is_not_the_runs(tmp_path: Path) -> None:
    size, block = 3_000_000, 10_000
    plan = Plan("long", np.zeros(size), 50_000.0, (), Limits(-1.0, 1.0), inputs=streaming.INPUTS)
    y, further = np.arange(block, dtype=np.float64), np.ones((3, block))
    tracemalloc.start()
    with Writer(tmp_path / "r.h5", plan, Equipment("loopback:")) as writer:
        tracemalloc.reset_peak()
        before, _ = tracemalloc.get_traced_memory()
        for start in range(0, size, block):
            writer.append(start, y, further)
        after, most = tracemalloc.get_traced_memory()
        assert after - before < 100_000
        assert most - before < 1_000_000
        kept = writer.finish(True, "all")
        _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most - before < 1.6 * plan.u.nbytes, "some stretches of a signal and the ledger, where five signals are long"
    assert kept.count(Entry.RECORDED) == size
    assert kept.y[size - block:size].tolist() == y.tolist()
    assert kept.further["w"][5:6][0] == 1.0
