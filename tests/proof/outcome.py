"""Was the answer to one trial right: its names, its stage, its intervals, its proof?

A name is right when that physics was concealed, wherever the answer puts it; a stage is right when the mismatch is
located there, or when the right name is given there.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from tests.proof.seal import opened_as_sealed

TO_THE_NOISE = 1.1


@dataclass(frozen=True)
class Truth:
    """One concealed piece: its id, stage, parameters as the catalogue calls them, and its z."""

    id: str
    stage: str
    parameters: dict[str, float]
    z: float


@dataclass(frozen=True)
class Claim:
    """A name with the probability it was given, and whether that physics was there."""

    id: str
    probability: float
    true: bool


@dataclass(frozen=True)
class Outcome:
    """A trial that was answered and opened."""

    trial: str
    commit: str
    stratum: str
    concealed: tuple[Truth, ...]
    known: bool
    said: dict[str, Any]
    reply: dict[str, Any]

    @property
    def seed(self) -> int:
        """Return the seed it was drawn from."""
        return int(self.trial.partition("/")[0])

    @property
    def failed(self) -> bool:
        """Return whether the tool broke instead of answering."""
        return not self.said

    @property
    def verdict(self) -> str:
        """Return the verdict, ``failure`` when there is none."""
        return str(self.said.get("verdict", "failure"))

    @property
    def ids(self) -> tuple[str, ...]:
        """Return the ids of what was concealed."""
        return tuple(truth.id for truth in self.concealed)

    @property
    def findings(self) -> list[dict[str, Any]]:
        """Return the findings that give a name."""
        return [finding for finding in self.said.get("effects", []) if finding["id"] != "unnamed"]

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names given first."""
        return tuple(finding["id"] for finding in self.findings)

    @property
    def mentioned(self) -> set[str]:
        """Return every name given first or as an alternative."""
        return {claim.id for claim in self.claims()}

    @property
    def wrong(self) -> tuple[str, ...]:
        """Return the names given first that are not true."""
        return tuple(name for name in self.names if not self.known or name not in self.ids)

    @property
    def first(self) -> bool:
        """Return whether all that was concealed is named first, and nothing else."""
        return self.known and sorted(self.names) == sorted(self.ids)

    @property
    def within(self) -> bool:
        """Return whether all that was concealed is named first or as an alternative."""
        return self.known and set(self.ids) <= self.mentioned

    @property
    def placed(self) -> bool:
        """Return whether the stage of one of the concealed is the stage told."""
        stages = {truth.stage for truth in self.concealed}
        told = {f["stage"] for f in self.findings if f["id"] in self.ids and self.known}
        return bool(stages & (told | {self._location.get("stage")}))

    @property
    def _location(self) -> dict[str, Any]:
        return self.said.get("location") or {}

    @property
    def placed_or_listed(self) -> bool:
        """Return whether the stage is told, or listed among those that the data cannot exclude."""
        return self.placed or bool({t.stage for t in self.concealed} & set(self._location.get("alternatives", [])))

    @property
    def placed_as_one(self) -> bool:
        """Return whether the stage is told, or one told at which it is said to give exactly the same data."""
        return self.placed or bool({t.stage for t in self.concealed} & set(self._location.get("same_data", [])))

    @property
    def held_out_ratio(self) -> float:
        """Return the held-out residual of the improved model over the noise."""
        held = self.said["fit"]["held_out"]
        return float(held["after"] / held["noise"])

    @property
    def simulations(self) -> float:
        """Return what the answer cost on the processor's clock, counted in simulations of the plain model."""
        return float(self.reply["processor_s"] / self.reply["simulation_s"])

    def claims(self) -> Iterator[Claim]:
        """Yield every name told with its probability."""
        for finding in self.findings:
            for told in (finding, *finding["could_also_be"]):
                true = self.known and told["id"] in self.ids
                yield Claim(told["id"], float(told["probability"]), true)

    def intervals(self) -> Iterator[tuple[str, bool]]:
        """Yield every parameter of every right name at its right stage, and whether its interval holds the truth."""
        for truth in self.concealed if self.known else ():
            for finding in self.findings:
                if (finding["id"], finding["stage"]) == (truth.id, truth.stage):
                    for name, value in truth.parameters.items():
                        told = finding["parameters"].get(name)
                        if told is not None:
                            yield f"{truth.id}.{name}", _holds(told["ci95"], value)

    def steps(self) -> Iterator[tuple[str, float]]:
        """Yield the sentences of progress and how many simulations' time passed until the next one."""
        told = [*self.reply["steps"], ("", self.reply["processor_s"])]
        for (sentence, at), (_, until) in pairwise(told):
            yield sentence, (until - at) / self.reply["simulation_s"]


def _holds(ends: list[float | None], value: float) -> bool:
    """Return whether an interval, open where an end is missing, holds a value."""
    low, high = ends
    return (low is None or low <= value) and (high is None or value <= high)


def opened(entry: dict[str, Any]) -> Outcome:
    """Return the outcome of an entry of the study; ValueError when its truth is not the one that was sealed."""
    opened_as_sealed(entry)
    truth, reply = json.loads(entry["truth"]), entry["reply"]
    found = truth["named"] or truth["unheard"]
    concealed = tuple(Truth(f["id"], f["stage"], f["parameters"], z) for f, z in zip(found, truth["z"], strict=True))
    return Outcome(
        entry["trial"], entry["commit"], truth["stratum"], concealed, not truth["unheard"], reply["said"], reply
    )
