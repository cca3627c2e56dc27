"""Which values did these recordings not reach, and which step would reach them?

A value is not determined where its interval says hardly more than the rig file did. What is said of it comes from where
F has been, from where the poles lie against the band and the length of the recordings, and from what moves with it.
"""

from collections.abc import Callable, Sequence
from math import pi

import numpy as np

from identify.bent.curved import SIDES
from identify.fit import Fit
from identify.harmonic.harmonics import threshold_v
from identify.harmonic.separability import Tone, at
from identify.identifiability.directions import NEEDED_LOG, together, undetermined
from identify.identifiability.visits import Range, Visits
from identify.identification import Branch, StairPoint, Unidentifiable
from identify.model import Backlash
from identify.natural_units import shown
from identify.observe import Observation
from identify.staircase import border
from identify.uncertainty.normalised import rational_of
from identify.uncertainty.propagation import propagated

STAIRCASE = "protocols/fig13_staircase.yaml"
KEPT = "nothing but the rig file's values"
SIDE_OF = {"num": "numerator", "den": "denominator"}
LEVELS = 2  # settled levels a border needs


def unexcited(
    fit: Fit, observations: Sequence[Observation], tones: Sequence[Tone], where: Visits | None
) -> list[Unidentifiable]:
    """Return every value that is not determined; ``where`` F has been is None for a rig without straight borders."""
    names, still = set(undetermined(fit)), where is not None and not where.moved
    found: list[Unidentifiable] = []
    if where is not None and still and names & {"F.S_L", "F.D_L", "F.S_U", "F.D_U"}:
        found.append(_never_moved(fit, tones, where))
        names -= {"F.S_L", "F.D_L", "F.S_U", "F.D_U"}
    elif where is not None:
        for side in SIDES:
            members = names & {f"F.S_{side}", f"F.D_{side}"}
            found += [_border(fit, side, where)] if members else []
            names -= members
    for block in ("G1", "G2"):
        poles = _poles(fit, block, observations, still) if any(n.startswith(f"{block}.den") for n in names) else []
        found += poles
        names = {n for n in names if not (poles and n.startswith(f"{block}.den"))}
    return found + _others(fit, names)


def _borders(fit: Fit) -> Backlash:
    """Return the borders of the fit."""
    return Backlash(*(fit.chain.values[f"F.{name}"] for name in ("S_L", "D_L", "S_U", "D_U")))


def _never_moved(fit: Fit, tones: Sequence[Tone], where: Visits) -> Unidentifiable:
    """Return that the gap was never crossed, and the amplitude that crosses it."""
    f, before = _borders(fit), rational_of(fit.chain, "G1")
    level_v = max(f.d_l_v, -f.d_u_v) / abs(before.dc_gain)
    freeing = ((hz, threshold_v(f) / float(abs(at(before, hz)))) for hz in [t.frequency_hz for t in tones[:4]])
    sines = ", ".join(f"{shown(hz, 'Hz')} above {shown(least_v, 'V', 3)}" for hz, least_v in freeing)
    more = f", or a sine of {sines}" if sines else ""
    return Unidentifiable(
        "borders of F: S_L, D_L, S_U, D_U",
        f"F never moved: v stayed between {shown(where.v.low, 'V', 3)} and {shown(where.v.high, 'V', 3)}, inside the "
        f"gap the rig file gives, {shown(f.d_u_v, 'V', 3)} to {shown(f.d_l_v, 'V', 3)}",
        f"{KEPT}; levels of u beyond +-{shown(level_v, 'V', 3)} ({STAIRCASE}){more}",
    )


def _border(fit: Fit, side: str, where: Visits) -> Unidentifiable:
    """Return that one border was not touched, or over too short a stretch to tell its slope from its place."""
    visited: Range = where.loading if side == "L" else where.unloading
    level = _reaching(fit, side, where)
    if visited.empty:
        return Unidentifiable(
            f"{SIDES[side]} border: S_{side}, D_{side}", f"F never touched its {SIDES[side]} border",
            f"{KEPT}; at least {LEVELS} levels of u {level} ({STAIRCASE})",
        )  # fmt: skip
    return Unidentifiable(
        f"S_{side} against D_{side}",
        f"F touched its {SIDES[side]} border from v = {shown(visited.low, 'V')} to {shown(visited.high, 'V')} "
        "only, where a steeper border further away looks the same",
        f"at least {LEVELS} levels of u {level}, half a gap apart ({STAIRCASE})",
    )


def _reaching(fit: Fit, side: str, where: Visits) -> str:
    """Return which levels of u reach a border from the far end of where F has been."""
    f, gain = _borders(fit), rational_of(fit.chain, "G1").dc_gain
    v = f.d_l_v + where.w.low / f.s_l if side == "L" else f.d_u_v + where.w.high / f.s_u
    above = (side == "L") == (gain > 0.0)
    return f"{'above' if above else 'below'} {shown(v / gain, 'V', 3)}"


def few_levels(stairs: Sequence[StairPoint], tones: Sequence[Tone]) -> list[Unidentifiable]:
    """Return the borders whose slope rests on transients: a single settled level, and no sine to help."""
    found = []
    for side, branch in SIDES.items():
        levels = {point.level_v for point in stairs if point.branch == branch}
        if not tones and 0 < len(levels) < LEVELS:
            found.append(Unidentifiable(
                f"S_{side} against D_{side}, from settled levels alone",
                f"only the level {shown(min(levels), 'V', 3)} of the staircase ended on the {branch} border, so the "
                "border's slope rests on the transients",
                f"the orders of G1 and G2 in the rig file; a staircase with {LEVELS} levels or more on each border, as "
                f"{STAIRCASE}",
            ))  # fmt: skip
    return found


