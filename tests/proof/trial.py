"""Which trial has a number? Rig, what is played, what is concealed and how clearly it shows come from the number alone.

Strata: ``null`` conceals nothing; ``single`` one physics of the catalogue; ``pair`` two of different stages;
``outside`` one that no catalogue has; ``composed`` one that chance put together; ``below`` one of the catalogue that
the noise hides; ``free_null`` and ``free`` are ``null`` and ``single`` under runs that an operator chose.
"""

from collections.abc import Collection, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import count
from typing import Literal
from zlib import crc32

import numpy as np

from tests.proof.bench import SUBSTEPS
from tests.proof.cases import Concealed, Finding
from tests.proof.composing import STAGES, composed
from tests.proof.detect import Sensed, strength
from tests.proof.kinds import LIBRARY, UNHEARD, Kind
from tests.proof.operators import protocol as chosen
from tests.proof.rigs import Rig, Rng, between, drawn_rig, toleranced
from tests.proof.standard import protocol
from tests.proof.stimuli import Stimulus

Stratum = Literal["null", "single", "pair", "outside", "composed", "below", "free_null", "free"]
SINCE = {  # the first seed of whose pairs it may be: pairs of seeds before are what they were
    "diode_contact": 103, "adc_averaging": 199,
}  # fmt: skip
STRATA: tuple[Stratum, ...] = ("null", "single", "pair", "outside", "composed", "below", "free_null", "free")
ROUND = {  # trials, beside one of every effect
    "null": 15, "pair": 6, "outside": 5, "composed": 5, "below": 5, "free_null": 5, "free": 5,
}  # fmt: skip
UNNAMED_Z = (30.0, 3000.0)
Z = {
    "single": (10.0, 3000.0), "pair": (30.0, 1500.0), "outside": UNNAMED_Z, "composed": UNNAMED_Z, "below": (0.3, 3.0),
    "free": (10.0, 3000.0),
}  # fmt: skip
OFF = 0.05  # of every value of the rig file
ALIKE = ({"source_pole", "extra_pole"},)  # the same data, wherever the other is
SEEN = {"spikes", "missing_samples"}  # one of them is already more than noise hides
MISTAKEN = 0.3  # of a z, on a log scale, that it is looked for again on the grid of the recordings
HIDES = 0.5  # of the least z that is asked for, that a piece must show beside the others
UNKNOWN = {"outside", "composed"}
FREE = {"free_null", "free"}
LOTS = 50  # draws of what has no size, of which one must show
Pieces = list[tuple[Concealed, float]]
ALONE = {"backlash", "unequal_slopes"}  # they change what the plain model is


@dataclass(frozen=True, order=True)
class Key:
    """Which trial: the seed of the study, its stratum, what it is about, and its number among those.

    ``z`` are bounds of how clearly what is concealed shows, where they are not those of the stratum.
    """

    seed: int
    stratum: Stratum
    about: str
    number: int
    z: tuple[float, float] | None = None

    @property
    def text(self) -> str:
        """Return the key in one word."""
        shown = f"/z={self.z[0]:g}..{self.z[1]:g}" if self.z else ""
        return f"{self.seed}/{self.stratum}/{self.about}/{self.number}{shown}"

    @property
    def rng(self) -> Rng:
        """Return the random numbers of the trial."""
        return np.random.default_rng([self.seed, crc32(f"{self.stratum}/{self.about}".encode()), self.number])


@dataclass(frozen=True)
class Trial:
    """A rig, the rig file that is 5 % off, what is played, what is concealed, and the z of each."""

    key: Key
    rig: Rig
    seed: int
    training: tuple[Stimulus, ...]
    held_out: tuple[Stimulus, ...]
    physics: tuple[Concealed, ...] = ()
    expected: tuple[Finding, ...] = ()
    unheard: tuple[Finding, ...] = ()
    z: tuple[float, ...] = ()

    @cached_property
    def nominal(self) -> Rig:
        """Return what the rig file says."""
        return toleranced(self.rig, self.seed, OFF)


