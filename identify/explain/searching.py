"""How is a chain fitted to data on grids that stay?

What acts by chance makes a fit take long, and what readings are weighed beside, too: means of a few readings lead most
of the way there.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

from identify.chain import Chain
from identify.effects.effect import Effect
from identify.explain.ahead import Search, gone_ahead
from identify.explain.wander import sizing
from identify.explain.weights import Carried
from identify.fit import Fit, Pull, fit
from identify.observe import Observation

ENOUGH = 0.3  # of chi-squared: steps that gain less together change no odds
ROUGHER = 4  # instants of a grid to one of that on which slopes are taken


@dataclass(frozen=True)
class Searching:
    """The values at which the priors of a fit sit, what is not fitted, and what the readings are weighed beside."""

    centre: Mapping[str, float]
    fixed: tuple[str, ...]
    carried: Carried | None

    def led(
        self, chain: Chain, effects: Sequence[Effect], seen: tuple[Observation, ...], iterations: int, told: bool
    ) -> Fit:
        """Fit a chain from its own values; where that takes long and means lead the way, only its end on all readings.
        """
        takes_long = self.carried is not None or any(effect.by_chance for effect in effects)
        search = self._from(chain, self._pull(chain, effects, seen), iterations, told)
        ahead = gone_ahead(chain, seen, search) if takes_long and iterations else None
        if ahead is None:
            return self.searched(chain, effects, seen, iterations, told)
        return self.searched(ahead.chain, effects, seen, iterations, told, near=True) if ahead.converged else ahead

    def searched(
        self, chain: Chain, effects: Sequence[Effect], seen: tuple[Observation, ...], iterations: int,
        told: bool = True, enough: float = ENOUGH, near: bool = False,
    ) -> Fit:  # fmt: skip
        """Fit a chain from its own values; where what it makes by chance shows, its size is told by that, too."""
        found = self._from(chain, self._pull(chain, effects, seen), iterations, told, enough, near)(seen)
        pull = None if self._is_told(effects) else sizing(found.chain, effects, seen)
        return self._from(found.chain, pull, iterations, told, enough, near)(seen) if pull else found

    def _from(
        self, chain: Chain, pull: Pull | None, iterations: int, told: bool, enough: float = ENOUGH, near: bool = False
    ) -> Search:
        """Return the search from a chain's own values."""
        return partial(
            fit, chain, centre=self.centre, fixed=self.fixed, iterations=iterations, pull=pull, valleys=False,
            enough=enough, rougher=ROUGHER if enough else 1, told=told, near=near,
        )  # fmt: skip

    def _pull(self, chain: Chain, effects: Sequence[Effect], seen: tuple[Observation, ...]) -> Pull | None:
        """Return what is known of the size of what acts by chance, of which a mean alone would say little."""
        return self.carried.pull if self.carried and self._is_told(effects) else sizing(chain, effects, seen)

    def _is_told(self, effects: Sequence[Effect]) -> bool:
        """Return whether repeats have told the size of what acts by chance."""
        return self.carried is not None and self.carried.law in effects
