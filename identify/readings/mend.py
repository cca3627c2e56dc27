"""What is wrong with the readings themselves, and what are the recordings without it?"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest

import numpy as np

from identify.chain import Chain, simulate
from identify.noise import good, grid_step_v
from identify.observe import Observation, refined
from identify.readings.blemish import Blemish
from identify.readings.missing_samples import Loss, loss_in
from identify.readings.outliers import FAR_ABOVE, FarOut, Samples, far_out, outliers
from identify.readings.spikes import spikes
from identify.readings.stray import stray
from identify.readings.uneven_noise import Uneven, uneven_noise
from identify.trace import Array, Trace
from identify.unnamed.correction import UNNAMED

TAIL = 1e-3  # chance of readings that lie far out to be so often where noise is large, below which it has made them


@dataclass(frozen=True)
class Mended:
    """Recordings without their blemishes, in the order given, the blemishes, and where each lost readings.

    ``noise`` is that of readings that scatter unlike each other; None where they do not.
    """

    training: tuple[Trace, ...]
    proof: tuple[Trace, ...]
    found: tuple[Blemish, ...]
    lost_from: tuple[int | None, ...] = ()
    noise: Uneven | None = None

    @property
    def runs(self) -> tuple[tuple[Trace, ...], tuple[Trace, ...]]:
        """Return the recordings that are fitted and those held out."""
        return self.training, self.proof

    def in_time(self) -> "Mended":
        """Return recordings up to where readings were lost; whole where less than half of those fitted would be left.

        A model that a loss has led astray tells too few lost readings, and these lead the next one astray; up to there
        no count does.
        """
        runs = zip_longest((*self.training, *self.proof), self.lost_from)
        before = tuple(t if at is None else without(t, slice(at, None)) for t, at in runs)
        training, proof = before[: len(self.training)], before[len(self.training) :]
        whole, left = (sum(int(np.count_nonzero(good(t))) for t in part) for part in (self.training, training))
        return replace(self, training=training, proof=proof) if 2 * left > whole else self


def mended(
    chain: Chain, training: Sequence[Trace], proof: Sequence[Trace], noise_v: float,
    leave_out: Sequence[str] = (), rough: bool = False,
) -> Mended:  # fmt: skip
    """Return recordings with lost readings put back as gaps and spikes left out.

    ``chain`` is the model they are compared with; where the blemishes may have led it astray the look is ``rough``.
    A held-out recording is mended as the others are: what is wrong with it is its own, as the phase of its mains is.
    """
    found: list[Blemish] = []
    traces = [*training, *proof]
    losses: list[Loss | None] = [None] * len(traces)
    answers = [answer(chain, trace, noise_v) for trace in traces]
    if "missing_samples" not in leave_out:
        losses = [loss_in(trace, answer, noise_v, rough) for trace, answer in zip(traces, answers, strict=True)]
        if rough:
            losses = _surest(losses)
        traces = [loss.mended() if loss else trace for trace, loss in zip(traces, losses, strict=True)]
        found += [loss.blemish() for loss in losses if loss]
    left = [(t, t.y[:] - answer) for t, answer in zip(traces, answers, strict=True)]
    noise = uneven_noise(left[: len(training)], left[len(training) :]) if UNNAMED not in leave_out else None
    lsb_v = grid_step_v([*training, *proof])
    seen = [outliers(t, rest, lsb_v, noise.evened(t, rest) if noise else None) for t, rest in left]
    far = far_out(seen[: len(training)])
    tail = noise is not None and far is not None and _is_tail(noise, far)
    for name, thrown_off in (("spikes", spikes), (UNNAMED, stray)):
        told, threshold = thrown_off(None if tail and name == "spikes" else far, seen[len(training) :])
        if told and name not in leave_out:
            found += told
            traces = [without(t, o.beyond(threshold)) for t, o in zip(traces, seen, strict=True)]
    runs = tuple(traces[: len(training)]), tuple(traces[len(training) :])
    return Mended(*runs, tuple(found), tuple(loss.low if loss else None for loss in losses), noise)


def _is_tail(noise: Uneven, far: FarOut) -> bool:
    """Return whether readings lie far out where noise is larger: what has no part in that comes anywhere.

    Noise that goes with something need not be Gaussian, nor go with that alone. What stands far above it is none of it.
    """
    if float(np.median(far.sizes_sd)) > FAR_ABOVE * far.threshold:
        return False
    return far.chance_along([noise.of(seen.trace) for seen in far.runs]) < TAIL


def answer(chain: Chain, trace: Trace, noise_v: float) -> Array:
    """Return what a chain answers, V, shape (N,), on a grid so fine that stepping does not show: it makes outliers."""
    substeps = refined(Observation(trace, good(trace), noise_v), chain).substeps
    return simulate(chain, trace, substeps)


def _surest(losses: Sequence[Loss | None]) -> list[Loss | None]:
    """Return the loss that proves itself most alone: the others may be what it has done to the model."""
    most = max((loss.proof for loss in losses if loss), default=0.0)
    return [loss if loss and loss.proof == most else None for loss in losses]


def without(trace: Trace, samples: Samples | slice) -> Trace:
    """Return a recording in which some samples do not count."""
    valid = np.array(good(trace))
    valid[samples] = False
    return replace(trace, valid=valid)
