"""At which places may physics without a name have entered, with the law that does best at each?

These are the members of an undecided set like any other: what differs between their answers is what an experiment has
to show.
"""

from identify.explain.contenders import Contender
from identify.explain.locate import Located
from identify.explain.suspect import is_fine
from identify.stage import Place
from identify.unnamed.correction import UNNAMED


def entered(found: Located, unproven: bool) -> tuple[Contender, ...]:
    """Return the places that the data do not exclude, the likeliest first, each with its best law as fitted.

    A place at which the best law gives the same data exactly comes without a fit, whatever else fits there. One at
    which nothing was fitted but a table as fine as the data is left out: nothing says what an experiment would show.
    There is none where noise makes all of it.
    """
    if not found.significant:
        return ()
    fitted = [_at(found, place) for place in (found.place, *found.alternatives(unproven))]
    return tuple(contender for contender in fitted if contender is not None)


def _at(found: Located, place: Place) -> Contender | None:
    """Return one place with its best law; None where there is none of few numbers."""
    probability = found.places.get(place, 0.0)
    if place in found.best.same_at[1:]:
        return Contender(UNNAMED, place.label, probability, exact=True)
    told = [h for correction, h in found.fitted if correction.place is place and not is_fine(correction)]
    if not told:
        return None
    best = min(told, key=lambda h: h.chi2)
    substeps = max(o.substeps for o in best.data)
    return Contender(UNNAMED, place.label, probability, fit=best.fit, chi2=best.chi2, substeps=substeps)
