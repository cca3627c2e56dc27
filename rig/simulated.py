"""What is known of a model's answer to a recorded input: how far off it is, its picture, its table?"""

import io
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from identify.natural_units import shown
from identify.notebook.glance import Glance, Seen
from identify.trace import Array, Mask, Trace

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from identify.model import Model


@dataclass(frozen=True, repr=False)
class Simulated(Seen):
    """A recording and a model's answer to its input, V.

    ``half_band`` is half the width of the answer's 95 % band, V: the doubt of the model's values, not the noise of a
    reading; None for a model of which no doubt is known.
    """

    trace: Trace
    model: "Model"
    answer: Array
    half_band: Array | None = None

    def glance(self) -> Glance:
        """Return how far the answer lies from the recording."""
        off = ("recording minus model", self._off())
        return Glance("Simulation", f"{self.model.title} on {self.trace.name}", (off,))

    def words(self) -> Iterator[str]:
        """Tell how far a model's answer lies from the recording, as a terminal shows it."""
        from identify.observe import rms

        y = self.trace.y[:]
        span = rms((y - y.mean())[self._good()])
        yield f"{self.trace.name}: {self.model.title} from rest, {self.trace.size} samples"
        yield f"  recording minus model {self._off()}; y varies by {shown(span, 'V')} rms"
        if self.half_band is not None:
            half, most = rms(self.half_band), float(self.half_band.max())
            widths = f"{shown(half, 'V', 3)} rms, {shown(most, 'V', 3)} at most"
            yield f"  95 % band of the model, the noise of a reading left out: ± {widths}"

    def _good(self) -> "slice | Mask":
        return slice(None) if self.trace.valid is None else self.trace.valid

    def _off(self) -> str:
        from identify.observe import rms

        return f"{shown(rms((self.trace.y[:] - self.answer)[self._good()]), 'V')} rms"

    def plot(self) -> "list[Axes]":
        """Draw u, and the recorded y with the answer on top of it, on axes of pyplot; return the axes."""
        from identify.notebook.plots import signals

        trace, title = self.trace, f"{self.model.title} on {self.trace.name}"
        return signals(title, trace.rate_hz, {"u": trace.u, "y": trace.y}, trace.valid, trace.start_s, self.answer)

    def to_csv(self) -> str:
        """Return a table: time in s; u, recorded and simulated y, and the ends of its 95 % band in V."""
        trace, table = self.trace, io.StringIO()
        time = trace.start_s + np.arange(trace.size) / trace.rate_hz
        columns, header = [time, trace.u[:], trace.y[:], self.answer], "time_s,u_V,y_V,simulated_V"
        if self.half_band is not None:
            columns += [self.answer - self.half_band, self.answer + self.half_band]
            header += ",low95_V,high95_V"
        np.savetxt(table, np.column_stack(columns), delimiter=",", header=header, comments="", fmt="%.9g")
        return table.getvalue()
