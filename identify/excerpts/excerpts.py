"""Which excerpts of recordings too long to be held whole are explained in their place?

Explaining weighs some thousand answers of the whole chain against each other, with all their samples at hand. Of what
is longer it gets windows, each a recording of its own on the true clock; in front of it stands, not counted, the past
that the backlash still remembers.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.excerpts.cells import Cells
from identify.excerpts.history import before, joined, length
from identify.excerpts.windows import CELLS, Choice, Stretch
from identify.holdout import KEPT_BACK, settling_s
from identify.model import Model
from identify.noise import good
from identify.trace import Array, Samples, Step, Trace

LONGEST = 2_000_000  # samples, all recordings together, that are explained whole
TAKEN = 600_000  # samples that windows have in all, those before them not counted
WINDOWS = 20  # of all recordings, about
PROOF = 3  # of ten windows, where none was named for the proof: the share that is kept back of samples
SETTLED = 4  # settling times that a window has at least


@dataclass(frozen=True)
class Excerpts:
    """Excerpts to explain and those kept back for the proof, with how these were chosen; and what they are of."""

    training: tuple[Trace, ...]
    proof: tuple[Trace, ...]
    how: str
    whole: tuple[Trace, ...]
    windows: int
    samples: int

    @property
    def share(self) -> float:
        """Return the share of all samples that the windows have."""
        return self.samples / sum(trace.size for trace in self.whole)


def excerpts_of(model: Model, traces: Sequence[Trace], hold_out: Sequence[Trace]) -> Excerpts | None:
    """Return what stands for recordings that are too long to be explained whole; None where they are not."""
    total = sum(trace.size for trace in (*traces, *hold_out))
    if total <= LONGEST:
        return None
    settle_s = settling_s(model)
    cut = [_cut(trace, settle_s, total, named=bool(hold_out)) for trace in traces]
    kept = [_cut(trace, settle_s, total, named=True) for trace in hold_out]
    training = [excerpt for train, _ in cut for excerpt in train]
    proof = [excerpt for train, _ in kept for excerpt in train] + [excerpt for _, test in cut for excerpt in test]
    how = "the runs named with --hold-out" if hold_out else _how(traces)
    every = [*training, *proof]
    return Excerpts(
        tuple(e.trace for e in training), tuple(e.trace for e in proof), how, (*traces, *hold_out), len(every),
        sum(e.samples for e in every),
    )  # fmt: skip


@dataclass(frozen=True)
class _Excerpt:
    """A recording that is part of another, and how many of its samples count."""

    trace: Trace
    samples: int


def _cut(trace: Trace, settle_s: float, total: int, *, named: bool) -> tuple[list[_Excerpt], list[_Excerpt]]:
    """Return the excerpts of one recording to fit and those to prove; all to fit where runs were ``named`` for that."""
    taken, settle = max(TAKEN * trace.size // total, 1), max(round(settle_s * trace.rate_hz), 1)
    if named and trace.size <= taken:
        return [_Excerpt(trace, trace.size)], []
    count = int(np.clip(taken // (SETTLED * settle), 2, max(round(WINDOWS * trace.size / total), 2)))
    cells = Cells.of(trace.u, max(taken // (CELLS * count), 1))
    choice = Choice(cells, trace.steps)
    test = [] if named else kept_back(trace)
    back = 0 if named else max(round(count * PROOF / 10), 1)
    chosen = (choice.windows(_others(test, trace.size), count - back), choice.windows(test, back) if back else [])
    train, proof = ([_excerpt(trace, cells, window, settle) for window in windows] for windows in chosen)
    return train, proof


def kept_back(trace: Trace) -> list[Stretch]:
    """Return the stretches kept back of a recording: the last repeats of its steps, else its last part."""
    last = {step.label: step.repeat for step in sorted(trace.steps, key=lambda step: step.repeat)}
    repeats = [(step.start, step.stop) for step in trace.steps if step.repeat == last[step.label] > 0]
    return joined(repeats) or [(round((1.0 - KEPT_BACK) * trace.size), trace.size)]


def _how(traces: Sequence[Trace]) -> str:
    """Return in words what is kept back where no run was named."""
    if any(step.repeat for trace in traces for step in trace.steps):
        return "excerpts of the last repeat of every repeated step"
    return f"excerpts of the last {100 * KEPT_BACK:.0f} % of every run"


def _others(stretches: list[Stretch], size: int) -> list[Stretch]:
    """Return what lies between stretches of a recording."""
    edges = [0, *(edge for stretch in stretches for edge in stretch), size]
    return [(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if a < b]


def _excerpt(trace: Trace, cells: Cells, window: Stretch, settle: int) -> _Excerpt:
    """Return a window with what the rig must have gone through before it, not counted, as a recording of its own."""
    start, stop = window
    past = before(cells, start, settle)
    stretches, lead = [*past, window], length(past)
    valid = np.concatenate((np.zeros(lead, dtype=np.bool_), good(trace)[start:stop]))
    excerpt = replace(
        trace, name=f"{trace.name} at {trace.start_s + start / trace.rate_hz:.6g} s", u=_joined(trace.u, stretches),
        y=_joined(trace.y, stretches), start_s=trace.start_s + (start - lead) / trace.rate_hz,
        steps=_moved(trace.steps, window, lead), valid=None if valid.all() else valid,
        from_rest=trace.from_rest or start > 0,
    )  # fmt: skip
    return _Excerpt(excerpt, stop - start)


def _joined(signal: Samples, stretches: Sequence[Stretch]) -> Array:
    """Return the samples of all stretches in a row."""
    return np.concatenate([signal[start:stop] for start, stop in stretches])


def _moved(steps: Sequence[Step], window: Stretch, lead: int) -> tuple[Step, ...]:
    """Return the steps within a window, as an excerpt counts its samples."""
    start, stop = window
    within = [s for s in steps if s.start < stop and s.stop > start]
    edges = [(max(s.start, start), min(s.stop, stop)) for s in within]
    on = lead - start
    return tuple(replace(s, start=on + a, stop=on + b) for s, (a, b) in zip(within, edges, strict=True))
