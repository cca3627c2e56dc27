"""What is known of a run at this moment, of all that was recorded so far, in memory that does not grow?"""

import time
from collections import deque
from dataclasses import dataclass
from math import ceil
from typing import final

import numpy as np

from identify.identification import Branch
from identify.staircase import classified
from rig.errors import FileError, MisfitError
from rig.limits import Limits
from rig.live.dwells import Dwells
from rig.live.envelope import LATEST, Envelope, Hull, Latest, Means
from rig.live.following import About, Following, Stretch
from rig.live.plain import Squares, plain_of
from rig.protocol import limits_in
from rig.recorded import Entry

SECONDS, LEAST = 2.0, 200  # that are looked at closely, as far as Latest holds so many; and samples at least
PACE_S = 5.0  # over which it is judged how fast a run goes
SETTLING_S = 0.05  # where no model tells it
OWN = ("u", "y", "x", "v")
FURTHER_MOST = 4


@dataclass(frozen=True)
class Point:
    """A settled dwell as it lies in the loop: v by the model, the mean of y, V, and the branch it ends on."""

    v_v: float
    y_v: float
    branch: Branch


@final
class Watch:
    """All that a page shows of one recording: it takes the samples as they come, and keeps what they add up to."""

    def __init__(self, following: Following) -> None:
        """Begin with no samples."""
        self.following, self.about = following, following.about
        self.stands = following.standing()
        self.plain, self.model_words = plain_of(self.about)
        self.limits = _limits(self.about)
        size, rate_hz = self.about.size, self.about.rate_hz
        self.further = following.further[:FURTHER_MOST]
        self.latest = Latest((*OWN, *self.further), min(max(ceil(SECONDS * rate_hz), LEAST), LATEST))
        self.whole = {name: Envelope(size) for name in ("u", "y", "residual")}
        self.means, self.hull, self.squares = Means(size), Hull(), Squares()
        self.dwells = Dwells(ceil((self.plain.settling_s if self.plain else SETTLING_S) * rate_hz))
        self.lost = 0
        self.points: tuple[Point, ...] = ()
        self._pace: deque[tuple[float, int]] = deque()

    @property
    def noise_v(self) -> float | None:
        """Return the noise of a reading: as settled readings show it, else as the rig file says."""
        return self.dwells.noise_v or (self.plain.noise_v if self.plain else None)

    def catch_up(self, for_s: float) -> None:
        """Take what was recorded meanwhile, for about so long; what is left is taken the next time."""
        until = time.monotonic() + for_s
        self.stands = self.following.standing()
        self._keep_pace()
        for stretch in self.following.news(self.stands):
            self._take(stretch)
            if time.monotonic() > until:
                break
        self.points = self._points()

    @property
    def behind(self) -> int:
        """Return how many samples were recorded and not looked at yet."""
        return self.stands.acknowledged - self.following.position

    def left_s(self) -> float | None:
        """Return how long the run still takes at the pace of the last seconds; None where there is none yet."""
        (before_s, before), (now_s, now) = self._pace[0], self._pace[-1]
        left = self.about.size - self.stands.acknowledged
        return left * (now_s - before_s) / (now - before) if now > before else None

    def _points(self) -> tuple[Point, ...]:
        """Return the settled dwells and the branch each ends on; those of one level where no model tells v."""
        found = self.dwells.found
        if not found:
            return ()
        gain = self.plain.model.g1.dc_gain if self.plain else 1.0
        levels, means = (np.array([getattr(dwell, name) for dwell in found]) for name in ("level_v", "mean_v"))
        errors = (self.noise_v or 0.0) / np.sqrt([dwell.count for dwell in found])
        branches = classified(np.sign(gain) * levels, means, errors)
        return tuple(Point(gain * float(u), float(y), branch)
                     for u, y, branch in zip(levels, means, branches, strict=True))

    def _take(self, stretch: Stretch) -> None:
        """Add one stretch to all that is kept."""
        u, first = stretch.u, stretch.first
        came = stretch.entries == Entry.RECORDED
        y = np.where(came, stretch.inputs["y"], np.nan)
        x, v = self.plain.answer(u) if self.plain else (np.full(u.size, np.nan), u)
        residual = y - x
        self.lost += int(np.count_nonzero(stretch.entries == Entry.LOST))
        for name, values in (("u", u), ("y", y), ("residual", residual)):
            self.whole[name].add(first, values)
        self.latest.add(first, {"u": u, "y": y, "x": x, "v": v} | {name: stretch.inputs[name] for name in self.further})
        self.means.add(first, residual)
        self.hull.add(v, y)
        self.squares.add(residual)
        self.dwells.add(u, np.where(came, y, 0.0), came)

    def _keep_pace(self) -> None:
        """Note how far the run is now."""
        now_s = time.monotonic()
        self._pace.append((now_s, self.stands.acknowledged))
        while len(self._pace) > 2 and self._pace[1][0] < now_s - PACE_S:
            self._pace.popleft()



def _limits(about: About) -> Limits | None:
    """Return the limits of the protocol that is played, None where none can be told."""
    try:
        return limits_in(about.protocol_text)
    except (FileError, MisfitError, KeyError, TypeError):  # the text may be anybody's
        return None
