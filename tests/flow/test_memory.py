"""Does an identification ever hold an array as long as the run? Blocks are made small here, so that a run is long."""

import tracemalloc
from pathlib import Path

import pytest

from identify import between, chain, colour, noise, taps
from identify.derivatives import sensitivities, tangents
from identify.harmonic import periods
from identify.planning import excitation
from identify.starts import early
from identify.trace import blocks, regrouped
from identify.uncertainty import inflation
from rig import recordingfile, workflow
from tests.benchmarks import large_recording

BLOCK = 1 << 13  # samples: 64 kB
PREFIX = 1 << 14  # samples in which a period is looked for; the longest here has 5000


@pytest.fixture
def _small_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make everything that bounds memory 128 times smaller."""
    monkeypatch.setattr(blocks, "__defaults__", (BLOCK,))
    monkeypatch.setattr(regrouped, "__defaults__", (BLOCK,))
    monkeypatch.setattr(chain, "CHUNK", BLOCK)
    monkeypatch.setattr(tangents, "AT_ONCE", BLOCK // 16)
    monkeypatch.setattr(sensitivities, "AT_ONCE", BLOCK // 8)
    monkeypatch.setattr(taps, "AT_ONCE", BLOCK // 8)
    monkeypatch.setattr(noise, "LONG", BLOCK)
    monkeypatch.setattr(noise, "BEGINNINGS", (PREFIX,))
    monkeypatch.setattr(excitation, "LONGEST", PREFIX)
    monkeypatch.setattr(inflation, "TOGETHER", BLOCK // 1000 * 1000)
    monkeypatch.setattr(colour, "MOST", BLOCK)
    monkeypatch.setattr(colour, "IN_ALL", 4 * BLOCK)
    monkeypatch.setattr(early, "TRIED", PREFIX)
    monkeypatch.setattr(periods, "BATCH", BLOCK)
    monkeypatch.setattr(between, "AT_ONCE", BLOCK)
    monkeypatch.setattr(recordingfile, "AT_ONCE", BLOCK)


def identified(path: Path, samples: int) -> int:
    """Record, read and identify; return the most that Python and numpy held at once from reading on, in bytes."""
    large_recording.record(path, samples)
    tracemalloc.start()
    try:
        found = workflow.identify_runs(workflow.load([path]))
        assert found.fit.converged
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.mark.usefixtures("_small_blocks")
def test_no_array_of_numbers_is_as_long_as_the_run(tmp_path: Path) -> None:
    identified(tmp_path / "first.h5", 20_000)  # what is imported and compiled once
    samples = 500_000
    kept = 2 * 2 * samples  # what the samples' grid leaves out, in half precision, before a search and after it
    assert identified(tmp_path / "long.h5", samples) < 8 * samples + kept
