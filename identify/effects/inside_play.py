"""How does physics that acts inside the play operator become part of a chain?"""

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass

from identify.altered_play import Alteration, Law, altered
from identify.blocks import Play
from identify.chain import Chain
from identify.effects.effect import Effect
from identify.stage import Grid, Parameter, Run, Shape, Values


@dataclass(frozen=True)
class InsidePlay(Effect, Alteration):
    """An effect that changes how w is taken along or held; several may be inside one operator.

    In forms and at places where it is not ``inside``, it is a stage of its own.
    """

    @property
    def inside(self) -> bool:
        """Return whether it acts inside the play operator."""
        return True

    def parameters(self) -> tuple[Parameter, ...]:
        """Return the declared parameters as its own; forms with fewer override this."""
        return self.own(self.declared)

    def applicable(self, chain: Chain) -> bool:
        """Return whether there is a gap in which to act, where it needs one."""
        return super().applicable(chain) and (not self.inside or chain.stage_of(Play) is not None)

    def put_in(self, chain: Chain, values: Mapping[str, float]) -> Chain:
        """Return ``chain`` with its play operator altered, ValueError when it has none; or with a stage of its own."""
        if not self.inside:
            return super().put_in(chain, values)
        play = chain.stage_of(Play)
        if play is None:
            raise ValueError(f"{self.id} needs a backlash in F")
        return chain.with_replaced(play, altered(play, self), self.named(values)).crediting(self)

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Refuse: the effect lives inside the play operator."""
        raise NotImplementedError("put_in changes the play operator; there is no stage of its own")

    @abstractmethod
    def altered(self, law: Law, values: Values, grid: Grid) -> Law:
        """Return the law of the play with this effect in it."""


def gap_v(chain: Chain) -> float:
    """Return how wide the gap of a chain's play operator is, V."""
    return abs(chain.values["F.D_L"] - chain.values["F.D_U"])


def mean_slope(chain: Chain) -> float:
    """Return the mean of the slopes of both borders of a chain's play operator, V/V."""
    return 0.5 * (chain.values["F.S_L"] + chain.values["F.S_U"])
