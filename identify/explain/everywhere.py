"""Does what was told of excerpts hold for all of the recordings they are of, and if not, where does it fail?"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from identify.chain import Chain, grid_of, running
from identify.excerpts.excerpts import Excerpts
from identify.explain.explanation import Explanation
from identify.holdout import counted
from identify.model import Model
from identify.natural_units import shown
from identify.observe import Observation
from identify.trace import Array, Trace

ALIKE = 1.1  # times what the excerpts leave that the whole recordings may leave
STANDS_OUT = 1.5  # times what the excerpts leave, that a stretch of the recordings leaves and is named for
STRETCH = 1 << 16  # samples looked at together
TELLING = 1000  # samples of a stretch that count, at least: fewer leave much by chance


@dataclass(frozen=True)
class Left:
    """What a chain leaves of whole recordings: its rms, V, and where a stretch of samples leaves most, with that."""

    rms_v: float
    most_v: float
    where: str


def everywhere(told: Explanation, model: Model, of: Excerpts) -> Explanation:
    """Return an explanation of excerpts that says so, and what its model leaves of all samples of the recordings."""
    substeps = max(o.substeps for o in (*told.train, *told.test))
    chain = told.improved.chain
    if any(p.local for p in chain.parameters()):
        checked = "What every excerpt has of its own in the model is not known for the rest, which is not checked."
    else:
        checked = _in_words(remains(chain, model, of.whole, told.noise.rms_v, substeps), told)
    warnings = (f"{_of_excerpts(of)} {checked}", *told.warnings)
    return replace(told, held_out=replace(told.held_out, how=of.how), warnings=warnings)


def remains(chain: Chain, model: Model, traces: tuple[Trace, ...], noise_v: float, substeps: int) -> Left:
    """Return what a chain leaves of all samples that count."""
    squares, count, most = 0.0, 0, (0.0, "")
    for trace in traces:
        for first, misfit in _misfits(Observation(trace, counted(trace, model, noise_v), noise_v, substeps), chain):
            total = float(misfit @ misfit)
            squares, count = squares + total, count + misfit.size
            if misfit.size >= TELLING:
                at_s = trace.start_s + first / trace.rate_hz
                most = max(most, (total / misfit.size, f"{trace.name} from {at_s:.6g} s on"))
    return Left(float(np.sqrt(squares / max(count, 1))), float(np.sqrt(most[0])), most[1])


def _misfits(observation: Observation, chain: Chain) -> Iterator[tuple[int, Array]]:
    """Yield the first sample of every stretch and what the chain leaves of those that count there, V."""
    run, first = running(chain, grid_of(observation.trace, observation.substeps)), 0
    for piece in observation.pieces(STRETCH):
        yield first, piece.misfit(run(piece.entering))
        first += piece.y.size


def _of_excerpts(of: Excerpts) -> str:
    """Return how much was looked at."""
    total = sum(trace.size for trace in of.whole)
    return (f"Of {total:,} samples, {of.samples:,} ({100.0 * of.share:.2g} %) in {of.windows} excerpts were explained: "
            "what only others show is not found, and intervals are those of the excerpts.")


def _in_words(left: Left, told: Explanation) -> str:
    """Return how well the model of the excerpts does elsewhere."""
    after_v, noise_v = told.held_out.residuals.after_v, told.noise.rms_v
    all_v = shown(left.rms_v, "V", 3)
    if left.rms_v <= ALIKE * after_v and left.most_v <= STANDS_OUT * max(after_v, noise_v):
        return f"Of all samples the model leaves {all_v} rms, as it does of the excerpts."
    return (f"Of all samples the model leaves {all_v} rms, of the excerpts kept back {shown(after_v, 'V', 3)}; most, "
            f"{shown(left.most_v, 'V', 3)}, in {left.where}: look at that stretch by itself (rig import, --rows).")
