"""A capacitor of a filter that is not the same at every voltage."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar, final

import numpy as np

from identify import charging
from identify.chain import Chain, signals
from identify.effects.adc_nonlinearity import AdcNonlinearity
from identify.effects.curved_border import CurvedBorder
from identify.effects.effect import Confusion, Effect, short
from identify.effects.inside_play import mean_slope
from identify.lags import time_constants
from identify.observe import Observation
from identify.stage import Block, Eightfold, Grid, Parameter, Place, Run, Shape, Values
from identify.trace import Array

if TYPE_CHECKING:
    from identify.evidence import Evidence

K1 = Parameter("capacitor_nonlinearity.k1", "1/V", scale=1e-2)
K2 = Parameter("capacitor_nonlinearity.k2", "1/V^2", scale=1e-3)
TAU = Parameter("capacitor_nonlinearity.tau", "s", "log", within=10.0)  # without end it would be a map of the level
FULLEST = "straight and square"
LAWS = {"square": (K2, TAU), "straight": (K1, TAU), FULLEST: (K1, K2, TAU)}
SMALL = {"k1": 1e-4, "k2": 1e-5}  # 1/V, 1/V^2: the change is looked at where it is proportional, well above rounding
TAUS = np.geomspace(0.3, 3e3, 9)  # samples
SIMULATED = 3  # of these, that promise most
ENDLESS_S = 1.0  # of tau, from which a capacitor hardly discharges within a step
OWN, SLOW = 2.0, 0.1  # times a time constant that is its block's; of the slowest, from which one is slow
GROWN = 2.0  # times its size at rest: a junction that begins to conduct; no part grows further with voltage
BENT = {"square": "cube", "straight": "square", FULLEST: "square and cube"}  # what a law is where it does not


@dataclass
class _Charging(Eightfold):
    """Such a capacitor at work, its ``tau`` in steps."""

    k1: float
    k2: float
    tau: float
    state: tuple[float, float] = (0.0, 0.0)

    def __call__(self, block: Block) -> Array:
        """Return the signal behind it."""
        if self.k1 == self.k2 == 0.0:
            return block.signal
        out = np.empty_like(block.signal)
        self.state = charging.charged(self.k1, self.k2, self.tau, self.state, block.signal, out)
        return out

    @staticmethod
    def abreast(runs: Sequence[Eightfold]) -> Callable[[Array], None]:
        """Return eight capacitors at work, each on a signal."""
        given = [charging.constants(r.k1, r.k2, r.tau) for r in runs if isinstance(r, _Charging)]
        capacitors, state = np.array(given).T.copy(), np.zeros((2, len(given)))
        return lambda signals: charging.charged_abreast(capacitors, state, signals)


@final
class CapacitorNonlinearity(Effect):
    """A capacitor C (1 - k1 s - k2 s^2) in a first-order low-pass of G1 or G2: a class-2 ceramic (k2), a junction (k1).

    ``tau`` tells which: it is the time constant that the capacitor makes at small levels.
    """

    id = "capacitor_nonlinearity"
    title = "capacitor that depends on its voltage"
    equation = "C (1 - k1 s' - k2 s'^2) in a low-pass of tau: tau (1 - k1 s' - k2 s'^2) ds'/dt + s' = tau ds/dt + s"
    sentence = (
        "A capacitor of a filter is smaller or larger at higher voltage: {}. The one that makes this time constant is "
        "a class-2 ceramic or a junction: use C0G or film."
    )
    axis = "level of v"
    fingerprint = "edges faster or slower at high levels; at rest no level is wrong"
    places = (Place.G1, Place.G2)
    forms = ("square", "straight", FULLEST)
    declared = (K1, K2, TAU)
    absent: ClassVar = {"k1": 0.0, "k2": 0.0, "tau": 1.0}
    confused_with = (
        Confusion("source_nonlinearity", "a staircase watched until it rests: a bent source is wrong there, too"),
        Confusion("curved_border", "a staircase watched until it rests: a capacitor shows on the way only"),
        Confusion("adc_nonlinearity", "a staircase watched until it rests: a bent scale is wrong there, too"),
        Confusion("slew_limit", "two amplitudes at one frequency: slewing sets in above a rate, this grows evenly"),
        Confusion("extra_pole", "two amplitudes at one frequency: a pole does the same to both"),
    )
    example: ClassVar = {"k1": 0.03, "k2": 0.02, "tau": 4e-3}

    @property
    def along(self) -> str:
        """Return the level behind the block it is in."""
        return "level of x" if self.place is Place.G2 else self.axis

    def parameters(self) -> tuple[Parameter, ...]:
        """Return the parameters of the form."""
        return self.own(LAWS[self.form])

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the running filter, without charge."""
        given = dict(zip(LAWS[self.form], values, strict=True))
        return _Charging(given.get(K1, 0.0), given.get(K2, 0.0), given[TAU] / grid.step_s), shape

    def plausible(self, chain: Chain, observations: Sequence[Observation]) -> bool:
        """Return whether no level makes more of the capacitor than any part does: ceramics lose, junctions gain."""
        k1, k2 = (chain.values.get(self.called(k), 0.0) for k in (K1, K2))
        levels = [signals(chain, o.trace)[chain.index(self.place) - 1] for o in observations]
        s = np.array([end for level in levels for end in (np.min(level), np.max(level))])
        return bool(np.all(1.0 - k1 * s - k2 * np.square(s) <= GROWN))

    def ordinary(self, chain: Chain) -> bool:
        """Return whether it makes none of the slow lags of its block: so do delays and lags that hang on much else."""
        tau, own = chain.values[self.called(TAU)], time_constants(chain, self.place)
        return not any(max(tau / t, t / tau) < OWN for t in own if t > SLOW * own[0])

    def plainer(self, chain: Chain) -> tuple[Effect, dict[str, float]] | None:
        """Return the bent scale that is left of it where it does not discharge: of F in G1, of the reading in G2."""
        at_f, form = self.place is Place.G1, BENT[self.form]
        law = CurvedBorder(Place.F, form) if at_f else AdcNonlinearity(Place.SENSE, form)
        if chain.values[self.called(TAU)] < ENDLESS_S or not law.applicable(chain):
            return None
        k1, k2 = (chain.values.get(self.called(k), 0.0) for k in (K1, K2))
        slope = mean_slope(chain) if at_f else 1.0
        bent = {"k2": 0.5 * k1 * slope, "k3": k2 / 3.0 * slope}
        return law, {p.name: bent[short(p.name)] for p in law.parameters()}

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the time constant that explains most with the law that suits it, taken as proportional."""
        names = [short(p.name) for p in LAWS[self.form] if p is not TAU]
        fullest = replace(self, form=FULLEST)  # whose changes are those of every form
        taus = [{"tau": float(count) * evidence.sample_s} for count in TAUS]
        found = [(tau, *evidence.proportions_beside(fullest, tau, SMALL, names)) for tau in taus]
        likely = sorted((one for one in found if one[1]), key=lambda one: -one[2])[:SIMULATED]
        best = evidence.best(self, [{**tau, **values} for tau, values, _ in likely])
        return [best] if best else []