def plan(seed: int, strata: Collection[str], effects: Collection[str]) -> Iterator[Key]:
    """Yield trials without end: round by round one of every effect, and the shares of the other strata."""
    for turn in count():
        for stratum in (s for s in STRATA if s in strata):
            if stratum == "single":
                yield from (Key(seed, stratum, effect, turn) for effect in sorted(effects))
            else:
                yield from (_key(seed, stratum, turn * ROUND[stratum] + i, effects) for i in range(ROUND[stratum]))


def _key(seed: int, stratum: Stratum, number: int, effects: Collection[str]) -> Key:
    """Return a trial of another stratum: nulls and pairs are counted through, the rest takes its kinds in turn."""
    if stratum in ("null", "pair", "free_null"):
        return Key(seed, stratum, stratum, number)
    ids = _ids(stratum, effects)
    return Key(seed, stratum, ids[number % len(ids)], number // len(ids))


def _ids(stratum: Stratum, effects: Collection[str]) -> list[str]:
    """Return what the trials of a stratum are about, in turn."""
    if stratum == "composed":
        return list(STAGES)
    return list(dict.fromkeys(k.id for k in UNHEARD)) if stratum == "outside" else sorted(set(effects) - SEEN)


def drawn(key: Key, effects: Collection[str] = frozenset(kind.id for kind in LIBRARY)) -> Trial:
    """Return the trial of a key; ``effects`` are the ids that pairs are drawn from."""
    rng = key.rng
    kinds = _kinds(key, rng, effects)
    trial, pieces = _freely(key, kinds, rng) if key.stratum == "free" else _drawn(key, kinds, rng)
    kinds, pieces = _composed(trial, rng) if key.stratum == "composed" else (kinds, pieces)
    told = tuple(Finding(k.id, k.stage, k.told(c.values)) for k, (c, _) in zip(kinds, pieces, strict=True))
    known = key.stratum not in UNKNOWN
    return replace(
        trial, physics=tuple(c for c, _ in pieces), z=tuple(z for _, z in pieces), expected=told if known else (),
        unheard=() if known else told,
    )  # fmt: skip


def _drawn(key: Key, kinds: Sequence[Kind], rng: Rng) -> tuple[Trial, Pieces]:
    """Return a rig under a protocol, and the pieces of what is concealed in it, as clear as they can be made."""
    rig = drawn_rig(rng)
    training, held_out = (chosen if key.stratum in FREE else protocol)(rig, rng)
    for kind in kinds:
        rig = kind.prepared(rig)
    trial = Trial(key, rig, int(rng.integers(2**31)), training, held_out)
    return trial, _pieces(trial, kinds, rng)


def _freely(key: Key, kinds: Sequence[Kind], rng: Rng) -> tuple[Trial, Pieces]:
    """Return the first rig and runs that an operator chose which show what is concealed as clearly as they must."""
    for _ in range(LOTS):
        with suppress(ValueError):
            trial, pieces = _drawn(key, kinds, rng)
            if all(z >= HIDES * (key.z or Z[key.stratum])[0] for _, z in pieces):
                return trial, pieces
    raise ValueError(f"{key.text}: none of {LOTS} choices of runs shows what is concealed")


def _kinds(key: Key, rng: Rng, effects: Collection[str]) -> tuple[Kind, ...]:
    """Return what is concealed: places and forms of an effect take turns, those of a pair are drawn."""
    if key.stratum in ("null", "composed", "free_null"):
        return ()
    if key.stratum == "pair":
        return _pair(rng, [effect for effect in effects if SINCE.get(effect, 0) <= key.seed])
    variants = [kind for kind in (*LIBRARY, *UNHEARD) if kind.id == key.about]
    return (variants[key.number % len(variants)],)


def _composed(trial: Trial, rng: Rng) -> tuple[tuple[Kind, ...], Pieces]:
    """Return a law put together for the stage of a trial that shows there as clearly as it must, and its piece."""
    for _ in range(LOTS):
        kind = composed(rng, trial.key.about)
        ((concealed, z),) = pieces = _pieces(trial, (kind,), rng)
        if z > (trial.key.z or Z["composed"])[0] and concealed.values["k"]:
            return (kind,), pieces
    raise ValueError(f"none of {LOTS} laws put together for {trial.key.about} shows as clearly as is asked")


def _pair(rng: Rng, effects: Collection[str]) -> tuple[Kind, Kind]:
    """Return two kinds of different stages, every effect as likely as any other."""
    ids = sorted(set(effects) - ALONE)
    while True:
        first, second = (_variant(rng, str(rng.choice(ids))) for _ in range(2))
        if first.stage != second.stage and {first.id, second.id} not in ALIKE:
            return first, second


def _variant(rng: Rng, effect: str) -> Kind:
    variants = [kind for kind in LIBRARY if kind.id == effect]
    return variants[int(rng.integers(len(variants)))]


def _pieces(trial: Trial, kinds: Sequence[Kind], rng: Rng) -> Pieces:
    """Return every piece and its z: noise is drawn first, and what is concealed beside it must show in it, too.

    Where one of several hides another, all are drawn again.
    """
    if not kinds:
        return []
    bounds = trial.key.z or Z[trial.key.stratum]
    for _ in range(LOTS):
        found: dict[Kind, tuple[Concealed, float]] = {}
        for kind in sorted(kinds, key=lambda kind: (not kind.spectral, not kind.chance)):
            beside = tuple(found[other][0] for other in found if other.noisy)
            found[kind] = _piece(Sensed(trial, beside), kind, rng, bounds)
        if len(kinds) == 1 or not any(_hidden(trial, kind, found, bounds[0]) for kind in kinds):
            return [found[kind] for kind in kinds]
    raise ValueError(f"of {LOTS} draws of {' and '.join(kind.id for kind in kinds)} one always hides the other")


def _hidden(trial: Trial, kind: Kind, found: dict[Kind, tuple[Concealed, float]], least: float) -> bool:
    """Return whether a piece shows much less beside the others than it must: they keep the signal from it."""
    if kind.chance or kind.drawn:
        return False
    noise = tuple(found[other][0] for other in found if other.noisy and other is not kind)
    if kind.spectral:
        return bool(noise) and Sensed(trial, noise).z_of_spectrum(found[kind][0]) < HIDES * least
    others = tuple(found[other][0] for other in found if other is not kind)
    return Sensed(trial, noise).z_with(others, found[kind][0]) < HIDES * least


def _piece(sensed: Sensed, kind: Kind, rng: Rng, bounds: tuple[float, float]) -> tuple[Concealed, float]:
    """Return physics of about the z that is drawn, as far as it can be made that strong, and the z it has."""
    if kind.drawn:
        return _lot(sensed, kind, rng, bounds[0])
    values = kind.draw(rng, sensed.reach)
    z = sensed.z_of_mean if kind.chance else sensed.z_of_spectrum if kind.spectral else sensed.z
    wanted = between(rng, *bounds)
    found, reached = strength(lambda s: z(Concealed(kind.law, values(s))), wanted)
    if reached and not kind.noisy:
        finely = replace(sensed, steps=SUBSTEPS)
        seen = finely.z(Concealed(kind.law, values(found)))
        if abs(np.log(seen / reached)) > MISTAKEN:  # the coarse grid does not see how fast the law is
            found, reached = strength(lambda s: finely.z(Concealed(kind.law, values(s))), wanted)
    return Concealed(kind.law, values(found)), reached


def _lot(sensed: Sensed, kind: Kind, rng: Rng, least: float) -> tuple[Concealed, float]:
    """Return physics without a size that happens to show at least as clearly as is asked, and its z."""
    for _ in range(LOTS):
        concealed = Concealed(kind.law, kind.draw(rng, sensed.reach)(1.0))
        z = sensed.z_of_signal(concealed)
        if z >= least:
            return concealed, z
    raise ValueError(f"none of {LOTS} draws of {kind.id} shows as clearly as z = {least:g}")
