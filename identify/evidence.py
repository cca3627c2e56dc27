"""Which facts about recordings and a fitted chain does the search for missing physics start from?

Every fact is computed once. The plain parameters absorb part of any change, so a candidate is judged by what remains
of the residual after its change is made and the parameters have moved to first order (physics.md 3).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identify.chain import Chain
from identify.derivatives.sensitivities import sensitivities
from identify.discretise import Matrix
from identify.effects.effect import Effect
from identify.first_order import FirstOrder, Products
from identify.fit import Fit
from identify.levels import Levels, hats, knots_between, merit
from identify.noise import grid_step_v
from identify.observe import Observation, weighed
from identify.spectrum import highest_peak_hz
from identify.stage import Place, Stage
from identify.taps import Taps
from identify.thinning import thinned
from identify.trace import Array

SUBSTEPS = 1  # candidates are compared on the samples' own grid: the comparison needs no finer one


class Evidence(FirstOrder):
    """The residual of a fitted chain on its training data, and what any change of the chain would leave of it."""

    def __init__(
        self, fitted: Fit, observations: Sequence[Observation], every: Sequence[Observation] | None = None
    ) -> None:
        """Take a fit and the observations it was made on; nothing is computed yet.

        ``every`` are those of all samples, where ``observations`` are fewer (identify.thinning).
        """
        self.fitted = fitted
        self.chain = fitted.chain
        self.observations = tuple(observations)
        self._every = tuple(every or observations)
        self.coarse = self
        self.sample_s = 1.0 / observations[0].trace.rate_hz
        self.longest_s = max(o.trace.size for o in observations) * self.sample_s
        self._seen: dict[tuple[object, ...], tuple[float, float]] = {}
        self._levels: dict[Place, Levels] = {}
        self._normals: dict[tuple[object, ...], tuple[Matrix, Array]] = {}

    @cached_property
    def fine(self) -> "Evidence":
        """Return the same of all samples; itself where it is."""
        if self._every == self.observations:
            return self
        every = Evidence(self.fitted, self._every)
        every.coarse = self
        return every

    def seen_by(self, stage: Stage) -> "Evidence":
        """Return the evidence a stage is judged on: of all samples where means of them would hide what it does."""
        return self.fine if stage.quick else self

    def range(self, place: Place) -> tuple[float, float]:
        """Return the lowest and highest level of the signal behind a place, V, over all runs."""
        return self._ranges[place]

    @cached_property
    def _taps(self) -> Taps:
        """Return the fitted chain's signals in every run."""
        return Taps(self.chain, self.observations)

    @cached_property
    def _ranges(self) -> dict[Place, tuple[float, float]]:
        found = dict.fromkeys(Place, (0.0, 0.0))
        for tapped in self._taps.runs:
            for place in Place:
                tap = tapped.signals[self.chain.index(place) - 1][tapped.observation.use]
                low, high = found[place]
                found[place] = (min(low, float(np.min(tap))), max(high, float(np.max(tap))))
        return found

    def levels(self, place: Place) -> Levels:
        """Return what any memoryless law of the level behind a place would gain; fewer samples tell as much of it."""
        if self.coarse is not self:
            return self.coarse.levels(place)
        if place not in self._levels:
            knots = knots_between(*self.range(place))
            rows = np.concatenate([weighed(hats(self.chain, place, knots, o), o) for o in self.observations], axis=1)
            self._levels[place] = Levels(knots, *self.normal_of(rows))
        return self._levels[place]

    def rates(self, place: Place) -> tuple[float, ...]:
        """Return rates of change of the signal behind a place, V/s: zero and quantiles of those that occur."""
        at = self.chain.index(place) - 1
        moves = [np.abs(np.diff(tapped.signals[at])) / self.sample_s for tapped in self._taps.runs]
        moving = np.concatenate(moves)
        top = float(np.max(moving))
        if top == 0.0:
            return (-1.0, 0.0, 1.0)
        sizes = np.unique([np.quantile(moving[moving > 1e-3 * top], q) for q in (0.25, 0.5, 0.75, 0.95)] + [top])
        return (*(-sizes[::-1]).tolist(), 0.0, *sizes.tolist())

    @cached_property
    def strongest_line_hz(self) -> float:
        """Return the frequency at which the residual of the longest run has its highest peak, Hz, zero excluded."""
        longest = max(self.observations, key=lambda o: o.trace.size)
        return highest_peak_hz(longest.residual(self.chain), longest.use, self.sample_s)

    @cached_property
    def residual(self) -> Array:
        """Return the residual of the samples that count, all runs in a row, in units of the noise."""
        return np.concatenate([piece for o in self.observations for piece in o.whitened(self.chain)])

    @cached_property
    def slopes(self) -> Matrix:
        """Return the change of the answer per search coordinate, in units of the noise, shape (p, n).

        A coordinate the fit has pushed to its bound cannot mimic anything more: its row is zero.
        """
        fit = self.fitted
        free = [i for i, c in enumerate(fit.coordinates) if not c.at_bound(float(fit.theta[i]))]
        scales = {fit.coordinates[i].name: fit.coordinates[i].slope(float(fit.theta[i])) for i in free}
        coarse = [replace(o, substeps=SUBSTEPS) for o in self.observations]
        rows = np.zeros((len(fit.coordinates), self.residual.size))
        rows[free] = np.concatenate([sensitivities(self.chain, scales, o).slopes() for o in coarse], axis=1)
        return rows

    def change(self, chain: Chain) -> Array:
        """Return how a chain's answer differs from the fitted one's, in units of the noise."""
        return np.asarray(self.changes([chain])[0])

    def changes(self, chains: Sequence[Chain], unit: float = 1.0) -> Matrix:
        """Return how answers of chains differ from the fitted one's, in units of the noise and per ``unit``, (m, n)."""
        return self._taps.changes(chains, unit)

    def products_by_run(self, chains: Sequence[Chain], unit: float, owners: Sequence[NDArray[np.intp]]) -> Products:
        """Return the products of rows that chains make run by run, which are added where ``owners`` of a run say."""
        size = 1 + max(int(np.max(owner)) for owner in owners)
        found = Products.none(size, len(self.fitted.coordinates))
        for run, part, owner in zip(self._taps.runs, self._taps.parts, owners, strict=True):
            rows = np.empty((len(chains), run.observation.count))
            run.write_changes(chains, unit, rows)
            found.add(self.products_of(rows, part), owner)
        return found

    def gain(self, effect: Effect, values: Mapping[str, float]) -> float:
        """Return by how much chi-squared falls when ``effect`` is put in with ``values`` (by short name)."""
        along, energy = self._products(effect, values)
        return 2.0 * along - energy

    def merit(self, effect: Effect, values: Mapping[str, float]) -> float:
        """Return what speaks for an effect at ``values``: half its gain, half what it would gain at its best size."""
        along, energy = self._products(effect, values)
        return merit(2.0 * along - energy, along, energy)

    def _products(self, effect: Effect, values: Mapping[str, float]) -> tuple[float, float]:
        """Return the products of an effect's change with the residual and with itself."""
        key = (effect, tuple(sorted(values.items())))
        if key not in self._seen:
            self._seen[key] = self.products(self.change(effect.put_in(self.chain, values)))
        return self._seen[key]

    def best(self, effect: Effect, options: Sequence[Mapping[str, float]]) -> dict[str, float]:
        """Return the option of most merit, where none has any that which changes least; empty when there is none.

        Nor is there one where the effect cannot be put in.
        """
        if not options or not effect.applicable(self.chain):
            return {}
        told = [(self.merit(effect, values), -self._products(effect, values)[1]) for values in options]
        return dict(options[max(range(len(told)), key=told.__getitem__)])

    def scaled(self, effect: Effect, values: Mapping[str, float]) -> float:
        """Return the factor on the change that an effect makes at ``values`` at which it explains most; 0 for none."""
        return self._scaled(effect, values)[0]

    def sized(self, effect: Effect, name: str, options: Sequence[Mapping[str, float]]) -> list[dict[str, float]]:
        """Return options, each small, with ``name`` at what explains most if the answer goes in proportion to it."""
        return [{**values, name: self.scaled(effect, values) * values[name]} for values in options]

    def _scaled(self, effect: Effect, values: Mapping[str, float]) -> tuple[float, float]:
        """Return that factor, and the fall of chi-squared it promises."""
        change = self.change(effect.put_in(self.chain, values))
        free = self.without_plain(change[None, :])[0]
        energy, pull = float(change @ free), float(self.residual @ free)
        return (pull / energy, pull**2 / energy) if energy > 0.0 else (0.0, 0.0)

    def best_share(self, effect: Effect, name: str, options: Sequence[Mapping[str, float]]) -> dict[str, float]:
        """Return the option that gains most once ``name`` is what explains most, a share from 0 to 1; empty if none is.

        Every option has a small share already; the answer is taken to change in proportion to it.
        """
        scaled = [(*self._scaled(effect, values), values) for values in options]
        shares = [(gain, {**values, name: factor * values[name]}) for factor, gain, values in scaled]
        likely = [(gain, values) for gain, values in shares if 0.0 < values[name] < 1.0]
        return max(likely, key=lambda item: item[0])[1] if likely else {}

    def proportion(self, effect: Effect, name: str, size: float) -> dict[str, float]:
        """Return the value of ``name`` that gains most where the answer changes in proportion to it; empty if none.

        ``size`` is any value at which the change is well above rounding.
        """
        return self.proportions(effect, {name: size})

    def proportions(self, effect: Effect, sizes: Mapping[str, float]) -> dict[str, float]:
        """Return the values that gain most together where the answer changes in proportion to each; empty if none."""
        return self.proportions_beside(effect, {}, sizes, list(sizes))[0] if effect.applicable(self.chain) else {}

    def proportions_beside(
        self, effect: Effect, beside: Mapping[str, float], sizes: Mapping[str, float], names: Sequence[str]
    ) -> tuple[dict[str, float], float]:
        """Return the values of ``names`` that gain most together beside other values, and that fall of chi-squared.

        The answer is taken to change in proportion to each of them, the rest of ``sizes`` stay zero: they are looked
        at only once. Empty if none gains.
        """
        key = (effect, *beside.items(), *sizes.items())
        if key not in self._normals:
            chains = [effect.put_in(self.chain, {**beside, name: size}) for name, size in sizes.items()]
            self._normals[key] = self.normal_of(self.changes(chains))
        matrix, right = self._normals[key]
        at = [list(sizes).index(name) for name in names]
        matrix, right = matrix[np.ix_(at, at)], right[at]
        if not np.all(np.isfinite(matrix)) or not np.any(matrix):
            return {}, 0.0
        weights = np.linalg.pinv(matrix, rcond=1e-9, hermitian=True) @ right
        return {name: sizes[name] * float(w) for name, w in zip(names, weights, strict=True)}, float(weights @ right)

    @cached_property
    def compared_v(self) -> tuple[Array, Array]:
        """Return the fitted chain's answer and the residual where samples count, all runs in a row, V."""
        answers = [tapped.signals[-1][tapped.observation.use] for tapped in self._taps.runs]
        return np.concatenate(answers), np.concatenate([o.used_residual(self.chain) for o in self.observations])

    @cached_property
    def grid_step_v(self) -> float:
        """Return the step of the grid on which all readings lie, V; 0 when they lie on none."""
        return grid_step_v([o.trace for o in self.observations])

    def parts(self) -> list[tuple[str, slice]]:
        """Return the stretch of the joined residual that belongs to each run."""
        return [(o.trace.name, part) for o, part in zip(self.observations, self._taps.parts, strict=True)]


def evidence_of(fitted: Fit, observations: Sequence[Observation]) -> Evidence:
    """Return what the residual of a fit tells, of as few samples as tell all of it."""
    few = thinned(fitted, observations)
    evidence = Evidence(fitted, few.observations, observations)
    return evidence if few.whole else evidence.fine
