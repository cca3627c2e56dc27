"""Is a signal that is never in memory whole the same signal, sample for sample, wherever it is cut?"""

from pathlib import Path

import numpy as np
import pytest

from identify.trace import Stored, blocks
from rig import retry, session, signals
from rig.amplified_device import AmplifiedDevice
from rig.amplifier import Amplifier
from rig.errors import RefusedError
from rig.plan import Plan, plan
from rig.preview import outlined
from rig.protocol import Limits, parse_protocol
from rig.recording import read
from rig.signals import InTurn, alike, drawn_once, extremes, first_steeper, joined, steepest
from tests.unit.rig.devices import ScriptedDevice

HEAD = "spec: 1\ntitle: all kinds\nquestion: which?\nlimits: {level: 9 V}\nacquisition: {rate: 1 kHz}\n"
STEPS = """\
rig: rigs/opamp_backlash.yaml
on_overrun: retry 1
repeats: 2
steps:
  - staircase: {levels: [{from: -3 V, to: 3 V, step: 0.5 V}, -8 V], dwell: 61 ms}
  - {repeats: 2, sine: {frequency: 3 Hz, amplitude: 3 V, periods: 4, phase: 1 rad, offset: 1 V}}
  - sine: {frequency: 3.1 Hz, amplitude: 2 V, periods: 3}
  - triangle: {frequency: 7 Hz, amplitude: 3 V, periods: 9, offset: -1 V}
  - multisine: {frequencies: [1 Hz, 3 Hz, 11 Hz], peak: 5 V, time: 1.3 s}
  - multisine: {frequencies: [2 Hz, 5 Hz], amplitude: 1 V, periods: 3, phases: zero}
  - minor_loops: {amplitudes: [4 V, 2 V, 1 V], slope: 30 V/s}
  - table: {times: [0 s, 0.7 s, 1.1 s], levels: [0 V, 2 V, -3 V]}
  - {label: straight, table: {times: [0 s, 0.7 s, 1.1 s], levels: [0 V, 2 V, -3 V], between: linear}}
  - hold: {level: 1 V, time: 1 s}
"""


def planned(text: str = HEAD + STEPS) -> Plan:
    return plan(parse_protocol(text, "p.yaml"))


@pytest.fixture
def whole() -> Plan:
    """Return the plan as an array, made before memory becomes small."""
    made = planned()
    assert isinstance(made.u, np.ndarray)
    return made


