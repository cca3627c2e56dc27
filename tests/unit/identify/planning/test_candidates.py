"""Is only offered what fits the limits, moves the gap, keeps off the mains, and repeats exactly?"""

from dataclasses import replace

import numpy as np
import pytest

from identify.model import Backlash, CurvedBacklash, LinearF, Model, Rational
from identify.planning.advice import mains_hit
from identify.planning.candidates import Chord, Offer, Room, Stairs, Tone, offered, rounded
from identify.planning.gap import Gap
from identify.planning.sampling import one_two_five, usual_rate_hz

MODEL = Model(
    "op-amp", Rational((1000.0,), (1e-4, 20.0, 1000.0)), Backlash(8.0, 1.25, 8.0, -1.25),
    Rational((1000.0,), (1e-6, 2.0, 1000.0)), noise_v=0.01,
)  # fmt: skip
ROOM = Room(-10.0, 10.0, 10_000.0, 60.0, reading_v=20.0)
AROUND = replace(MODEL, f=Backlash(1.76, 0.36, 1.76, -1.78))


@pytest.mark.parametrize("model", [MODEL, AROUND, replace(MODEL, f=LinearF())])
@pytest.mark.parametrize("room", [ROOM, replace(ROOM, low_v=-3.0, high_v=4.0), replace(ROOM, slew_v_per_s=900.0)])
def test_everything_stays_within_the_room_and_repeats_exactly(model: Model, room: Room) -> None:
    room = replace(room, rate_hz=2000.0, time_s=20.0)
    found = offered(model, room).candidates()
    assert found
    for candidate in found:
        u = candidate.drawn(room.rate_hz)
        assert room.low_v <= u.min()
        assert u.max() <= room.high_v
        assert np.max(np.abs(np.diff(u, prepend=0.0))) * room.rate_hz <= room.slew_v_per_s
        assert u.size == pytest.approx(candidate.time_s * room.rate_hz, abs=1e-6 * u.size)


def test_sines_move_the_gap_off_the_mains() -> None:
    found = offered(MODEL, ROOM).candidates()
    tones = [c for c in found if isinstance(c, Tone)]
    assert len({t.frequency_hz for t in tones}) >= 8
    gap = Gap(8.0, 1.25, 8.0, -1.25)
    for tone in tones:
        assert mains_hit(tone.frequency_hz) is None
        s = 2j * np.pi * tone.frequency_hz
        v = tone.amplitude_v * abs(np.polyval(MODEL.g1.num, s) / np.polyval(MODEL.g1.den, s))
        assert gap.excess(0.0, v, -v) > 1.1
        assert tone.time_s * ROOM.rate_hz == pytest.approx(round(tone.time_s * ROOM.rate_hz), abs=1e-6)
    assert all(mains_hit(f) is None for c in found if isinstance(c, Chord) for f in c.frequencies_hz)


def test_levels_keep_off_known_rails_and_within_the_reading() -> None:
    railed = Offer(MODEL, ROOM, (-9.0, 10.0))
    assert railed.reach_v == pytest.approx((-2.375, 2.5))
    assert max(max(c.levels_v) for c in railed.candidates() if isinstance(c, Stairs)) < 2.375
    assert Offer(MODEL, ROOM).reach_v == pytest.approx((-3.75, 3.75))


def test_an_off_centre_gap_is_played_about_its_middle() -> None:
    offer = Offer(AROUND, ROOM)
    assert offer.centre_v == pytest.approx(-0.71)
    assert offer.needed_v == pytest.approx(1.07)
    assert Offer(MODEL, ROOM).centre_v == 0.0


def test_a_readable_walk_meets_either_border_twice() -> None:
    walks = [c for c in offered(MODEL, ROOM).candidates() if isinstance(c, Stairs) and c.readable]
    assert walks
    for walk in walks:
        assert walk.dwell_s >= 1.4 * 0.2
        v = np.tile(walk.levels_v, 2)
        w = Gap(8.0, 1.25, 8.0, -1.25).passed(v)[len(walk.levels_v) :]
        v = v[len(walk.levels_v) :]
        for crossing in (1.25, -1.25):
            assert np.unique(v[np.isclose(w, 8.0 * (v - crossing))]).size >= 2


def test_what_cannot_be_offered_is_refused_with_what_it_takes() -> None:
    with pytest.raises(ValueError, match=r"takes 1.25 V about 0 V, 1 V are allowed; widen the limit"):
        offered(MODEL, replace(ROOM, low_v=-1.0, high_v=1.0))
    bent = CurvedBacklash(((0.0, 0.0), (1.0, 1.0)), ((-1.0, 0.0), (0.0, 1.0)))
    with pytest.raises(ValueError, match="straight borders"):
        offered(replace(MODEL, f=bent), ROOM)


@pytest.mark.parametrize(
    ("value", "up", "expected"),
    [(1.2345, False, 1.23), (1.2345, True, 1.24), (-1.2345, False, -1.23), (-1.2345, True, -1.24), (0.0, True, 0.0),
     (286.0, True, 286.0)],
)  # fmt: skip
def test_numbers_are_rounded_towards_zero_or_away_from_it(value: float, up: bool, expected: float) -> None:
    assert rounded(value, up=up) == expected


@pytest.mark.parametrize(("value", "expected"), [(1.0, 1.0), (1.9, 1.0), (2.0, 2.0), (7.0, 5.0), (0.03, 0.02)])
def test_one_two_five(value: float, expected: float) -> None:
    assert one_two_five(value) == expected


def test_the_usual_rate_shows_the_corners_that_matter() -> None:
    assert usual_rate_hz(MODEL, 1e6) == 10_000.0
    assert usual_rate_hz(MODEL, 3000.0) == 2000.0
    assert usual_rate_hz(replace(MODEL, g1=Rational((1.0,), (1.0,)), g2=Rational((1.0,), (1.0,))), 1e6) == 1000.0
