"""How often is the explainer right on cases nobody has seen? ``python -m tests.proof.validate FIRST LAST``.

The only file of the bench that meets the product; it draws nothing itself.
"""

import sys
import time
import traceback
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace

from identify.explain import Explanation, explain
from identify.trace import Step, Trace
from tests.proof.bench import Run, record
from tests.proof.cases import Case
from tests.proof.sizing import size
from tests.proof.validation import drawn
from tests.trials import model_of

CLEAR = 2.0  # times the noise: a mismatch above this is one that must be found
TINY = 0.5  # below this the noise may hide it


@dataclass(frozen=True)
class Outcome:
    """One case with its answer (None: it crashed), the true size of its mismatch, alone and piece by piece."""

    case: Case
    answer: Explanation | None
    size: float
    held_out: float
    pieces: tuple[float, ...]
    seconds: float

    @property
    def wanted(self) -> tuple[tuple[str, str], ...]:
        """Return (id, stage) of every piece of physics that has a name."""
        return tuple((f.id, f.stage) for f in self.case.expected)

    @property
    def named(self) -> tuple[tuple[str, str], ...]:
        """Return (id, stage) of every name given."""
        effects = self.answer.effects if self.answer else ()
        return tuple((f.id, f.stage) for f in effects if f.id != "unnamed")

    @property
    def wrong(self) -> tuple[tuple[str, str], ...]:
        """Return the names given that are not true."""
        return tuple(name for name in self.named if name not in self.wanted)

    @property
    def silent(self) -> tuple[tuple[str, float], ...]:
        """Return the physics not named, each with its own mismatch over the noise."""
        pairs = zip(self.wanted, self.pieces, strict=True) if self.wanted else ()
        return tuple((f"{i} at {stage}", z) for (i, stage), z in pairs if (i, stage) not in self.named)

    def intervals(self) -> Iterator[tuple[str, float, float, float, float]]:
        """Yield name, truth, value and the two ends of every parameter of every right name."""
        for truth in self.case.expected:
            for got in self.answer.effects if self.answer else ():
                if (got.id, got.stage) == (truth.id, truth.stage):
                    known = [(key, value) for key, value in truth.parameters.items() if key in got.parameters]
                    for key, value in known:
                        interval = got.parameters[key][0]
                        yield f"{got.id}.{key}", value, interval.value, interval.low, interval.high

    def line(self) -> str:
        """Return the case in one line."""
        if self.answer is None:
            return f"{self.case.seed} CRASH {self.case.name}"
        a = self.answer
        noise = a.noise.rms_v
        got = ", ".join(f"{f.id}@{f.stage}{f' ({f.form})' if f.form else ''} p{f.probability:.2f}" for f in a.effects)
        kept = "".join("+" if low <= truth <= high else "-" for _, truth, _, low, high in self.intervals())
        return (
            f"{self.case.seed} {'WRONG' if self.wrong else 'silent' if self.silent else 'ok':6s} {self.case.name}: "
            f"{self.case.verdict}/{a.verdict} [{got}] ci {kept or 'none'} "
            f"true {self.size:.2f} held {self.held_out:.2f} pieces {[round(z, 2) for z in self.pieces]} "
            f"noise {1e3 * noise:.2f} mV, "
            f"train {a.training.before_v / noise:.2f}->{a.training.after_v / noise:.3f} "
            f"held {a.held_out.residuals.before_v / noise:.2f}->{a.held_out.residuals.after_v / noise:.3f} "
            f"{self.seconds:.1f} s"
        )


def outcome(seed: int) -> Outcome:
    """Return what the explainer says of the case of a seed."""
    case = drawn(seed)
    runs = record(case)
    began = time.perf_counter()
    answer = None
    try:
        train, test = ([trace_of(run) for run in runs if run.held_out is held] for held in (False, True))
        answer = explain(model_of(case.nominal), train, test)
    except Exception:  # a validation reports every failure and goes on
        traceback.print_exc()
    seconds = time.perf_counter() - began
    whole = size(case)
    alone = tuple(whole if len(case.physics) == 1 else size(replace(case, physics=(p,))) for p in case.physics)
    return Outcome(case, answer, whole.refitted, whole.held_out, tuple(s.refitted for s in alone), seconds)


def trace_of(run: Run) -> Trace:
    """Return a recording of the bench as the product reads it."""
    steps = tuple(Step(s.label, s.kind, s.start, s.stop, s.repeat) for s in run.steps)
    return Trace(run.name, run.rate_hz, run.u, run.y, "held", run.start_s, steps)


def summary(outcomes: list[Outcome]) -> str:
    """Return the counts, then every failure."""
    known, clean = [o for o in outcomes if o.wanted], [o for o in outcomes if not o.case.physics]
    outside = [o for o in outcomes if o.case.physics and not o.wanted]
    silent = [z for o in outcomes for _, z in o.silent]
    intervals = [i for o in outcomes for i in o.intervals()]
    covered = sum(low <= truth <= high for _, truth, _, low, high in intervals)
    verdicts = Counter(f"{o.answer.verdict if o.answer else 'crash'}" for o in outside)
    lines = [
        f"cases {len(outcomes)}: library {len(known)}, outside {len(outside)}, clean {len(clean)}",
        f"effects of the library: {sum(len(o.wanted) for o in known)}, named right "
        f"{sum(name in o.named for o in known for name in o.wanted)}, silent {len(silent)} "
        f"(mismatch > {CLEAR:g}: {sum(z > CLEAR for z in silent)}, < {TINY:g}: {sum(z < TINY for z in silent)})",
        f"cases with the exact set of names: {sum(set(o.named) == set(o.wanted) for o in known)} of {len(known)}",
        f"wrong names: {sum(len(o.wrong) for o in outcomes)} "
        f"(library {sum(len(o.wrong) for o in known)}, outside {sum(len(o.wrong) for o in outside)}, "
        f"clean {sum(len(o.wrong) for o in clean)})",
        f"outside the library: {dict(verdicts)}",
        f"false alarms on clean: {sum(o.answer is None or o.answer.verdict != 'consistent' for o in clean)}",
        f"95 % intervals that hold the truth: {covered} of {len(intervals)}",
        f"crashes: {sum(o.answer is None for o in outcomes)}; "
        f"median {sorted(o.seconds for o in outcomes)[len(outcomes) // 2]:.1f} s a case",
    ]
    missed = [f"  missed {o.case.seed} {i}" for o in outcomes for i in o.intervals() if not i[3] <= i[1] <= i[4]]
    return "\n".join([*lines, *missed])


def main(first: int, last: int) -> None:
    """Print a line for every seed from ``first`` to ``last``, then the summary."""
    outcomes = []
    for seed in range(first, last + 1):
        outcomes.append(outcome(seed))
        print(outcomes[-1].line(), flush=True)
    print(summary(outcomes))


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
