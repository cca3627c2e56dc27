"""What does a change of the answer gain to first order, once the parameters that are fitted already have moved with it?

All of that are products of changes with each other, with the residual, and with what those parameters do: of rows of
many samples only a few numbers are asked.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from identify.chain import Chain
from identify.discretise import Matrix
from identify.fit import Fit
from identify.trace import Array, Mask

Cube = NDArray[np.float64]  # of three axes
ALL = slice(None)
AT_ONCE = 1 << 13  # samples of which some rows stay in the near cache
ALIKE = 1e-12  # of the information of a parameter: by less than that rounding may be told apart from another's
FARTHEST = 0.5  # of a search coordinate, that a fitted parameter is moved to first order


@dataclass(frozen=True)
class Products:
    """The products of m rows with themselves, with the residual, and with the slopes of p fitted parameters.

    Shapes (m, m), (m,) and (p, m), all in units of the noise; rows that are not finite have products that are not.
    """

    square: Matrix
    along: Array
    mimic: Matrix

    @classmethod
    def none(cls, rows: int, fitted: int) -> "Products":
        """Return those of rows that are zero."""
        return cls(np.zeros((rows, rows)), np.zeros(rows), np.zeros((fitted, rows)))

    def add(self, other: "Products", at: NDArray[np.intp]) -> None:
        """Add the products of rows with numbers ``at``, of other samples."""
        self.square[np.ix_(at, at)] += other.square
        self.along[at] += other.along
        self.mimic[:, at] += other.mimic

    @property
    def energies(self) -> Array:
        """Return the sum of squares of every row."""
        return self.square.diagonal()

    def of(self, rows: Mask) -> "Products":
        """Return those of some of the rows."""
        return Products(self.square[rows][:, rows], self.along[rows], self.mimic[:, rows])


class FirstOrder(ABC):
    """A residual beside the parameters that were fitted, and what changes would leave of it."""

    fitted: Fit

    @property
    @abstractmethod
    def residual(self) -> Array:
        """Return the residual of the samples that count, all runs in a row, in units of the noise, shape (n,)."""

    @property
    @abstractmethod
    def slopes(self) -> Matrix:
        """Return the change of the answer per search coordinate, in units of the noise, shape (p, n)."""

    @cached_property
    def _normal(self) -> tuple[Matrix, bool]:
        square = self.slopes @ self.slopes.T + np.diag([c.prior_sd**-2.0 for c in self.fitted.coordinates])
        own = square.diagonal()
        return cho_factor(square + np.diag(np.where(own > 0.0, ALIKE * own, 1.0)))

    def step(self, made: Array) -> Array:
        """Return by how much the fitted parameters move, in search coordinates, to first order.

        ``made`` is what a change beside them does along their slopes, shape (p,).
        """
        return np.asarray(cho_solve(self._normal, self._pull - made)) if self.fitted.coordinates else np.empty(0)

    def left_by(self, residual: Array) -> float:
        """Return the sum of squares of a residual once the fitted parameters have moved to first order."""
        if not np.all(np.isfinite(residual)):
            return float("inf")
        if not self.fitted.coordinates:
            return float(residual @ residual)
        pull = self.slopes @ residual
        return float(residual @ residual - pull @ cho_solve(self._normal, pull))

    def without_plain(self, rows: Matrix) -> Matrix:
        """Return rows (m, n) less what the fitted parameters could mimic to first order."""
        if not self.fitted.coordinates:
            return rows
        return np.asarray(rows - (cho_solve(self._normal, self.slopes @ rows.T)).T @ self.slopes)

    @cached_property
    def left(self) -> float:
        """Return the sum of squares that the fitted chain leaves."""
        return self.left_by(self.residual)

    def gained(self, change: Array) -> float:
        """Return the fall of chi-squared once a change is made and the fitted parameters have moved to first order."""
        along, energy = self.products(change)
        return 2.0 * along - energy

    def products(self, change: Array) -> tuple[float, float]:
        """Return the products of a change with the residual and with itself, less what fitted parameters mimic."""
        size = float(change @ change)
        if not np.isfinite(size):
            return 0.0, float("inf")
        if not self.fitted.coordinates:
            return float(self.residual @ change), size
        moved = self.slopes @ change
        return float(self._left_over @ change), size - float(moved @ cho_solve(self._normal, moved))

    def normal_of(self, rows: Matrix, change: Array | None = None) -> tuple[Matrix, Array]:
        """Return curvature (m, m) and slope (m,) of chi-squared's fall along ``rows``, where ``change`` is made."""
        if change is None:
            return self.less_plain(self.products_of(rows))
        products = Products(rows @ rows.T, rows @ (self.residual - change), self.slopes @ rows.T)
        return self.less_plain(products, self.slopes @ change)

    def products_of(self, rows: Matrix, part: slice = ALL) -> Products:
        """Return the products of rows with themselves, the residual and the slopes; rows of a ``part`` of all samples.

        Stretch by stretch: what is in the near cache is multiplied by all it is asked for before the next is fetched.
        """
        residual, slopes = self.residual[part], self.slopes[:, part]
        square, along, mimic = np.zeros((len(rows), len(rows))), np.zeros(len(rows)), np.zeros((len(slopes), len(rows)))
        for at in range(0, rows.shape[1], AT_ONCE):
            there = slice(at, at + AT_ONCE)
            some = rows[:, there]
            square += some @ some.T
            along += some @ residual[there]
            mimic += slopes[:, there] @ some.T
        return Products(square, along, mimic)

    def less_plain(self, products: Products, made: Array | float = 0.0) -> tuple[Matrix, Array]:
        """Return curvature and slope of chi-squared's fall along rows less what the fitted parameters mimic.

        ``made`` is what is changed already along their slopes, shape (p,).
        """
        if not self.fitted.coordinates:
            return products.square, products.along
        mimic = products.mimic
        asked = cho_solve(self._normal, np.column_stack([mimic, self._pull - made]))
        return products.square - mimic.T @ asked[:, :-1], products.along - mimic.T @ asked[:, -1]

    def less_plain_each(self, squares: Cube, alongs: Matrix, mimics: Cube) -> tuple[Cube, Matrix]:
        """Return the same of many sets of rows at once, shapes (w, m, m), (w, m) and (w, p, m)."""
        if not self.fitted.coordinates:
            return squares, alongs
        count, fitted, rows = mimics.shape
        flat = mimics.transpose(1, 0, 2).reshape(fitted, count * rows)
        asked = np.asarray(cho_solve(self._normal, flat)).reshape(fitted, count, rows).transpose(1, 2, 0)
        pulled = np.asarray(cho_solve(self._normal, self._pull))
        return squares - asked @ mimics, alongs - pulled @ mimics

    def followed(self, chain: Chain, change: Array) -> Chain:
        """Return ``chain`` with the fitted parameters moved to first order to where its ``change`` asks them to be."""
        fit = self.fitted
        if not fit.coordinates:
            return chain
        pull = fit.theta * np.array([c.prior_sd for c in fit.coordinates]) ** -2.0
        step = cho_solve(self._normal, self.slopes @ (self.residual - change) - pull)
        there = fit.theta + np.clip(step, -FARTHEST, FARTHEST)
        pairs = zip(fit.coordinates, there, strict=True)
        return chain.with_values({c.name: c.value(c.bounded(float(t))) for c, t in pairs})

    @cached_property
    def _pull(self) -> Array:
        """Return what the residual asks of the fitted parameters: half the slope of chi-squared's fall along each."""
        return np.asarray(self.slopes @ self.residual)

    @cached_property
    def _left_over(self) -> Array:
        """Return the residual less what the fitted parameters could still take of it."""
        return np.asarray(self.without_plain(self.residual[None, :])[0])
