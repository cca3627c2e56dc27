"""What may be missing at all? Every correction of free form, with what it promises to first order."""

from collections.abc import Sequence
from dataclasses import replace
from math import log

import numpy as np

from identify.evidence import Evidence
from identify.explain.corrections import corrections
from identify.explain.moments import wandering
from identify.explain.narrow import narrow
from identify.explain.sought import at_its_moment
from identify.explain.suddenly import suddenly
from identify.explain.suspect import LEVEL, Suspect, suspect, unexplained
from identify.stage import Place
from identify.unnamed.linear import SlowFilter

LIKELY = 0.5  # of the best promise, from which it is sought at which moment something came in


def suspects(evidence: Evidence) -> list[Suspect]:
    """Return every correction with its promise to first order, the likeliest first."""
    found = [_placed(suspect(evidence, correction)) for correction in corrections(evidence)]
    found += [
        Suspect(one, np.ones(squares.size), squares, values, looks)
        for one, squares, values, looks in wandering(evidence.fine)
    ]
    if (seen := narrow(evidence.fine)) is not None:
        found.append(replace(suspect(evidence.fine, seen[0]), looks=seen[1]))
    found += _sudden(evidence.fine, found)
    noise = unexplained(evidence, found)
    return sorted(found, key=lambda s: -s.worth(noise)[0])


def _sudden(evidence: Evidence, found: Sequence[Suspect]) -> list[Suspect]:
    """Return what comes in at a moment, those laws of it that promise a part of the best of all, each at its moment.

    And more than the best of as many moments as there are samples would by chance.
    """
    promised = list(suddenly(evidence))
    most = max([s.gain for s in found] + [gain for _, gain in promised], default=0.0)
    least = max(LIKELY * most, 2.0 * log(evidence.residual.size / LEVEL))
    return [at_its_moment(evidence, law) for law, gain in promised if gain > least]


def _placed(found: Suspect) -> Suspect:
    """Return a slow filter behind F at the stage whose physics does what it does, which no data can tell.

    What goes on in the direction of a step is the creep of a capacitor that holds, what sags back is a coupling.
    """
    if found.correction.form != SlowFilter.form or found.correction.place != Place.SENSE:
        return found
    creeps = sum(found.values.get(p.name, 0.0) for p in found.correction.parameters()) < 0.0
    return replace(found, correction=replace(found.correction, place=Place.F)) if creeps else found
