"""Did the tool find what a changed part must cause: the physics, its value, and a model that proves itself?"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from tests.proof.circuit.changes import NO_NAME, OWN, Change, Circuit

Answer = Mapping[str, Any]
Outcome = Literal["found", "missed", "wrong"]
CLOSE = 0.1  # of the value by hand: asked where the interval does not cover it
AT_NOISE = 1.5  # times the noise: most that may be left of data kept back
HALVED = 0.5
SURE = 0.5  # a name with a larger probability is called


@dataclass(frozen=True)
class Value:
    """A value by hand and as told, with its interval where it has one; ``told`` None where it was not told."""

    name: str
    by_hand: float
    told: float | None
    interval: tuple[float, float] | None = None

    @property
    def right(self) -> bool:
        """Return whether the interval covers the value by hand, or the two are close."""
        if self.told is None:
            return False
        covered = self.interval is not None and self.interval[0] <= self.by_hand <= self.interval[1]
        return covered or abs(self.told - self.by_hand) <= CLOSE * abs(self.by_hand)


@dataclass(frozen=True)
class Verdict:
    """What an answer is worth. ``before`` and ``after`` are residuals held out, in times the noise."""

    outcome: Outcome
    why: str
    values: tuple[Value, ...]
    before: float
    after: float


def judged(circuit: Circuit, answer: Answer) -> Verdict:
    """Return what an answer to the recordings of a changed circuit is worth."""
    values = tuple(value for change in circuit.changes for value in _values(change, answer))
    held = answer["fit"]["held_out"]
    before, after = held["before"] / held["noise"], held["after"] / held["noise"]
    wrong = [e["id"] for e in answer["effects"] if e["probability"] > SURE and not _true(circuit, e)]
    flaws = list(_flaws(circuit, answer, values, before, after))
    outcome: Outcome = "wrong" if wrong else "missed" if flaws else "found"
    return Verdict(outcome, "; ".join([*(f"called {name}" for name in wrong), *flaws]), values, before, after)


def _true(circuit: Circuit, effect: Answer) -> bool:
    """Return whether a name is that of what a change brings, of what each of the circuits has, or none."""
    if effect["id"] == NO_NAME or any(effect["id"] in (c.effect, *c.also) for c in circuit.changes):
        return True
    told, own = effect["parameters"], OWN.get(effect["id"], {})
    return any(_value(name, by_hand, told.get(name)).right for name, by_hand in own.items())


def _flaws(circuit: Circuit, answer: Answer, values: tuple[Value, ...], before: float, after: float) -> list[str]:
    """Return what is asked of an answer and not so."""
    flaws = [f"{value.name} not within {CLOSE:.0%}" for value in values if not value.right]
    if any(change.effect == NO_NAME for change in circuit.changes):
        return flaws + _misplaced(circuit, answer)
    if after > AT_NOISE:
        flaws.append(f"{after:.3g} x noise left")
    asked = {(change.effect, change.stage) for change in circuit.changes if change.effect}
    first = [(e["id"], e["stage"]) for e in answer["effects"]][: len(asked)]
    if asked != set(first):
        flaws.append(", ".join(f"{name} at {stage}" for name, stage in first) + " first" if first else "no name")
    if asked and _beyond(after) > HALVED * _beyond(before):
        flaws.append("not halved")
    return flaws


def _beyond(residual: float) -> float:
    """Return what of a residual in times the noise is no noise."""
    return float(np.sqrt(max(residual**2 - 1.0, 0.0)))


def _misplaced(circuit: Circuit, answer: Answer) -> list[str]:
    """Return what is wrong about where the physics without a name was located, if anything was."""
    where = answer["location"]
    if where is None or any(change.stage in (where["stage"], *where["alternatives"]) for change in circuit.changes):
        return []
    return [f"located at {where['stage']}"]


def _values(change: Change, answer: Answer) -> list[Value]:
    """Return the values expected beside those told."""
    if not change.effect:
        return [Value(path, value, _of_model(answer["model"], path)) for path, value in change.expected.items()]
    named = [e for e in answer["effects"] if (e["id"], e["stage"]) == (change.effect, change.stage)]
    told = named[0]["parameters"] if named else {}
    return [_value(name, value, told.get(name)) for name, value in change.expected.items()]


def _value(name: str, by_hand: float, told: Answer | None) -> Value:
    if told is None:
        return Value(name, by_hand, None)
    low, high = (np.nan if end is None else float(end) for end in told["ci95"])
    return Value(name, by_hand, float(told["value"]), (low, high))


def _of_model(model: Answer, path: str) -> float:
    """Return a border of the model, or the largest time constant of a block, s, for BLOCK.tau."""
    block, _, name = path.partition(".")
    if name == "tau":
        return float(np.max(-1.0 / np.real(np.roots(model[block]["den"]))))
    return float(str(model[block]["backlash"][name]).split()[0])
