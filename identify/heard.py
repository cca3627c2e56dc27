"""Does anything of the source come back in the readings?

A lead that is off, another channel, a supply that is not switched on: what is read then is noise about a level. A model
with enough freedom fits that as well as anything, and whatever is named for it is wrong.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identify.chain import signals
from identify.effects import chain_of
from identify.model import Backlash, LinearF, Model
from identify.natural_units import shown
from identify.noise import good
from identify.trace import LONG, Array, Trace, beginning

WIDER = 1.5  # times the gap of the rig file, that may be stuck in earnest
FORETOLD = 10.0  # times the noise that a rig with such a gap would move the readings by, at least, for silence to tell
SILENT = 0.01  # of what is foretold, that chance, pickup and what leaks past the rig may look like of it


def check_heard(model: Model, traces: Sequence[Trace], noise_v: float) -> None:
    """Raise ValueError where nothing of the source is in any of the recordings, though the rig should make much of it.

    What is compared is a line in the signals of the simulation, whatever their sizes: u, v, w and y.
    """
    if model.unknown or not traces:
        return
    most: tuple[float, Trace] | None = None
    for trace in traces:
        foretold_v = _foretold(model, trace, noise_v)
        if foretold_v is None:
            return
        most = (foretold_v, trace) if most is None or foretold_v > most[0] else most
    assert most is not None
    foretold_v, trace = most
    y = trace.y[:LONG][good(trace)[:LONG]]
    stuck = "" if isinstance(model.f, LinearF) else (
        f", or F rests in a gap more than {WIDER:g} times as wide as the rig file has it (play a larger amplitude)"
    )  # fmt: skip
    raise ValueError(
        f"the readings do not follow the source: they stay at {shown(float(np.mean(y)), 'V', 3)} "
        f"± {shown(float(np.std(y)), 'V', 2)} where the rig file foretells {shown(foretold_v, 'V', 2)} rms; nothing of "
        f"the rig reaches the ADC (check the cable, the channel and the supply){stuck}"
    )


def _foretold(model: Model, trace: Trace, noise_v: float) -> float | None:
    """Return how much the readings should move, V rms; None where they follow something, or need not move at all."""
    some = beginning(trace)
    use = good(some)
    y = some.y[:][use]
    with np.errstate(over="ignore", invalid="ignore"):
        rows = np.array([tap[use] for tap in signals(chain_of(model, trace.intersample), some)])
        least = signals(chain_of(_widened(model), trace.intersample), some)[-1][use]
    most_v = float(np.std(rows[-1])) if y.size else 0.0
    if not np.all(np.isfinite(rows)) or not float(np.std(least)) > FORETOLD * noise_v:
        return None
    return most_v if float(np.std(_line_in(rows, y))) < SILENT * most_v else None


def _line_in(rows: Array, y: Array) -> Array:
    """Return the best combination of rows and a constant, V."""
    base = np.column_stack([*rows, np.ones(y.size)])
    return np.asarray(base @ np.linalg.lstsq(base, y, rcond=1e-9)[0])


def _widened(model: Model) -> Model:
    """Return the model with a wider gap of the same middle."""
    f = model.f
    if not isinstance(f, Backlash):
        return model
    more = 0.5 * (WIDER - 1.0) * (f.d_l_v - f.d_u_v)
    return replace(model, f=replace(f, d_l_v=f.d_l_v + more, d_u_v=f.d_u_v - more))
