"""Two clocks where one was meant: the ADC runs slower or faster than the DAC."""

from typing import TYPE_CHECKING, ClassVar, final

import numpy as np

from identify import kernels
from identify.effects.effect import Confusion, Effect
from identify.stage import Block, Grid, Parameter, Place, Run, Shape, Values
from identify.trace import Array

if TYPE_CHECKING:
    from identify.evidence import Evidence

PPM = Parameter("clock_skew.ppm", "ppm", scale=10.0)
MILLIONTH = 1e-6
REACH = 4  # instants a reading between them is drawn from


@final
class ClockSkew(Effect):
    """Readings taken at times stretched by a few millionths; both clocks start together at the start of a run.

    A reading between instants lies on the cubic through the four around it. One past the end of what is known yet (a
    slow ADC at the end of a block of 65,536 instants or of the run) is continued by the last cubic: for shifts of up
    to a few samples there, that is 100 ppm over a run of 40,000 samples.
    """

    id = "clock_skew"
    title = "skew of the clocks"
    equation = "y'(t) = y(t - ppm 1e-6 t), t from the start of the run"
    sentence = (
        "The clocks of DAC and ADC differ by {} (positive: the ADC's is fast, it reads ever earlier). Share one clock "
        "or one trigger per period, or resample the reading."
    )
    axis = "time in a run"
    fingerprint = "phase error grows with time"
    quick = True
    places = (Place.SENSE,)
    shapeless = True
    declared = (PPM,)
    absent: ClassVar = {"ppm": 0.0}
    confused_with = (
        Confusion("dead_time", "one sine over a long run: a delay stays, a skew grows with time"),
        Confusion("missing_samples", "one sine over a long run: lost samples shift the phase at once, a skew steadily"),
    )
    example: ClassVar = {"ppm": 300.0}

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the stretch at work; it keeps as much of the past as the clocks have moved apart."""
        stretch = -values[0] * MILLIONTH
        past, past_from = np.zeros(1), -1  # at rest before the first

        def run(block: Block) -> Array:
            nonlocal past, past_from
            if stretch == 0.0:
                return block.signal
            known, end = np.concatenate((past, block.signal)), block.first + block.signal.size
            out = np.empty_like(block.signal)
            ahead = np.zeros(max(REACH - known.size, 0))
            start = block.first * (1.0 + stretch) - past_from
            kernels.drawn(np.concatenate((known, ahead)), start, 1.0 + stretch, out)
            keep = min(known.size, REACH + int(np.ceil(max(-stretch, 0.0) * end)))
            past, past_from = known[known.size - keep :], end - keep
            return out

        return run, shape

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the skew that explains most, the answer taken as proportional to it, and once more at its size."""
        best = evidence.proportion(self, "ppm", 1.0)
        again = evidence.proportion(self, "ppm", best["ppm"]) if best.get("ppm") else {}
        found = evidence.best(self, [start for start in (best, again) if start])
        return [found] if found else []

