"""By how much did each number change between two recordings, and is that more than both doubts together?

The interval of a difference is had from the two intervals (Zou and Donner, Statistics in Medicine 27 (2008) 1693), so
that lopsided and open ones count as what they are. Of many numbers tested at once some seem to change by chance: Holm's
rule (Scandinavian Journal of Statistics 6 (1979) 65) bounds how often any does.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import copysign, hypot, inf, isfinite, sqrt
from typing import Literal

from scipy.stats import chi2, f, t

from identify.fit import Fit
from identify.identification import Identification
from identify.interval import Interval, number
from identify.noise import Noise
from identify.uncertainty.propagation import Z95

FALSE_ALARMS = 0.01  # share of pairs of recordings of an unchanged bench in which any change is claimed
NOISE = "noise"
UNTOLD = 15.0  # ratio of the ends of a positive number's interval from which it is hardly told at all
UNITS = {"F.S_L": "V/V", "F.S_U": "V/V", "F.D_L": "V", "F.D_U": "V", "F.gain": "V/V", "F.offset": "V"}

State = Literal["changed", "no change seen", "cannot tell", "not told"]


@dataclass(frozen=True)
class Change:
    """One number before and after, and what it changed by, each with its 95 % interval, in ``unit``.

    ``p_value`` is that of this number alone; ``adjusted`` counts in that others were tested beside it.
    """

    name: str
    unit: str
    before: Interval
    after: Interval
    by: Interval
    p_value: float
    state: State = "no change seen"
    adjusted: float = 1.0

    @property
    def standard_errors(self) -> float:
        """Return by how many standard errors it changed, with its sign."""
        end = self.by.low if self.by.value > 0.0 else self.by.high
        half = abs(self.by.value - end)
        if self.by.value == 0.0:
            return 0.0
        return Z95 * self.by.value / half if half > 0.0 else copysign(inf, self.by.value)

    def to_dict(self) -> dict[str, object]:
        """Return the form of ``rig compare --json``."""
        return {
            "name": self.name, "unit": self.unit, "state": self.state, "before": self.before.to_dict(),
            "after": self.after.to_dict(), "change": self.by.to_dict(),
            "standard_errors": number(self.standard_errors, 4), "p_value": number(self.p_value, 3),
            "p_adjusted": number(self.adjusted, 3),
        }  # fmt: skip


def difference(before: Interval, after: Interval) -> Interval:
    """Return what was added, with its 95 % interval; open where an end of either is."""
    by = after.value - before.value
    low = by - hypot(after.value - after.low, before.high - before.value)
    return Interval(by, low, by + hypot(after.high - after.value, before.value - before.low))


def changes(before: Identification, after: Identification) -> tuple[Change, ...]:
    """Return every number both identifications have, the noise of a reading last, each tested among all."""
    freedom = min(before.noise.freedom, after.noise.freedom)
    found = [_parameter(name, before, after, freedom) for name in _both(before, after)]
    return among_all([*found, _noise(before.noise, after.noise)])


def among_all(found: Sequence[Change]) -> tuple[Change, ...]:
    """Return the changes with their p-values adjusted for all that were tested, by Holm's rule, and judged."""
    tested = sorted((c for c in found if c.state != "not told"), key=lambda c: c.p_value)
    judged, least = {}, 0.0
    for rank, change in enumerate(tested):
        least = max(least, min(1.0, (len(tested) - rank) * change.p_value))
        state: State = "changed" if least < FALSE_ALARMS else "no change seen"
        judged[change.name] = replace(change, state=state, adjusted=least)
    return tuple(judged.get(c.name, c) for c in found)


def _both(before: Identification, after: Identification) -> list[str]:
    """Return the names of the numbers that both fits could move; all dead times are G2's."""
    sides = [found.certainty for found in (before, after)]
    moved = [set(side.names) | {"G2.dead_time"} if side else set() for side in sides]
    known = sides[0].values if sides[0] else {}
    return [name for name in known if name in moved[0] & moved[1] and not _is_none(name, before, after)]


def _is_none(name: str, before: Identification, after: Identification) -> bool:
    """Return whether a dead time is none on both sides, and was not looked for."""
    return name == "G2.dead_time" and before.delay.high == after.delay.high == 0.0


def _parameter(name: str, before: Identification, after: Identification, freedom: float) -> Change:
    """Return the change of one number of the model."""
    ends = [_interval(name, found) for found in (before, after)]
    by = difference(ends[0], ends[1])
    change = Change(name, unit_of(name, before), ends[0], ends[1], by, 1.0)
    if any(not _is_told(name, interval, found.fit) for interval, found in zip(ends, (before, after), strict=True)):
        return replace(change, state="not told")
    return replace(change, p_value=2.0 * float(t.sf(abs(change.standard_errors), freedom)))


def _interval(name: str, found: Identification) -> Interval:
    assert found.certainty is not None
    return found.delay if name == "G2.dead_time" else found.certainty.interval(name)


def _is_told(name: str, interval: Interval, fit: Fit) -> bool:
    """Return whether a recording tells a number at all, and not the bound of its search."""
    if not (isfinite(interval.low) and isfinite(interval.high)):
        return False
    if ".den." not in name:
        return True
    if interval.low <= 0.0 or interval.high > UNTOLD * interval.low:
        return False
    block = f"{name.partition('.')[0]}.den."
    searched = zip(fit.coordinates, fit.theta, strict=True)
    return not any(c.at_bound(float(theta)) for c, theta in searched if c.name.startswith(block))


def unit_of(name: str, found: Identification) -> str:
    """Return the SI unit of a number of a model."""
    if name in UNITS:
        return UNITS[name]
    if name.endswith("dead_time"):
        return "s"
    if (power := name.rpartition(".s")[2]).isdigit() and name.startswith(("G1.", "G2.")):
        return f"s^{power}" if power != "1" else "s"
    units = {p.name: p.unit for p in found.fit.chain.parameters() if not name.startswith(("G1.", "G2."))}
    return units.get(name.partition("[")[0], "V" if name.startswith("F.") else "")


def _noise(before: Noise, after: Noise) -> Change:
    """Return the change of the noise of a reading: Fisher's test of two variances, where both were measured."""
    ends = [noise_interval(noise) for noise in (before, after)]
    change = Change(NOISE, "V", ends[0], ends[1], difference(ends[0], ends[1]), 1.0)
    if not (isfinite(before.freedom) and isfinite(after.freedom)):
        return replace(change, state="not told")
    ratio = (after.rms_v / before.rms_v) ** 2
    tails = (f.sf(ratio, after.freedom, before.freedom), f.cdf(ratio, after.freedom, before.freedom))
    return replace(change, p_value=min(1.0, 2.0 * float(min(tails))))


def noise_interval(noise: Noise) -> Interval:
    """Return the noise of a reading, V, with its 95 % interval, as well as its independent readings tell it."""
    if not isfinite(noise.freedom):
        return Interval(noise.rms_v, noise.rms_v, noise.rms_v)
    low, high = (noise.rms_v * sqrt(noise.freedom / float(chi2.ppf(q, noise.freedom))) for q in (0.975, 0.025))
    return Interval(noise.rms_v, low, high)
