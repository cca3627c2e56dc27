"""How does a trial prove that its truth was fixed before the tool was asked?

The truth is a text; the SHA-256 of text and salt is written down before the tool sees a recording, text and salt only
after it has answered. The salt keeps a truth with few possibilities from being guessed from its seal.
"""

import hashlib
import json
import secrets
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from tests.proof.trial import Trial


@dataclass(frozen=True)
class Sealed:
    """A truth as text, and the salt that seals it."""

    text: str
    salt: str

    @property
    def seal(self) -> str:
        """Return the seal: hexadecimal SHA-256 of text and salt."""
        return hashlib.sha256((self.text + self.salt).encode()).hexdigest()


def sealed(trial: Trial) -> Sealed:
    """Return the truth of a trial under a salt of its own."""
    return Sealed(json.dumps(truth_of(trial), sort_keys=True), secrets.token_hex(16))


def truth_of(trial: Trial) -> dict[str, object]:
    """Return what a trial conceals: the rig, the laws with their values, their names if they have any, and their z."""
    return {
        "stratum": trial.key.stratum,
        "rig": asdict(trial.rig),
        "laws": [asdict(concealed) for concealed in trial.physics],
        "z": [round(z, 2) for z in trial.z],
        "named": [asdict(finding) for finding in trial.expected],
        "unheard": [asdict(finding) for finding in trial.unheard],
    }


def opened_as_sealed(entry: Mapping[str, Any]) -> None:
    """Raise ValueError where the truth of an entry of a study is not the one that was sealed."""
    if Sealed(entry["truth"], entry["salt"]).seal != entry["seal"]:
        raise ValueError(f"{entry['trial']}: the truth is not what was sealed before the tool was asked")
