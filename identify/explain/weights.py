"""Beside which law are readings weighed, and what does that leave to be explained?"""

from dataclasses import dataclass

from identify.effects.effect import Effect
from identify.explain.suspect import Suspect, is_fine
from identify.fit import Pull


@dataclass(frozen=True, eq=False)
class Carried:
    """A law beside whose chance readings are weighed (identify.explain.carried).

    A ``pull`` holds its numbers near what repeats tell of them; ``rough`` is by how much chi-squared may fall further
    because its mean is only nearly what the law says.
    """

    law: Effect
    pull: Pull
    rough: float = 0.0

    def leaves(self, suspect: Suspect) -> bool:
        """Return whether a correction promises more than the law may leave, and is no table as fine as its chance."""
        return suspect.gain > self.rough and not is_fine(suspect.correction)
