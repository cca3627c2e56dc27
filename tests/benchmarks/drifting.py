"""Does a comparison of two days say what changed, and nothing else? Trials on the bench's own integrator.

``python -m tests.benchmarks.drifting KIND COUNT [--seed 0] [--first 0]``; kinds:

- ``same``: one rig, twice; any change that is told is a wrong claim.
- ``stimuli``: one rig, the second day other stimuli.
- ``lacking``: the same with physics in the rig that its model lacks and nobody looks for.
- ``leaning``: that physics under the same stimuli on both days, and nobody looks for it.
- ``value``: one value of the rig moved, by so much that it stands z of its own standard errors out.
- ``physics``: the second day one physics of the catalogue more.
- ``kept``: that physics on both days.
"""

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from identify.compared import compare
from identify.compared.comparison import Comparison
from identify.trace import Step, Trace
from tests.proof.bench import record
from tests.proof.detect import Sensed, neighbours
from tests.proof.integrator import Array
from tests.proof.rigs import Rig, between
from tests.proof.trial import Key, Trial, drawn
from tests.trials import model_of

QUICK, OTHERS = (0, 2, 4), (1, 3, 5)  # of the standard protocol: staircase and two sines; the others
Z = (2.0, 30.0)
MOST = 0.5  # share of a value by which it may move
BINS = (2.0, 3.0, 5.0, 10.0, 30.0)
EFFECTS = (
    "saturation", "dead_time", "feedthrough", "plateau_droop", "gain_drift", "second_play", "hum", "curved_border",
    "slew_limit", "adc_nonlinearity",
)  # fmt: skip


@dataclass(frozen=True)
class Outcome:
    """What was told of one pair: ``moved`` is what was (empty: nothing), ``claimed`` what was said to be, z in SE."""

    number: int
    moved: str
    z: float
    verdict: str
    claimed: tuple[str, ...]
    accounted: tuple[str, ...]
    joint_p: float
    errors: tuple[float, ...]
    seconds: float

    @property
    def wrong(self) -> tuple[str, ...]:
        """Return what was claimed to have moved and had not."""
        return tuple(name for name in self.claimed if name != self.moved)

    def line(self) -> str:
        """Return the pair in one line."""
        what = f"{self.moved} z {self.z:.1f}" if self.moved else "nothing"
        claimed, accounted = (", ".join(names) or "-" for names in (self.claimed, self.accounted))
        return (f"{self.number:4d} {what:28s} {self.verdict:15s} claimed {claimed}; accounted by {accounted}; "
                f"joint p {self.joint_p:.3f}, {self.seconds:.1f} s")  # fmt: skip


def traces(trial: Trial, day: int, runs: Sequence[int] | None = None) -> list[Trace]:
    """Return the recordings of one day, with noise of its own; ``runs`` of the training runs, None for all."""
    case = replace(trial, seed=trial.seed + day, held_out=())
    chosen = range(len(case.training)) if runs is None else runs
    recorded = [run for i, run in enumerate(record(case)) if i in chosen]
    return [
        Trace(f"{run.name}_{day}", run.rate_hz, run.u, run.y, start_s=run.start_s,
              steps=tuple(Step(s.label, s.kind, s.start, s.stop, s.repeat) for s in run.steps))
        for run in recorded
    ]  # fmt: skip


def asked(trial: Trial, days: tuple[list[Trace], list[Trace]], physics: bool = False) -> Comparison:
    """Return what the tool says of two days, from the rig file of the trial."""
    return compare(model_of(trial.nominal), days[0], days[1], physics=physics)


def null(seed: int, number: int, runs: Sequence[int] = QUICK) -> Trial:
    """Return a trial in which nothing is concealed, of some of the standard runs."""
    trial = drawn(Key(seed, "null", "null", number))
    return replace(trial, training=tuple(trial.training[i] for i in runs))


def same(seed: int, number: int) -> Outcome:
    """Return what is told of one rig on two days."""
    trial = null(seed, number)
    return outcome(number, "", 0.0, lambda: asked(trial, (traces(trial, 0), traces(trial, 1))))


