"""How long do a fit of the plain model and an explanation take on a case of the trial bench?

``python -m tests.benchmarks.fit_and_explain [case] [rounds]``
"""

import sys
import time

from identify.chain import plain_chain
from identify.explain import explain
from identify.fit import fit
from identify.trace import Step, Trace
from tests.benchmarks.timing import side_by_side
from tests.proof.bench import Run, record
from tests.proof.cases import CASES
from tests.trials import model_of, observed


def trace_of(run: Run) -> Trace:
    """Return a recording of the bench in the product's form."""
    steps = tuple(Step(s.label, s.kind, s.start, s.stop, s.repeat) for s in run.steps)
    return Trace(run.name, run.rate_hz, run.u, run.y, "held", run.start_s, steps)


def main(arguments: list[str]) -> None:
    """Measure and print."""
    case = next(c for c in CASES if c.name == (arguments[0] if arguments else "saturation"))
    rounds = int(arguments[1]) if len(arguments) > 1 else 3
    runs = record(case)
    training, held_out = ([trace_of(r) for r in runs if r.held_out is kept] for kept in (False, True))
    model = model_of(case.nominal)
    seen = [observed(trace, case.rig.noise_v) for trace in training]
    samples = sum(trace.size for trace in training)
    (fitted,) = side_by_side([("fit", lambda: fit(plain_chain(model), seen))], rounds)
    print(f"{case.name}: {samples} samples to train on")
    print(f"fit of the plain model, 2 substeps: least {fitted.least:.2f} s, median {fitted.median:.2f} s")
    start = time.perf_counter()
    answer = explain(model, training, held_out)
    print(f"explain: {time.perf_counter() - start:.1f} s, {answer.verdict}: {', '.join(e.id for e in answer.effects)}")


if __name__ == "__main__":
    main(sys.argv[1:])
