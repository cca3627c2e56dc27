"""Do the 95 % bands of bent borders hold the truth? ``python -m tests.benchmarks.bent_borders [realisations]``

The recordings are the independent integrator's: borders bent by a cubic term, and a rising law right behind straight
borders, which is the same as bending both; straight borders beside them. Every realisation has other noise and another
start, off by up to 2 %. Bands are looked at in nine places along each border, between the knots as well as on them.
"""

import sys
from dataclasses import dataclass
from functools import cache

import numpy as np

from identify.bent.bend import orders
from identify.bent.curved import CurvedPlay
from identify.chain import Chain
from identify.joint import fitted, observed
from identify.staircase import staircase
from identify.trace import Array, Trace
from identify.uncertainty.inflation import inflation
from identify.uncertainty.propagation import propagated
from tests.proof.cases import Concealed
from tests.proof.rigs import SKEWED, toleranced
from tests.proof.stimuli import FIG13_LEVELS_V, sine
from tests.proof.stimuli import staircase as levels
from tests.trials import model_of, noisy, recorded

RIG = SKEWED
NOISE_V = 0.010
PLACES = 9  # on each border
FINE = 16  # sub-steps of a sample in the integrator


@dataclass(frozen=True, eq=False)
class Shape:
    """How the borders are bent, and what the integrator calls it."""

    name: str
    physics: tuple[Concealed, ...] = ()

    def truth(self, side: int, v: Array) -> Array:
        """Return w on a border, V: side 0 is the loading one."""
        slope, crossing = ((RIG.s_l, RIG.d_l_v), (RIG.s_u, RIG.d_u_v))[side]
        for piece in self.physics:
            if piece.name == "curved_border":
                return (v - crossing) * (slope + piece.values["k3"] * np.square(v - crossing))
            return piece.values["level"] * np.tanh(slope * (v - crossing) / piece.values["level"])
        return slope * (v - crossing)


SHAPES = (
    Shape("straight"),
    Shape("cubic term", (Concealed("curved_border", {"k3": 0.05}),)),
    Shape("tanh behind F, 25 V", (Concealed("soft_saturation", {"level": 25.0}),)),
    Shape("tanh behind F, 12 V", (Concealed("soft_saturation", {"level": 12.0}),)),
)


@cache
def clean(shape: Shape) -> tuple[Trace, ...]:
    """Return the recordings without noise: a fast staircase and two sines, 2 s in all."""
    stimuli = (levels("stairs", FIG13_LEVELS_V, 0.03), sine("slow", 10.0, 3.4, 2, 3), sine("fast", 31.25, 8.0, 5, 4))
    return tuple(recorded(RIG, stimulus, shape.physics, fine=FINE) for stimulus in stimuli)


@dataclass(frozen=True)
class Trial:
    """One realisation: how far each place of both borders lies from the truth, in standard errors."""

    off: Array
    knots: int
    bent: bool


def trial(shape: Shape, seed: int) -> Trial:
    """Fit one realisation from a start that is off by up to 2 %."""
    traces = [noisy(trace, NOISE_V, 1000 * seed + i) for i, trace in enumerate(clean(shape))]
    model = model_of(toleranced(RIG, seed + 1))
    observations, _ = observed(model, traces)
    stairs = [p for o in observations for p in staircase(o, 0.2)]
    observations, straight = fitted(model, observations, stairs, None)  # as identify does before it bends the borders
    made = orders(straight, observations)
    found, stage = made.bent, made.bent.chain.stage_of(CurvedPlay)
    wider = inflation(found.chain, observations)
    off = []
    for side, points in enumerate((stage.start.loading, stage.start.unloading)):
        v = np.linspace(points[0][0], points[-1][0], PLACES)

        def border(chain: Chain, side: int = side, v: Array = v) -> Array:
            return stage.borders(chain.of(stage, ""))[side].at(v)

        intervals = propagated(found, border).intervals(wider)
        off += [(i.value - t) / ((i.high - i.low) / 3.92) for i, t in zip(intervals, shape.truth(side, v), strict=True)]
    return Trial(np.array(off), made.chosen.knots, made.pays)


def main(realisations: int) -> None:
    """Print one line a shape."""
    print(f"{realisations} realisations, {2 * PLACES} places each, noise {1e3 * NOISE_V:g} mV")
    print(f"{'borders':<22}{'held by the 95 % band':>22}{'rms off, in se':>16}{'called bent':>13}{'  knots':<20}")
    for shape in SHAPES:
        trials = [trial(shape, seed) for seed in range(realisations)]
        off = np.concatenate([t.off for t in trials])
        held, called = np.mean(np.abs(off) < 1.96), sum(t.bent for t in trials)
        knots = sorted({t.knots for t in trials})
        print(f"{shape.name:<22}{100.0 * held:>20.1f} %{np.sqrt(np.mean(off**2)):>16.2f}{called:>13}  {knots}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 40)
