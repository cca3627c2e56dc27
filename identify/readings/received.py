"""What do the readings alone tell is wrong with them, before any model is asked?"""

from collections.abc import Sequence

from identify.readings.blemish import Blemish
from identify.readings.doubled import doubled
from identify.readings.mend import Mended
from identify.readings.range_end import RangeEnd, range_ends
from identify.trace import Trace
from identify.unnamed.correction import UNNAMED


def received(
    traces: Sequence[Trace], hold_out: Sequence[Trace], noise_v: float, leave_out: Sequence[str]
) -> tuple[Mended, tuple[Blemish, ...]]:
    """Return the recordings without what the range of the ADC cuts, and what is no reading, and what tells of either.
    """
    seen, found = (*traces, *hold_out), tuple[Blemish, ...]()
    for name, shown in ((RangeEnd.id, range_ends), (UNNAMED, doubled)):
        seen, told = shown(seen, noise_v) if name not in leave_out else (seen, ())
        found = (*found, *told)
    return Mended(seen[: len(traces)], seen[len(traces) :], ()), found
