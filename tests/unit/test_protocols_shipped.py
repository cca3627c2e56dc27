"""Does every shipped protocol open with its question, plan without remarks, and do on its rig what its comments say?"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import protocols
from identify.holdout import settling_s
from identify.noise import noise_of
from identify.simulate import Player
from identify.trace import Array, Step, Trace
from rig.plan import Plan, plan
from rig.protocol import read_protocol
from rig.rigfile import RigFile, read_rig

SHIPPED = Path(protocols.__path__[0])
NAMES = sorted(path.name for path in SHIPPED.glob("*.yaml"))
OPAMP = [name for name in NAMES if "opamp" in (SHIPPED / name).read_text()]
FIG13_V = [-3, -2.5, -2, -1.5, -1, -0.5, 0, 0.5, 1, 1.5, 2, 2.5, 3,
           2.5, 2, 1.5, 1, 0.5, 0, -0.5, -1, -1.5, -2, -2.5, -3, -3.5]


def planned(name: str) -> Plan:
    return plan(read_protocol(SHIPPED / name))


def rig_of(name: str) -> RigFile:
    rig = read_protocol(SHIPPED / name).rig
    assert rig is not None
    return rig


def answer(name: str, concealed: bool = True) -> tuple[Plan, Array]:
    """Return the plan and what its rig answers without noise."""
    rig, made = rig_of(name), planned(name)
    physics = (*rig.model.physics, *(rig.concealed if concealed else ()))
    return made, Player(replace(rig.model, physics=physics, noise_v=None), made.rate_hz).play(made.u)


def last_pass(made: Plan, label: str, y: Array) -> Array:
    step = next(step for step in reversed(made.steps) if step.label == label)
    return y[step.start:step.stop]


def gap_peak_v(name: str, frequency_hz: float, amplitude_v: float) -> float:
    """Return V = U |G1|, the amplitude at the gap."""
    g1, s = rig_of(name).model.g1, 2j * np.pi * frequency_hz
    return float(amplitude_v * abs(np.polyval(g1.num, s) / np.polyval(g1.den, s)))


def test_the_protocols_of_the_charter_are_there() -> None:
    assert {"demo.yaml", "fig13_staircase.yaml", "sine_50hz.yaml", "sine_ladder.yaml", "paper_simulation_sines.yaml",
            "paper_simulation_staircase.yaml"} <= set(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_it_opens_with_its_question_and_samples_it_exactly(name: str) -> None:
    made = planned(name)
    assert (SHIPPED / name).read_text().startswith("# Question: ")
    assert made.question.endswith("?")
    assert all("settles to" in note for note in made.notes)
    assert made.device is not None
    assert made.device.startswith("loopback:")


@pytest.mark.parametrize("path", sorted((SHIPPED / "rigs").glob("*.yaml")), ids=lambda path: path.stem)
def test_every_rig_reads(path: Path) -> None:
    assert path.read_text().startswith("# ")
    assert read_rig(path).model.noise_v


def test_fig13_is_the_walk_of_the_paper_and_settles_on_every_level() -> None:
    made, y = answer("fig13_staircase.yaml")
    dwell = made.u.size // 26
    assert made.u[::dwell].tolist() == FIG13_V
    assert made.u.size == 26 * dwell
    levels = y.reshape(26, dwell)
    step = np.abs(np.diff(levels[:, -1], prepend=0.0))
    assert np.all(np.abs(levels[:, -500] - levels[:, -1]) <= 1.1e-3 * np.maximum(step, 0.1))


def test_18_of_the_26_points_of_fig13_sit_on_a_rail_and_none_of_their_0_6_fold() -> None:
    made, y = answer("fig13_staircase.yaml")
    ends = y.reshape(26, -1)[:, -1]
    assert np.count_nonzero(np.abs(ends) > 9.99) == 18
    made, y = answer("demo.yaml")
    assert np.abs(last_pass(made, "0.6 of Fig. 13", y)).max() < 8.0
    assert np.abs(last_pass(made, "Fig. 13", y)).max() == pytest.approx(10.0, abs=1e-6)


def test_the_paper_s_staircase_gives_the_points_known_of_eq_40c() -> None:
    made, y = answer("paper_simulation_staircase.yaml")
    ends = y.reshape(26, -1)[:, -200:].mean(axis=1)
    assert made.u.reshape(26, -1)[:, 0].tolist() == FIG13_V
    assert ends[3] == pytest.approx(-2.147, abs=1e-3)
    assert ends[15] == pytest.approx(4.646, abs=1e-3)


@pytest.mark.parametrize(("label", "samples"), [("w1", 640), ("5 w1", 128), ("10 w1", 64)])
def test_the_paper_s_sines_have_100_periods_of_whole_samples(label: str, samples: int) -> None:
    made = planned("paper_simulation_sines.yaml")
    step = next(step for step in made.steps if step.label == label)
    u = made.u[step.start:step.stop]
    assert u.size == 100 * samples
    assert np.array_equal(u, np.tile(u[:samples], 100))
    assert made.peak_v == 3.5


def test_at_50_hz_the_gap_moves_and_at_100_hz_it_would_not() -> None:
    assert gap_peak_v("sine_50hz.yaml", 50.0, 10.0) == pytest.approx(1.572, abs=1e-3)
    assert gap_peak_v("sine_50hz.yaml", 100.0, 10.0) < 1.25
    made, y = answer("sine_50hz.yaml")
    assert np.ptp(last_pass(made, "sine 50 Hz 10 V", y)) > 4.0


def test_every_rung_of_the_ladder_moves_the_gap_and_only_one_meets_the_rails() -> None:
    made, y = answer("sine_ladder.yaml")
    _, plain = answer("sine_ladder.yaml", concealed=False)
    on_rails = {s.label for s in made.steps if np.abs(y[s.start:s.stop] - plain[s.start:s.stop]).max() > 1e-3}
    assert on_rails == {"16 Hz onto the rails"}
    assert all(np.ptp(y[s.start:s.stop]) > 3.0 for s in made.steps)


def test_the_ladder_has_two_amplitudes_at_every_frequency_off_the_mains() -> None:
    steps = read_protocol(SHIPPED / "sine_ladder.yaml").steps
    sines = [(step.stimulus.frequency, step.stimulus.amplitude) for step in steps]  # type: ignore[attr-defined]
    for frequency in {frequency for frequency, _ in sines}:
        assert len({amplitude for f, amplitude in sines if f == frequency}) >= 2
        assert all(abs(n * frequency % mains) > 0.5 for n in range(1, 15) for mains in (50.0, 60.0))


@pytest.mark.parametrize("name", ["sine_ladder.yaml", "demo.yaml"])
def test_the_second_pass_of_a_sine_is_free_of_the_transient(name: str) -> None:
    made = planned(name)
    once = next(step for step in made.steps if step.kind == "sine")
    u = made.u[once.start:once.stop]
    passes = Player(replace(rig_of(name).model, noise_v=None), made.rate_hz).play(np.tile(u, 3)).reshape(3, -1)
    assert np.abs(passes[1] - passes[0]).max() > 1e-2
    assert np.abs(passes[2] - passes[1]).max() < 1e-6


@pytest.mark.parametrize("name", NAMES)
def test_the_noise_can_be_told_from_what_repeats_in_it(name: str) -> None:
    rig, made = rig_of(name), planned(name)
    y = Player(rig.model, made.rate_hz, seed=1).play(made.u)
    steps = tuple(Step(step.label, step.kind, step.start, step.stop, step.repeat) for step in made.steps)
    found = noise_of([Trace(name, made.rate_hz, made.u, y, steps=steps)], settling_s(rig.model), declared_v=None)
    assert found.origin in ("repeated periods", "settled dwells")
    assert found.rms_v == pytest.approx(rig.model.noise_v, rel=0.05)


def test_the_demo_is_short_enough_to_fit_while_one_waits() -> None:
    assert planned("demo.yaml").duration_s <= 15.0
    assert planned("demo_hold_out.yaml").duration_s <= 5.0
    assert {step.kind for step in planned("demo.yaml").steps} == {"staircase", "sine"}
    assert max(step.repeat for step in planned("demo.yaml").steps) == 1


def test_while_the_gap_is_stuck_nothing_moves_at_either_level() -> None:
    made, y = answer("stuck_state_sine.yaml")
    for step in made.steps:
        if step.kind == "sine":
            held = y[(step.start + step.stop) // 2:step.stop]
            assert np.ptp(held) < 1e-3 * abs(held[0]) + 1e-12
            assert held[0] == pytest.approx(6.0 if step.label == "stuck at 6 V" else 0.0, abs=1e-2)


@pytest.mark.parametrize(
    "name", ["quick_check", "minor_loops", "hold_ladder", "rate_ladder", "multisine", "repeat_later"])
def test_the_gap_moves_and_no_rail_is_met_where_that_is_promised(name: str) -> None:
    made, y = answer(f"{name}.yaml")
    assert np.abs(y).max() < 9.5
    moved = {s.label for s in made.steps if np.ptp(y[s.start:s.stop]) > 3.0}
    assert moved == {s.label for s in made.steps if s.kind != "hold"}


def test_every_rung_of_the_rate_ladder_reaches_the_same_level_at_the_gap() -> None:
    made, y = answer("rate_ladder.yaml")
    peaks = [np.ptp(y[s.start:s.stop]) / 16.0 + 1.25 for s in made.steps if s.repeat == 1]
    assert peaks == pytest.approx([2.2] * 4, abs=0.06)


def test_held_levels_of_the_ladder_lie_on_plateaus() -> None:
    made, y = answer("hold_ladder.yaml")
    for step in made.steps:
        _, on_plateau, _, other = np.split(y[step.start:step.stop], 4)
        assert on_plateau[-1] == pytest.approx(6.0, abs=0.01)
        assert other[-1] == pytest.approx(-6.0, abs=0.01)


def test_a_symmetric_gap_answers_the_multisine_on_odd_lines_only() -> None:
    made, y = answer("multisine.yaml")
    last = last_pass(made, "3.2 V", y)
    lines = np.abs(np.fft.rfft(last))[: 3 * 60 : 3]
    assert lines[2::2].max() < 1e-6 * lines[1::2].max()


def test_the_cable_is_a_cable() -> None:
    made, y = answer("loopback_cable.yaml")
    assert np.array_equal(y[1:], made.u[:-1])
