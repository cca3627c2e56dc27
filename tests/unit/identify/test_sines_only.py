"""Are sines alone enough, and is one step as good as several (paper, Remark 7 and the last lines of its conclusion)?

The recordings are the independent integrator's; tests/benchmarks/sines_only.py has the study.
"""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2

import protocols
from identify.identification import Identification
from identify.joint import identify
from identify.trace import Trace
from rig.plan import plan
from rig.protocol import read_protocol
from tests.benchmarks.sines_only import RUNGS as RUNGS_OF_THE_STUDY
from tests.benchmarks.sines_only import Bench, gain, off, paper, sines_alone, staircase_and_sines, walked
from tests.benchmarks.sines_only import sine as two_passes
from tests.proof.bench import answer
from tests.proof.integrator import Grid
from tests.proof.rigs import OP_AMP, SKEWED
from tests.trials import model_of

SECONDS = 1.0 / 3.0  # of a pass: a third of the protocol's


@cache
def sines() -> Bench:
    return sines_alone(SKEWED, SECONDS)


def assert_found(bench: Bench, found: Identification, values: int) -> None:
    """Assert that the search ended at the noise, and every value within four standard errors of the truth."""
    assert found.fit.converged
    assert found.rms_v < 1.05 * bench.noise_v
    told = {name: z for name, z, _ in off(found.certainty, bench.truth)}
    assert len(told) == values
    assert max(map(abs, told.values())) < 4.0, told


@pytest.mark.parametrize("seed", [3, 5])
def test_borders_and_blocks_are_told_from_sines_alone_from_thirty_per_cent_off(seed: int) -> None:
    found = sines().identified(seed)
    assert found.staircase == ()
    assert_found(sines(), found, values=8)


def test_sines_that_were_in_motion_before_the_recording_do_as_well() -> None:
    """No transient from rest helps: the state at the first sample is not known, only what is settled counts."""
    whole = sines().recorded(7)
    late = slice(1234, whole.size)
    cut = Trace("in motion", whole.rate_hz, whole.u[late], whole.y[late], from_rest=False)
    assert_found(sines(), identify(sines().started(7), [cut]), values=8)


def test_the_rig_of_the_papers_simulation_is_told_from_its_sines() -> None:
    """Its blocks only as a whole: dead time and coefficients stand in for one another at frequencies so low."""
    found = paper().identified(4)
    assert found.fit.converged
    borders = {name: z for name, z, _ in off(found.certainty, paper().truth) if name.startswith("F.")}
    assert len(borders) == 4
    assert max(map(abs, borders.values())) < 4.0
    assert -1.0 < gain(paper(), found) < chi2.ppf(0.9999, 10)


def test_as_long_a_recording_with_a_staircase_tells_little_more() -> None:
    """The price of leaving the staircase out, in standard errors, at equal time."""
    alone, mixed = sines_alone(OP_AMP, SECONDS), staircase_and_sines(OP_AMP, SECONDS)
    assert alone.clean.size == pytest.approx(mixed.clean.size, rel=1e-3)
    errors = [
        {name: sd for name, _, sd in off(identify(model_of(OP_AMP), [b.recorded(1)]).certainty, b.truth)}
        for b in (alone, mixed)
    ]
    ratios = {name: errors[0][name] / errors[1][name] for name in errors[1] if not name.endswith("s2")}
    assert len(ratios) == 6
    assert max(ratios.values()) < 2.0, ratios


def test_the_protocol_is_what_the_study_plays() -> None:
    made = plan(read_protocol(Path(protocols.__path__[0]) / "sines_only.yaml"))
    u, steps = walked([two_passes(f, a, 1.0) for f, a in RUNGS_OF_THE_STUDY])
    assert np.max(np.abs(made.u - u)) < 1e-9
    assert len(made.steps) == len(steps)


@cache
def mixture() -> tuple[Trace, tuple[Trace, ...]]:
    """Return a staircase and sines as one recording, and as recordings of their own that each start from rest."""
    whole = staircase_and_sines(SKEWED, 2.0 * SECONDS).clean
    apart = []
    for label in dict.fromkeys(step.label for step in whole.steps):
        at = [step for step in whole.steps if step.label == label]
        u = whole.u[at[0].start : at[-1].stop]
        steps = tuple(replace(s, start=s.start - at[0].start, stop=s.stop - at[0].start) for s in at)
        apart.append(Trace(label, whole.rate_hz, u, answer(SKEWED, u, Grid(whole.rate_hz, u.size, 8)), steps=steps))
    return whole, tuple(apart)


def noisy(traces: tuple[Trace, ...], noise_v: float) -> list[Trace]:
    """Return the traces with one and the same noise, however they are cut."""
    noise = np.random.default_rng(8).normal(0.0, noise_v, sum(t.size for t in traces))
    ends = np.cumsum([t.size for t in traces])
    return [replace(t, y=t.y[:] + n) for t, n in zip(traces, np.split(noise, ends[:-1]), strict=True)]


def test_one_run_and_runs_apart_give_one_answer() -> None:
    """Noise is the same in both; what differs is the jump at the beginning of each run, which tells something too."""
    whole, apart = mixture()
    start = staircase_and_sines(SKEWED).started(2)
    one, several = (identify(start, noisy(traces, 0.01)).certainty for traces in ((whole,), apart))
    names = [name for name in one.names if name in several.names and not name.endswith("s2")]
    assert len(names) == 6
    for name in names:
        sd, other = (float(np.sqrt(c.covariance[c.names.index(name), c.names.index(name)])) for c in (one, several))
        assert other == pytest.approx(sd, rel=0.25)
        assert abs(one.values[name] - several.values[name]) < sd


def test_one_step_is_as_good_as_two() -> None:
    """Borders first, from the staircase, then the blocks with these held: the paper's order; or all at once."""
    _, apart = mixture()
    runs = noisy(apart, 0.01)
    start = staircase_and_sines(SKEWED).started(2)
    borders = identify(start, runs[:1]).model.f
    second = identify(replace(start, f=borders, fixed=("F",)), runs[1:])
    at_once = identify(start, runs)
    for name in ("G1.den.s1", "G2.den.s1"):
        two, one = (found.certainty for found in (second, at_once))
        sd = float(np.sqrt(one.covariance[one.names.index(name), one.names.index(name)]))
        later = float(np.sqrt(two.covariance[two.names.index(name), two.names.index(name)]))
        assert abs(one.values[name] - two.values[name]) < 4.0 * float(np.hypot(sd, later))
    assert at_once.rms_v <= second.rms_v * 1.01
