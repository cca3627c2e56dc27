"""Does a model hold on data used neither for fitting nor for choosing?"""

from collections.abc import Sequence

import numpy as np

from identify.chain import Chain, local_name
from identify.fit import fit
from identify.observe import Observation, pooled_rms
from identify.phases import angles_of, scanned
from identify.trace import Array

BLOCKS = 40  # stretches over which differences of squared residuals are averaged
UNFINISHED, MUCH, EVEN = 1.1, 0.05, 0.5  # times the noise left on held-out data; share of what was met; probability
CONVINCING = 2.0  # standard errors by which held-out data must side with a finding that the training data proved
CERTAIN, CERTAIN_FALL = 3.0, 100.0  # standard errors that may be chance, beside a fall of chi-squared that is none


def adapted(chain: Chain, observations: Sequence[Observation]) -> Chain:
    """Return the chain with local values, such as the phase of the mains, fitted to runs it has not seen.

    All shared parameters stay as they are; a run seen before keeps its values.
    """
    names = [p.name for p in chain.parameters() if p.local]
    new = [o for o in observations if names and local_name(names[0], o.trace.name) not in chain.values]
    shared = [p.name for p in chain.parameters() if not p.local]
    angles = [p for p in angles_of(chain.parameters()) if p.local]
    for observation in new:
        chain = fit(scanned(chain, [observation], angles), [observation], fixed=shared).chain
    return chain


def held_out_rms(chain: Chain, observations: Sequence[Observation]) -> float:
    """Return the residual rms in V on held-out data."""
    return pooled_rms([o.used_residual(chain) for o in observations])


def improvement(better: Chain, worse: Chain, observations: Sequence[Observation]) -> float:
    """Return by how many standard errors held-out data side with ``better`` where the two answers differ.

    With d the difference of the answers and r what ``worse`` leaves, noise alone makes sum(d r) vary by as much as its
    sums over stretches do; if ``better`` is right it is sum(d^2) on average. Below zero when ``better`` leaves more.
    How much less it leaves is no test of its own: that scatters twice as much.
    """
    side, fall, chance, white = 0.0, 0.0, 0.0, 0.0
    total = sum(o.count for o in observations)
    for o in observations:
        r, left = weighed_residual(better, o), weighed_residual(worse, o)
        d = left - r
        pieces = max(2, round(BLOCKS * o.count / total))
        side += float(np.sum(d * left))
        fall += float(np.sum(d * (left + r)))
        chance += float(sum(np.sum(piece) ** 2 for piece in np.array_split(r * d, pieces)))
        white += float(np.sum(np.square(d)))
    error = float(np.sqrt(max(chance, white)))
    told = side if fall > 0.0 else min(side, fall)
    return told / error if error > 0.0 else 0.0


def would_tell(better: Chain, worse: Chain, observations: Sequence[Observation]) -> float:
    """Return by how many standard errors held-out data would side with ``better`` if it were right."""
    changes = (weighed_residual(worse, o) - weighed_residual(better, o) for o in observations)
    return float(np.sqrt(sum(float(d @ d) for d in changes)))


def weighed_residual(chain: Chain, observation: Observation) -> Array:
    """Return the residual of the samples that count as a fit weighs it: white, of rms one."""
    return np.concatenate(list(observation.whitened(chain)))


def unconfirmed(side: float, told: float, fallen: float = 0.0) -> bool:
    """Return whether held-out data that side with a finding by ``side`` standard errors speak against it.

    They would by ``told`` if it were right: that must be enough to tell, and chance must not be what keeps them from
    convincing. ``fallen`` is by how much chi-squared of the training data fell: where chance cannot have made that,
    more of it is left to the held-out data.
    """
    chance = CERTAIN if fallen > CERTAIN_FALL else CONVINCING
    return told > CONVINCING and side < min(CONVINCING, told - chance)


def most_believed(met: float, left: float) -> float:
    """Return the most a name may be given, where held-out data had ``met`` times the noise and names leave ``left``.

    None is likelier than not where much of the mismatch is unexplained: what explains the rest may explain all of it.
    """
    much = left**2 - 1.0 > MUCH * (met**2 - 1.0)
    return EVEN if left > UNFINISHED and much else 1.0
