"""Is the long recording what the trial bench would record, and does the benchmark tell what it took?"""

import numpy as np

from identify.trace import Stored
from rig.plan import plan
from rig.protocol import parse_protocol
from rig.recording import read
from tests.benchmarks import large_recording
from tests.benchmarks.large_recording import NODES, RATE_HZ, TRUTH, readings, schedule, steps_of, stretches
from tests.proof.bench import answer
from tests.proof.integrator import Grid


def test_it_is_what_the_trial_bench_would_record():
    u = np.concatenate(list(stretches(40_000)))[::2][:8000]
    cut = [u[:3000], u[3000:3001], u[3001:]]
    y = np.concatenate([y for _, y in readings(TRUTH, iter(cut))])
    true = answer(TRUTH, u, Grid(RATE_HZ, u.size, 8 * NODES))
    noise = TRUTH.noise_v * np.random.default_rng(0).standard_normal(u.size)
    assert np.ptp(true) > 5.0
    assert np.abs(y - noise - true).max() < 1e-4


def test_every_sample_has_its_step_and_sines_are_whole_periods(tmp_path):
    assert [p.step.start for p in schedule(10**6)][1:] == [p.step.stop for p in schedule(10**6)][:-1]
    assert steps_of(10**6)[-1].stop <= 10**6
    large_recording.record(tmp_path / "r.h5", 30_000)
    kept = read(tmp_path / "r.h5")
    assert kept.u.size == kept.steps[-1].stop
    sine = kept.u[kept.steps[1].start : kept.steps[1].stop]
    assert np.array_equal(sine[:-5000], sine[5000:])


def test_time_memory_and_answers_are_told(capsys):
    large_recording.main(["1e5", "--only", "import", "verify", "identify"])
    head, *lines = capsys.readouterr().out.splitlines()
    assert head.split() == ["samples", "command", "time", "s", "CPU", "s", "peak", "MB"]
    rows = [line.split() for line in lines if not line.startswith("  ") or line.split()[0].isdigit()]
    assert [row[1] for row in rows] == ["import", "verify", "identify"]
    assert all(float(row[4]) > 50.0 for row in rows)
    assert lines[1] == "  the same samples, bit for bit"
    off = [float(line.split()[-2]) for line in lines if "off by" in line]
    assert len(off) == 4
    assert max(map(abs, off)) < 4.0


def test_a_changed_sample_is_not_the_same(tmp_path):
    large_recording.record(tmp_path / "a.h5", 30_000)
    large_recording.record(tmp_path / "b.h5", 30_000, rails_v=10.0)
    assert large_recording.alike(tmp_path / "a.h5", tmp_path / "a.h5") == "the same samples, bit for bit"
    assert large_recording.alike(tmp_path / "a.h5", tmp_path / "b.h5") == "NOT THE SAME SAMPLES"


def test_the_protocol_is_as_long_as_it_is_asked_to_be():
    made = plan(parse_protocol(large_recording.protocol_of(10**7), "p.yaml"))
    assert isinstance(made.u, Stored)
    assert abs(made.u.size / 1e7 - 1.0) < 1e-2
