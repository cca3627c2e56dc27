"""What should the operator change before the next recording?

The same rules speak before a run, from its plan and the rig file, and after it, from its recording and the fit. A rule
yields one sentence with values, units and what to do.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite

import numpy as np

from identify.fit import Fit
from identify.holdout import SETTLED, settling_s
from identify.identification import StairPoint
from identify.model import Model
from identify.natural_units import shown
from identify.noise import Noise
from identify.planning.excitation import Walk, Wave, excitations
from identify.planning.gap import Gap, excess, fastest_hz, gap_in
from identify.planning.information import Information
from identify.planning.sampling import sampling_advice
from identify.staircase import ENOUGH
from identify.trace import Trace

FITS = 1.1  # residual over noise up to which a model counts as fitting
MAINS_HZ = (50.0, 60.0)
NEAR_HZ = 0.5  # distance from the mains within which a line is taken for hum
LOUD = 0.2  # share of the largest line of a wave above which another is looked at
HARMONICS = 7  # harmonics of a wave that tell something of G2


@dataclass(frozen=True)
class Advice:
    """One sentence to the operator, the rule it comes from, and the step it is about (empty: the whole protocol).

    ``remark``: nothing needs to be changed.
    """

    rule: str
    step: str
    sentence: str
    remark: bool = False

    def to_dict(self) -> dict[str, object]:
        """Return the form of the JSON answers."""
        return {"rule": self.rule, "step": self.step, "sentence": self.sentence, "remark": self.remark}


@dataclass(frozen=True)
class Bench:
    """What the rules know of the rig: the model at its present values, the levels of w at its rails, limits of u."""

    model: Model
    gap: Gap | None
    rails_w: tuple[float, float] = (-np.inf, np.inf)
    limit_v: float | None = None

    @property
    def reach_u(self) -> tuple[float, float]:
        """Return the settled levels of u that keep w off the rails."""
        assert self.gap is not None
        low, high = sorted(v / self.model.g1.dc_gain for v in self.gap.reach(*self.rails_w))
        return low, high


def bench_of(model: Model, values: Mapping[str, float], limit_v: float | None = None) -> Bench:
    """Return what the rules need of a model and of the values of its chain."""
    upper, lower = values.get("saturation.upper", np.inf), values.get("saturation.lower", -np.inf)
    return Bench(model, gap_in(values), (lower, upper), limit_v)


def misfit(rms_v: float, noise: Noise) -> list[str]:
    """Return a warning when the model does not fit: its values and intervals then mean little."""
    if rms_v <= FITS * noise.rms_v:
        return []
    return [
        f"the model leaves {rms_v / noise.rms_v:.3g} times the noise: these are the values of a model that does not "
        "fit; `rig explain` looks for what is missing"
    ]


def unsettled(fit: Fit) -> list[str]:
    """Return a warning when the fit has no minimum."""
    return [] if fit.converged else [f"the fit did not converge: {fit.sentence}"]


def advice(
    bench: Bench, traces: Sequence[Trace], told: Information | None = None, stairs: Sequence[StairPoint] = ()
) -> tuple[Advice, ...]:
    """Return what to change in what was played, or is to be; readings in ``traces`` are not looked at.

    ``stairs`` are the settled levels as read, where there are readings.
    """
    found: dict[str, Advice] = {}
    for trace in traces:
        for asked in excitations(trace):
            rules = _of_wave(bench, asked) if isinstance(asked, Wave) else _of_walk(bench, asked)
            found |= {f"{a.rule} {a.step}": a for a in rules}
    found |= {f"rate {rate_hz}": Advice("rate", "", s, True) for rate_hz, s in _sampling(bench, traces)}
    if not isfinite(max(map(abs, bench.rails_w))):
        found |= {f"rail {a.step}": a for a in _flat(stairs)}
    if any(isinstance(asked, Walk) and _settles(bench, asked) for t in traces for asked in excitations(t)):
        found = {key: replace(a, remark=a.remark or a.rule == "dwell") for key, a in found.items()}
    stuck = {a.step for a in found.values() if a.rule == "stuck gap"}
    return (*found.values(), *(a for a in _silent(told) if a.step not in stuck))


def _sampling(bench: Bench, traces: Sequence[Trace]) -> Iterator[tuple[str, str]]:
    for rate_hz in sorted({trace.rate_hz for trace in traces}):
        for name, block in (("G1", bench.model.g1), ("G2", bench.model.g2)):
            yield from ((f"{rate_hz} {name} {k}", s) for k, s in enumerate(sampling_advice(name, block, rate_hz)))


def _of_wave(bench: Bench, wave: Wave) -> Iterator[Advice]:
    """Yield what is amiss with a periodic step."""
    yield from _mains(wave)
    yield from _folding(wave)
    if bench.gap is None:
        return
    ratio = excess(bench.gap, wave, bench.model.g1)
    if ratio <= 1.0:
        yield Advice("stuck gap", wave.label, _stuck(bench, wave, wave.size_v / ratio))
    else:
        yield from _railed_wave(bench, bench.gap, wave)


def _stuck(bench: Bench, wave: Wave, needed_v: float) -> str:
    """Return the sentence on a wave that leaves the gap stuck, with what frees it."""
    sentence = (
        f"{wave.label}: the gap is stuck at U = {shown(wave.size_v, 'V', 3)}, raise it above {shown(needed_v, 'V', 3)}"
    )
    if bench.limit_v is None or needed_v <= bench.limit_v or not wave.is_sine or bench.gap is None:
        return sentence
    below = fastest_hz(bench.gap, bench.model.g1, bench.limit_v, float(wave.lines_hz[0]))
    limit = shown(bench.limit_v, "V", 3)
    return f"{sentence}, or within {limit} " + (
        f"go below {shown(below, 'Hz', 3)}" if below else "no frequency moves it"
    )


def _railed_wave(bench: Bench, gap: Gap, wave: Wave) -> Iterator[Advice]:
    """Yield a sentence on a wave whose w meets a rail."""
    v = wave.behind(bench.model.g1)
    w = gap.settled(v)
    beyond = (w < bench.rails_w[0]) | (w > bench.rails_w[1])
    if not np.any(beyond):
        return
    centre = wave.offset_v * bench.model.g1.dc_gain
    high, low = wave.swing_behind(bench.model.g1)
    reach = gap.reach(*bench.rails_w)
    allowed = min((reach[1] - centre) / high, (reach[0] - centre) / low)
    do = f"stay below U = {shown(allowed * wave.size_v, 'V', 3)}" if allowed > 0.0 else "move the offset"
    yield Advice(
        "rail", wave.label,
        f"{wave.label}: w is on the rails ({_rails(bench)}) for {100.0 * float(np.mean(beyond)):.0f} % of the time, "
        f"which tells nothing of G1 and the borders; {do}",
    )  # fmt: skip


def _rails(bench: Bench) -> str:
    return " and ".join(shown(level, "V", 3) for level in bench.rails_w if isfinite(level))


def _of_walk(bench: Bench, walk: Walk) -> Iterator[Advice]:
    """Yield what is amiss with a staircase."""
    needed_s = settling_s(bench.model)
    if walk.levels_v.size > 1 and not _settles(bench, walk):
        yield Advice(
            "dwell", walk.label,
            f"{walk.label}: the dwell of {shown(walk.dwell_s, 's', 3)} ends before G1 and G2 settle to "
            f"{100.0 * SETTLED:g} %, which takes {shown(needed_s, 's', 3)}: no level is read settled; "
            f"dwell {shown(1.1 * (needed_s + ENOUGH / walk.rate_hz), 's', 2)}",
        )  # fmt: skip
    if bench.gap is None:
        return
    v = walk.levels_v * bench.model.g1.dc_gain
    w = bench.gap.passed(v)
    if walk.levels_v.size > 1 and not np.ptp(w) > 0.0:
        ratio = bench.gap.excess(0.0, float(np.max(v)), float(np.min(v)))
        yield Advice("stuck gap", walk.label, f"{walk.label}: the gap is stuck on every level, {_wider(walk, ratio)}")
    railed = int(np.count_nonzero((w <= bench.rails_w[0]) | (w >= bench.rails_w[1])))
    if railed:
        low, high = (shown(level, "V", 3) for level in bench.reach_u)
        yield Advice(
            "rail", walk.label,
            f"{walk.label}: {railed} of {walk.levels_v.size} levels end on the rails ({_rails(bench)} of w), which "
            f"tells nothing of the borders; stay between {low} and {high}",
        )  # fmt: skip


def _settles(bench: Bench, walk: Walk) -> bool:
    """Return whether every level is held long enough to be read settled."""
    return walk.dwell_s >= settling_s(bench.model) + ENOUGH / walk.rate_hz


def _wider(walk: Walk, ratio: float) -> str:
    if 0.0 < ratio < float("inf"):
        return f"make them more than {1.0 / ratio:.3g} times as large"
    return "go to both sides of 0 V"


def _flat(stairs: Sequence[StairPoint]) -> Iterator[Advice]:
    """Yield a sentence on the runs in which levels were read that no longer moved while u went on."""
    for run in dict.fromkeys(p.run for p in stairs):
        points = [p for p in stairs if p.run == run]
        flat = [p for p in points if p.branch == "saturated"]
        free = [p.level_v for p in points if p.branch != "saturated"]
        if flat and free:
            rails = sorted({round(p.mean_v.value, 1) for p in flat})
            yield Advice(
                "rail", run,
                f"{run}: {len(flat)} of {len(points)} levels rest on a rail, at {_spread(rails)} of the reading, which "
                f"tells nothing of the borders; stay between {shown(min(free), 'V', 3)} and {shown(max(free), 'V', 3)}",
            )  # fmt: skip


def _spread(levels: Iterable[float]) -> str:
    held = list(levels)
    ends = [held[0]] if len(held) == 1 else [held[0], held[-1]]
    return " and ".join(shown(level, "V", 3) for level in ends)


def _mains(wave: Wave) -> Iterator[Advice]:
    """Yield a sentence when hum that runs with the wave would survive averaging over its periods."""
    sizes = np.abs(wave.amplitudes)
    for f in wave.lines_hz[sizes > LOUD * np.max(sizes)].tolist():
        hit = mains_hit(f, max(NEAR_HZ, 1.0 / wave.time_s))
        if hit is not None:
            order, mains = hit
            what = f"{f:.4g} Hz is" if order == 1 else f"harmonic {order} of {f:.4g} Hz is"
            yield Advice(
                "mains", wave.label,
                f"{wave.label}: {what} on a multiple of the {mains:g} Hz mains, whose hum runs with it and is not "
                f"averaged out; play {shown(clear_of_mains(f), 'Hz', 4)}",
            )  # fmt: skip
            return


def mains_hit(frequency_hz: float, near_hz: float = NEAR_HZ) -> tuple[int, float] | None:
    """Return (harmonic, mains) of the first harmonic of a frequency that lies on a multiple of the mains; else None."""
    for order in range(1, HARMONICS + 1):
        for mains in MAINS_HZ:
            multiple = round(order * frequency_hz / mains)
            if multiple and abs(order * frequency_hz - multiple * mains) < near_hz:
                return order, mains
    return None


def clear_of_mains(frequency_hz: float) -> float:
    """Return the nearest frequency, to two or three digits, of which no harmonic up to HARMONICS is near the mains."""
    for percent in range(1, 60):
        for sign in (-1.0, 1.0):
            tried = float(f"{frequency_hz * (1.0 + 0.01 * sign * percent):.2g}")
            if tried > 0.0 and mains_hit(tried, 2.0 * NEAR_HZ) is None:
                return tried
    return frequency_hz


def _folding(wave: Wave) -> Iterator[Advice]:
    """Yield a sentence when harmonics that tell of G2 lie above half the sample rate."""
    f = float(wave.lines_hz[0])
    whole = int(0.5 * wave.rate_hz / f)
    if wave.is_sine and whole < HARMONICS:
        yield Advice(
            "rate", wave.label,
            f"{wave.label}: harmonics from {whole + 1} on lie above half the sample rate of "
            f"{shown(wave.rate_hz, 'Hz', 3)} and fold back; sample at {shown(2.0 * HARMONICS * f, 'Hz', 3)} or faster",
        )  # fmt: skip


def _silent(told: Information | None) -> Iterator[Advice]:
    """Yield a sentence on every step that tells nothing, when others do."""
    steps = told.steps() if told is not None else ()
    for step in steps:
        if step.tells_nothing and len(steps) > 1 and step.shares:
            sentence = f"{step.label}: brings less than 1 % of every estimate in its {shown(step.time_s, 's', 3)}"
            yield Advice("silent step", step.label, f"{sentence}; leave it out, or change its level")