def railed(stairs: Sequence[StairPoint]) -> list[Unidentifiable]:
    """Return that points of a staircase rest on a rail, and the levels that keep clear of it."""
    points = [p for p in stairs if p.branch == "saturated"]
    if not points:
        return []
    readings = sorted({shown(p.mean_v.value, "V", 2) for p in points})
    short_v = [abs(v) for v in (_meets(stairs, "loading", max), _meets(stairs, "unloading", min)) if v is not None]
    reached_v = max(abs(p.level_v) for p in stairs)
    scale = f" (`scale: {min(short_v) / reached_v:.2g}`)" if short_v else ""
    bound = f"short of +-{shown(min(short_v), 'V', 3)}{scale}" if short_v else "that are smaller"
    others = sum(point.branch in SIDES.values() for point in stairs)
    return [Unidentifiable(
        f"borders beyond the rails: {len(points)} of {len(stairs)} points of the staircase",
        f"they read {' and '.join(readings)} whatever the level: a rail stops them, and not a border",
        f"the {others} points that lie on a border; more of them in a staircase with levels {bound}, as in "
        "protocols/demo.yaml",
    )]  # fmt: skip


def _meets(stairs: Sequence[StairPoint], branch: Branch, furthest: Callable[[list[float]], float]) -> float | None:
    """Return the level of u, V, at which one border, as the settled levels show it, meets its rail."""
    line = border(stairs, branch)
    if line is None:
        return None
    rail_v = furthest([p.mean_v.value for p in stairs if p.branch == "saturated"])
    return line.crossing_v + rail_v / line.slope


def _poles(fit: Fit, name: str, observations: Sequence[Observation], still: bool) -> list[Unidentifiable]:
    """Return the poles of a block whose place these recordings do not tell."""
    sizes = propagated(fit, lambda chain: np.sort(np.log(np.abs(np.roots(rational_of(chain, name).den)))))
    untold = sorted({float(f"{np.exp(v):.6g}") for v, sd in zip(sizes.value, sizes.sd, strict=True) if sd > NEEDED_LOG})
    return [_pole(fit, name, per_s, observations, still) for per_s in untold]


def _pole(fit: Fit, name: str, per_s: float, observations: Sequence[Observation], still: bool) -> Unidentifiable:
    """Return why one pole is not told, and what would tell it."""
    hz, tau_s = per_s / (2.0 * pi), 1.0 / per_s
    rate_hz = max(o.trace.rate_hz for o in observations)
    longest_s = max(o.trace.size / o.trace.rate_hz for o in observations)
    if hz > 0.5 * rate_hz:
        why = f"it lies above half the sample rate, {shown(0.5 * rate_hz, 'Hz')}: only the delay it makes shows"
        would = f"sampling above {shown(4.0 * hz, 'Hz', 2)} with steps or a sine near {shown(hz, 'Hz', 2)}"
    elif tau_s > 0.5 * longest_s:
        why = f"its time constant of {shown(tau_s, 's', 3)} is long against the longest run, {shown(longest_s, 's', 3)}"
        would = f"one level held for {shown(4.0 * tau_s, 's', 2)}"
    else:
        why = "F never moved" if still else "nothing that was played reaches it through the noise"
        would = f"sines near {shown(hz, 'Hz', 2)}{_freeing(fit, hz)}, as in protocols/sine_ladder.yaml,"
    return Unidentifiable(
        f"pole of {name} near {shown(hz, 'Hz', 3)}", why, f"{KEPT}; {would} would tell it")


def _freeing(fit: Fit, frequency_hz: float) -> str:
    """Return from which amplitude on a sine moves F, in words; nothing for a rig without straight borders."""
    if "F.D_L" not in fit.chain.values:
        return ""
    reach = float(abs(at(rational_of(fit.chain, "G1"), frequency_hz)))
    return f" above {shown(threshold_v(_borders(fit)) / reach, 'V', 2)}, where the gap moves"


def _others(fit: Fit, names: set[str]) -> list[Unidentifiable]:
    """Return the remaining values, those that move together as one."""
    found, left = [], set(names)
    labels = {c.name: c.parameter.label or _label(c.name) for c in fit.coordinates}
    kept = {c.name: f"{labels[c.name]} {shown(c.centre, _unit(c.parameter.unit))}" for c in fit.coordinates}
    for members in together(fit, sorted(names)):
        named = [name for name in members if name in left]
        if len(members) > 1 and named:
            found.append(Unidentifiable(
                " against ".join(labels[name] for name in members),
                "moved together they leave the recordings as they are",
                f"{KEPT}: {', '.join(kept[name] for name in members)}",
            ))  # fmt: skip
            left -= set(members)
    alone = (Unidentifiable(labels[n], "no run excites it", f"{KEPT}: {kept[n]}") for n in left)
    return found + sorted(alone, key=lambda item: item.what)


def _unit(unit: str) -> str:
    """Return a unit as written behind a number; of a coefficient, whose power of s stands in its name, none."""
    return "" if unit.startswith("s^") else unit


def _label(name: str) -> str:
    """Return what a parameter is called in a report: coefficients of the blocks in words, others by name."""
    block, _, rest = name.partition(".")
    side, _, power = rest.partition(".")
    if side not in SIDE_OF:
        return name
    section, _, power = power.rpartition(".")
    inside = f", {section.replace('section', 'section ')}" if section else ""
    return f"{SIDE_OF[side]} of {block}{inside}, coefficient of {'s' if power == 's1' else power.replace('s', 's^')}"