@pytest.fixture
def _small(whole: Plan, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(signals, "AT_ONCE", 100)
    monkeypatch.setattr(blocks, "__defaults__", (77,))


@pytest.mark.usefixtures("_small")
def test_a_plan_drawn_by_stretches_is_the_plan_drawn_at_once(whole):
    long = planned()
    assert isinstance(long.u, InTurn)
    assert np.array_equal(long.u[:], whole.u)
    assert long.steps == whole.steps
    assert (long.range_v, long.peak_v, long.slew_v_per_s) == (whole.range_v, whole.peak_v, whole.slew_v_per_s)
    assert long.disk_bytes == whole.disk_bytes
    random = np.random.default_rng(0)
    for start, stop in random.integers(0, whole.u.size + 1, (300, 2)):
        assert np.array_equal(long.u[start:stop], whole.u[start:stop])


@pytest.mark.usefixtures("_small")
@pytest.mark.parametrize("steps", [
    "  - sine: {frequency: 3 Hz, amplitude: 12 V, periods: 4}\n",
    "  - {label: a, sine: {frequency: 3 Hz, amplitude: 2 V, periods: 4}}\n"
    "  - {label: a, sine: {frequency: 3 Hz, amplitude: 2.5 V, periods: 4}}\n",
])  # fmt: skip
def test_what_must_not_be_played_is_refused_in_the_same_words(steps, monkeypatch):
    with pytest.raises(RefusedError) as by_stretches:
        planned(f"{HEAD}steps:\n{steps}")
    monkeypatch.setattr(signals, "AT_ONCE", 10**6)
    with pytest.raises(RefusedError) as at_once:
        planned(f"{HEAD}steps:\n{steps}")
    assert str(by_stretches.value) == str(at_once.value)


@pytest.mark.usefixtures("_small")
def test_a_slope_across_two_stretches_is_refused_at_its_sample():
    u = np.zeros(1000)
    u[77 * 3 :] = 2.0
    device, limits = ScriptedDevice(), Limits(-5.0, 5.0, slew_v_per_s=100.0)
    with pytest.raises(RefusedError, match=r"at sample 231 ") as at_once:
        device.check(u, 1000.0, limits)
    with pytest.raises(RefusedError) as by_stretches:
        device.check(joined([u[:500], u[500:]]), 1000.0, limits)
    assert str(by_stretches.value) == str(at_once.value)
    late = u.copy()
    late[900] = np.nan
    with pytest.raises(RefusedError, match=r"sample 900 is nan"):
        device.check(joined([late[:500], late[500:]]), 1000.0, Limits(-5.0, 5.0))


@pytest.mark.usefixtures("_small")
def test_a_long_run_records_what_a_short_one_records(whole, tmp_path: Path, monkeypatch):
    (tmp_path / "p.yaml").write_text(HEAD + STEPS)
    long = session.record(tmp_path / "p.yaml", None, tmp_path / "long.h5", lambda done, total: None)
    monkeypatch.setattr(signals, "AT_ONCE", 10**6)
    short = session.record(tmp_path / "p.yaml", None, tmp_path / "short.h5", lambda done, total: None)
    assert long.outcome.complete
    assert short.outcome.complete
    one, other = read(long.paths[0]), read(short.paths[0])
    for name in ("u", "y", "ledger"):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name


@pytest.mark.usefixtures("_small")
def test_what_is_played_again_is_cut_from_a_long_plan_too(whole):
    long = planned()
    again, expected = retry.again(long, 4000), retry.again(whole, 4000)
    assert again is not None
    assert expected is not None
    assert isinstance(again.u, Stored)
    assert np.array_equal(again.u[:], expected.u)
    assert again.steps == expected.steps


@pytest.mark.usefixtures("_small")
def test_an_amplifier_stands_behind_a_long_signal_too(whole):
    device = AmplifiedDevice(ScriptedDevice(), Amplifier(2.0, 20.0))
    one, other = device.quantise(planned().u), device.quantise(whole.u)
    assert isinstance(one, Stored)
    assert np.array_equal(one[:], other[:])


@pytest.mark.usefixtures("_small")
def test_what_takes_long_to_draw_is_drawn_once():
    asked = []

    def at(start: int, stop: int) -> np.ndarray:
        asked.append((start, stop))
        return np.arange(start, stop, dtype=np.float64)

    signal = drawn_once(500, at)
    assert asked[-1][1] == 500
    del asked[:]
    assert np.array_equal(signal[13:401], np.arange(13.0, 401.0))
    assert np.array_equal(signal[:], np.arange(500.0))
    assert not asked


@pytest.mark.usefixtures("_small")
def test_what_is_told_of_a_signal_is_what_numpy_tells():
    u = np.random.default_rng(3).integers(-9, 10, 2000).astype(np.float64)
    long = joined([u[:1], u[1:900], u[900:]])
    found = extremes(long)
    assert (found.low_v, found.high_v) == (u.min(), u.max())
    assert found.low_at == int(np.flatnonzero(u == u.min())[-1])
    assert found.high_at == int(np.flatnonzero(u == u.max())[-1])
    moves = np.abs(np.diff(u, prepend=4.0))
    assert steepest(long, 4.0) == moves.max()
    assert first_steeper(long, 4.0, 16.5) == int(np.argmax(moves > 16.5))
    assert first_steeper(long, 4.0, 100.0) == u.size
    assert alike(long, u)
    assert not alike(long, u[:-1])
    changed = u.copy()
    changed[1999] += 1.0
    assert not alike(long, changed)
    at, values = outlined(long)
    assert at.size == values.size
    assert (values.min(), values.max()) == (u.min(), u.max())
    assert 0 <= at[0] <= at[-1] <= u.size
