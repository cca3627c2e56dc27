"""Which data fit, which choose, and which are kept back for the proof?"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, log

import numpy as np

from identify.blocks import TOLERANCE_FACTOR
from identify.heard import check_heard
from identify.held import held_v
from identify.model import LinearF, Model, Rational
from identify.noise import Noise, good, noise_of
from identify.observe import Observation
from identify.trace import Array, Mask, Trace

SETTLED = 1e-4  # what is left of a step when it counts as settled
GIVEN_UP = 0.1  # share of a run from rest, at most, that an offset of F may spoil
KEPT_BACK = 0.3  # share of a run kept back when nothing is repeated and no run was named
TENTHS = 10  # of a run, of which those that are kept back are chosen
ALIKE = 0.8  # of how far and how fast u moves, up and down, that is left to be fitted


@dataclass(frozen=True)
class Split:
    """Observations to fit and choose on, observations for the proof, and how they were told apart."""

    train: tuple[Observation, ...]
    test: tuple[Observation, ...]
    noise: Noise
    how: str


def split(
    model: Model, traces: Sequence[Trace], hold_out: Sequence[Trace] = (), *, beginnings: bool = False
) -> Split:
    """Return the data in two parts: named runs, else the last repeat of every repeated step, else a part of each run.

    Of ``beginnings`` nothing need be left for the proof. Raises ValueError when there is nothing to fit, when sample
    rates differ in kind, the noise cannot be told, or no recording follows the source.
    """
    if not traces:
        raise ValueError("no recording to fit: every one given is held out")
    noise = noise_of([*traces, *hold_out], settling_s(model), model.noise_v)
    check_heard(model, traces, noise.rms_v)
    usable = [counted(trace, model, noise.rms_v) for trace in traces]
    if hold_out:
        train = [Observation(t, use, noise.rms_v) for t, use in zip(traces, usable, strict=True)]
        test = [Observation(t, counted(t, model, noise.rms_v), noise.rms_v) for t in hold_out]
        return Split(tuple(train), _some(test, beginnings), noise, "the runs named with --hold-out")
    kept = [last_repeats(trace) for trace in traces]
    how = "the last repeat of every repeated step"
    if not any(mask.any() for mask in kept):
        kept = [_kept_back(trace) for trace in traces]
        how = f"the last {100 * KEPT_BACK:.0f} % of every run"
        if not all(mask[-1] for mask in kept):
            how = f"{100 * KEPT_BACK:.0f} % of every run, where the rest of it moves as far and as fast"
    train = [Observation(t, use & ~k, noise.rms_v) for t, use, k in zip(traces, usable, kept, strict=True)]
    test = [Observation(t, use & k, noise.rms_v) for t, use, k in zip(traces, usable, kept, strict=True)]
    return Split(_some(train), _some(test, beginnings), noise, how)


def _some(observations: Sequence[Observation], or_none: bool = False) -> tuple[Observation, ...]:
    """Return the observations in which any sample counts; ValueError when none does, unless it may be none."""
    found = tuple(o for o in observations if o.count)
    if not found and not or_none:
        raise ValueError("no sample is left to look at: the recordings are shorter than the rig takes to settle")
    return found


def counted(trace: Trace, model: Model, noise_v: float = inf) -> Mask:
    """Return which samples may count: received, and settled when the rig was in motion at the start.

    And no longer of a level that F holds from before, where readings of ``noise_v`` tell that it does.

    The rig file's poles are nominal; the real ones may be slower by as much as a fit allows. A line F with an offset
    has stood in front of G2 before the run, where the chain starts G2 empty: what that leaves is not counted, either.
    """
    if trace.from_rest and not isinstance(model.f, LinearF):
        _, held = held_v(trace, model, noise_v)
        return _without_first(trace, held + round(_settling_s(model.g2) * trace.rate_hz)) if held else good(trace)
    settling = _settling_s(model.g2) if trace.from_rest else settling_s(model)
    unsettled = round(TOLERANCE_FACTOR * settling * trace.rate_hz)
    return _without_first(trace, min(unsettled, round(GIVEN_UP * trace.size)) if trace.from_rest else unsettled)


def _without_first(trace: Trace, samples: int) -> Mask:
    """Return which samples were received, but for the first."""
    use = good(trace).copy()
    use[:samples] = False
    return use


def last_repeats(trace: Trace) -> Mask:
    """Return which samples belong to the last repeat of a step that was repeated."""
    mask = np.zeros(trace.size, dtype=bool)
    for step in trace.steps:
        last = max(s.repeat for s in trace.steps if s.label == step.label)
        if step.repeat == last and last > 0:
            mask[step.start : step.stop] = True
    return mask


def _kept_back(trace: Trace) -> Mask:
    """Return which samples of a run without repeats are kept back: the last part without which it moves as much.

    What moves only there nothing else would tell: values that are open would be taken for missing physics. The source
    alone chooses; where every part matters, the one that takes least is kept back.
    """
    edges = np.round(np.linspace(0, trace.size, TENTHS + 1)).astype(int)
    u, back = trace.u[:], round(KEPT_BACK * TENTHS)
    step = np.diff(u, prepend=u[:1])
    whole = _reach(u, step)
    options = range(TENTHS - back, 0, -1)
    shares = []
    for first in options:
        away = slice(edges[first], edges[first + back])
        reached = _reach(np.delete(u, away), np.delete(step, away))
        shares.append(min((part / all_ for part, all_ in zip(reached, whole, strict=True) if all_), default=1.0))
        if shares[-1] >= ALIKE:
            break
    first = options[int(np.argmax(shares))]
    mask = np.zeros(trace.size, dtype=bool)
    mask[edges[first] : edges[first + back]] = True
    return mask


def _reach(u: Array, step: Array) -> tuple[float, float, float, float]:
    """Return how far a signal goes up and down, and its largest step up and down, V: a gap is crossed either way."""
    rise, fall = np.max(u - np.minimum.accumulate(u)), np.max(np.maximum.accumulate(u) - u)
    return float(rise), float(fall), float(np.max(step)), -float(np.min(step))


def settling_s(model: Model) -> float:
    """Return how long G1 and G2 together need to settle to ``SETTLED``, dead time included, in s."""
    return sum(_settling_s(block) for block in (model.g1, model.g2))


def _settling_s(block: Rational) -> float:
    """Return the settling time of one block from its slowest pole; unstable poles settle never."""
    poles = np.roots(block.den)
    slowest = float(np.min(-poles.real)) if poles.size else np.inf
    if slowest <= 0.0:
        worst = poles[int(np.argmax(poles.real))]
        raise ValueError(f"the block {block.num} / {block.den} is not stable: a pole at {worst:.4g}/s")
    return block.dead_time_s + (log(1.0 / SETTLED) / slowest if np.isfinite(slowest) else 0.0)
