"""On how much of a very long run is a fit tried from many starts?"""

from identify.chain import Chain
from identify.fit import Fit, fit
from identify.model import Model
from identify.starts.search import PATIENCE, Judge, searched
from identify.starts.thinning import TRIED


def sought(model: Model, judge: Judge, first: Fit, start: Chain) -> Fit:
    """Return the first fit, or where it fails the one that another start leads to (identify.starts.search).

    Other starts are tried on the beginnings of long runs; what is found there is then fitted to all of them.
    """
    beginnings = tuple(o.until(TRIED) for o in judge.observations)
    if all(b is o for b, o in zip(beginnings, judge.observations, strict=True)):
        return searched(model, judge, first, start)
    if judge.settled(first):
        return first
    seen = tuple(b for b in beginnings if b.count)
    tried = fit(start, seen, start.values, model.fixed)
    found = searched(model, Judge(seen, judge.freedom), tried, start)
    centre = {c.name: c.centre for c in found.coordinates}
    return judge.preferred(first, fit(found.chain, judge.observations, centre, model.fixed, PATIENCE))
