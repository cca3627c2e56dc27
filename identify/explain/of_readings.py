"""What is said of the blemishes of the readings, and where they are?"""

from collections.abc import Sequence

from identify.effects.effect import short
from identify.explain.confirm import EVEN
from identify.explain.explanation import Finding, Location, Range
from identify.explain.rivals import OTHERWISE
from identify.explain.where import UNITS
from identify.holdout import Split
from identify.natural_units import shown_interval
from identify.readings.blemish import Blemish
from identify.readings.coloured_noise import ColouredNoise
from identify.stage import Place


def finding(blemish: Blemish, beside: bool = False) -> Finding:
    """Return what is said of one blemish; an unnamed law ``beside`` noise may have made what looks like that."""
    named = ((short(p.name), p.unit) for p in blemish.declared)
    parameters = {name: (blemish.values[name], unit) for name, unit in named if name in blemish.values}
    told = [f"{name} {shown_interval(interval, unit)}" for name, (interval, unit) in parameters.items()]
    words = ", ".join(told) + (f" ({blemish.where})" if blemish.where else "")
    others = blemish.confused_with
    most = EVEN if beside and blemish.id == ColouredNoise.id else 1.0 - OTHERWISE
    return Finding(
        blemish.id, Place.SENSE.label, blemish.form, most * (1.0 - blemish.p_value), parameters, blemish.equation,
        blemish.sentence.format(words), (), others[0].would_separate if others else None,
    )  # fmt: skip


def location(blemishes: Sequence[Blemish], data: Split) -> Location:
    """Return where blemishes are, when nothing else differs."""
    traces = [o.trace for o in data.train]
    end_s = max(trace.start_s + trace.size / trace.rate_hz for trace in traces)
    everywhere = Range("clock time", min(trace.start_s for trace in traces), end_s, "s", 1.0)
    ranges = tuple(_stretch(blemish) or everywhere for blemish in blemishes)
    what = " and ".join(blemish.title for blemish in blemishes)
    return Location(Place.SENSE.label, ranges, f"The mismatch is in the readings themselves: {what}.")


def _stretch(blemish: Blemish) -> Range | None:
    """Return where along its axis a blemish is, where that is known."""
    if blemish.span is None:
        return None
    low, high, share = blemish.span
    return Range(blemish.axis, low, high, UNITS.get(blemish.axis, "V"), share)