def stimuli(seed: int, number: int) -> Outcome:
    """Return what is told of one rig that is played other stimuli on the second day."""
    one, other = null(seed, number), null(seed, number, OTHERS)
    return outcome(number, "", 0.0, lambda: asked(one, (traces(one, 0), traces(other, 1))))


def concealing(seed: int, number: int) -> Trial:
    """Return a trial with one physics of the catalogue."""
    return drawn(Key(seed, "single", EFFECTS[number % len(EFFECTS)], number // len(EFFECTS)))


def lacking(seed: int, number: int) -> Outcome:
    """Return what is told of a rig whose physics nobody looks for, under other stimuli on the second day."""
    trial = concealing(seed, number)
    return outcome(number, "", trial.z[0], lambda: asked(trial, (traces(trial, 0, QUICK), traces(trial, 1, OTHERS))))


def leaning(seed: int, number: int) -> Outcome:
    """Return what is told of a rig whose physics nobody looks for, under the same stimuli on both days."""
    trial = concealing(seed, number)
    return outcome(number, "", trial.z[0], lambda: asked(trial, (traces(trial, 0, QUICK), traces(trial, 1, QUICK))))


def value(seed: int, number: int) -> Outcome:
    """Return what is told of a rig of which one value moved by a known number of standard errors."""
    trial, rng = null(seed, number), np.random.default_rng([seed, number, 1])
    moved, name, z = shifted(trial, rng)
    later = replace(trial, rig=moved)
    return outcome(number, name, z, lambda: asked(trial, (traces(trial, 0), traces(later, 1))))


def physics(seed: int, number: int) -> Outcome:
    """Return what is told of a rig in which physics appeared."""
    trial = concealing(seed, number)
    clean, name = replace(trial, physics=()), trial.expected[0].id
    return outcome(number, name, trial.z[0], lambda: asked(trial, (traces(clean, 0), traces(trial, 1)), physics=True))


def kept(seed: int, number: int) -> Outcome:
    """Return what is told of a rig that had the same physics on both days."""
    trial = concealing(seed, number)
    return outcome(number, "", trial.z[0], lambda: asked(trial, (traces(trial, 0), traces(trial, 1)), physics=True))


def shifted(trial: Trial, rng: np.random.Generator) -> tuple[Rig, str, float]:
    """Return the rig with one value moved, its name, and by how many standard errors of a difference it moved.

    First order on the bench's own integrator: what moves the readings beyond what all other values could make of it,
    in the noise of both days.
    """
    sensed, near, names = Sensed(trial), neighbours(trial.rig), names_of(trial.rig)
    clean = sensed.answers(trial.rig)
    columns = np.stack([sensed.answers(rig) - clean for rig in near], axis=1)
    for at in rng.permutation(len(near)).tolist():
        told = float(np.linalg.norm(_beyond(columns, at))) / trial.rig.noise_v / np.sqrt(2.0)
        z = between(rng, *Z)
        rig = _along(trial.rig, near[at], z / told * float(rng.choice([-1.0, 1.0])))
        if rig is not None:
            return rig, names[at], z
    raise ValueError("no value of this rig is told well enough to be moved")


def _beyond(columns: Array, at: int) -> Array:
    """Return what of a column no combination of the others can do."""
    others = np.linalg.qr(np.delete(columns, at, axis=1))[0]
    return np.asarray(columns[:, at] - others @ (others.T @ columns[:, at]))


def _along(rig: Rig, near: Rig, steps: float) -> Rig | None:
    """Return a rig so many steps along the way to a neighbour; None where a value would move by more than MOST."""
    moved: dict[str, object] = {}
    for item in fields(rig):
        here, there = getattr(rig, item.name), getattr(near, item.name)
        if here != there:
            old, new = np.atleast_1d(here), np.atleast_1d(there)
            far = old + steps * (new - old)
            if np.any(np.abs(far - old) > MOST * np.abs(old)):
                return None
            moved[item.name] = tuple(far.tolist()) if isinstance(here, tuple) else float(far[0])
    return replace(rig, **moved)  # type: ignore[arg-type]


def names_of(rig: Rig) -> list[str]:
    """Return what the tool calls the values that ``neighbours`` move, in their order."""
    names = [f"{name}.den.s{len(den) - 1 - i}" for name, den in (("G1", rig.g1_den), ("G2", rig.g2_den))
             for i in range(len(den) - 1)]  # fmt: skip
    return [*names, *(["G2.dead_time"] if rig.dead_time_s else []), "F.S_L", "F.S_U", "F.D_L", "F.D_U"]


def outcome(number: int, moved: str, z: float, ask: Callable[[], Comparison]) -> Outcome:
    """Return what is told of a pair."""
    began = time.perf_counter()
    found = ask()
    seconds = time.perf_counter() - began
    claimed = tuple(c.name for c in found.changes if c.state == "changed")
    new = tuple(p.id for p in found.physics if p.state in ("appeared", "disappeared", "changed"))
    account = found.account
    errors = tuple(c.standard_errors for c in found.changes if c.state != "not told")
    return Outcome(number, moved, z, found.verdict, (*new, *claimed),
                   (*account.names, *account.instead) if account else (), found.joint.p_value, errors, seconds)


def summary(kind: str, outcomes: Sequence[Outcome]) -> str:
    """Return the shares."""
    count = len(outcomes)
    lines = [f"{kind}: {count} pairs, seconds a pair: median {np.median([o.seconds for o in outcomes]):.1f}"]
    wrong = [o for o in outcomes if o.wrong or (o.verdict == "changed" and not o.moved)]
    lines.append(f"pairs with a wrong claim: {len(wrong)} of {count} ({100.0 * len(wrong) / count:.1f} %)")
    lines.append(f"cannot tell: {sum(o.verdict == 'cannot tell' for o in outcomes)}")
    if kind in ("same", "stimuli"):
        ps, errors = np.array([o.joint_p for o in outcomes]), np.concatenate([o.errors for o in outcomes])
        below = ", ".join(f"{level:g}: {np.mean(ps < level):.3f}" for level in (0.01, 0.05, 0.2, 0.5))
        lines.append(f"joint p below {below}")
        lines.append(f"changes within 1.96 standard errors: {np.mean(np.abs(errors) < 1.96):.2%} of {errors.size}")
    if kind in ("value", "physics"):
        lines += [_found(outcomes, low, high) for low, high in zip(BINS, (*BINS[1:], np.inf), strict=True)]
    return "\n".join(lines)


def _found(outcomes: Sequence[Outcome], low: float, high: float) -> str:
    """Return how many changes of a size were found."""
    those = [o for o in outcomes if low <= o.z < high]
    found, named = (sum(o.verdict == "changed" for o in those), sum(o.moved in o.claimed for o in those))
    whole = sum(o.moved in o.accounted for o in those)
    return (f"z {low:g} to {high:g}: {found} of {len(those)} found, {named} with what moved claimed by name, {whole} "
            "with it among what accounts for all")  # fmt: skip


KINDS: dict[str, Callable[[int, int], Outcome]] = {
    "same": same, "stimuli": stimuli, "lacking": lacking, "leaning": leaning, "value": value, "physics": physics,
    "kept": kept,
}  # fmt: skip


def main(arguments: Sequence[str]) -> None:
    """Print a line for every pair, then the summary."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kind", choices=KINDS)
    parser.add_argument("count", type=int)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0)
    chosen = parser.parse_args(arguments)
    outcomes = []
    for number in range(chosen.first, chosen.first + chosen.count):
        outcomes.append(KINDS[chosen.kind](chosen.seed, number))
        print(outcomes[-1].line(), flush=True)
    print(summary(chosen.kind, outcomes))


if __name__ == "__main__":
    main(sys.argv[1:])
