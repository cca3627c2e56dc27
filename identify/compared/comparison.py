"""What is the answer to "what changed between these recordings"?"""

from dataclasses import dataclass
from typing import Literal

from identify.compared.account import Account
from identify.compared.change import FALSE_ALARMS, Change
from identify.compared.device import ByDevice
from identify.compared.physics import PhysicsChange
from identify.compared.together import Rise
from identify.explain.explanation import Explanation
from identify.identification import Identification
from identify.interval import number
from identify.notebook.glance import Glance, Seen

SCHEMA = "rig.compare/1"
Verdict = Literal["changed", "no change seen", "cannot tell"]


@dataclass(frozen=True, repr=False)
class Comparison(Seen):
    """What changed, and how sure that is; both sides are identified with the physics they need.

    ``cannot tell``: values differ, but not surely because the rig does; ``unproven`` says why (else empty).

    ``joint`` tests all values together, ``changes`` each of them, ``physics`` what appeared or went. ``account`` names
    the few numbers that account for a change of values, ``device`` says whether the device alone could have made it.
    """

    verdict: Verdict
    sentence: str
    joint: Rise
    changes: tuple[Change, ...]
    physics: tuple[PhysicsChange, ...]
    account: Account | None
    device: ByDevice | None
    before: Identification
    after: Identification
    told: tuple[Explanation, Explanation] | None
    unproven: str = ""
    warnings: tuple[str, ...] = ()

    @property
    def p_value(self) -> float:
        """Return how often chance alone moves the values as much, all tests counted in."""
        return overall(self.joint, self.changes)

    def glance(self) -> Glance:
        """Return the verdict and what changed."""
        from identify.notebook.answers import of_comparison

        return of_comparison(self)

    def to_dict(self) -> dict[str, object]:
        """Return the answer of ``rig compare --json``, schema rig.compare/1, without what differs in the files."""
        return {
            "schema": SCHEMA, "verdict": self.verdict, "sentence": self.sentence,
            "unproven": self.unproven or None, "p_value": number(self.p_value, 3), "false_alarms": FALSE_ALARMS,
            "joint": self.joint.to_dict(),
            "parameters": [change.to_dict() for change in self.changes],
            "physics": [piece.to_dict() for piece in self.physics] if self.told else None,
            "account": self.account.to_dict() if self.account else None,
            "device_alone": self.device.to_dict() if self.device else None,
            "fit": {side: _fit(found) for side, found in (("before", self.before), ("after", self.after))},
            "explained": [told.verdict for told in self.told] if self.told else None,
            "warnings": list(self.warnings),
        }  # fmt: skip


def overall(joint: Rise, changes: tuple[Change, ...]) -> float:
    """Return the p-value of the joint test and the tests of single numbers together: either may raise the alarm."""
    return min(1.0, 2.0 * min(joint.p_value, *(change.adjusted for change in changes)))


def _fit(found: Identification) -> dict[str, object]:
    """Return how well one side fits."""
    return {
        "runs": [o.trace.name for o in found.observations], "rms_V": number(found.rms_v),
        "noise_rms_V": number(found.noise.rms_v), "noise_from": found.noise.origin,
        "physics": [piece.id for piece in found.model.physics],
        "covariance": found.certainty.to_dict() if found.certainty else None,
    }  # fmt: skip
