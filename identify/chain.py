"""How stages make a signal path, and what that path answers to a source voltage."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TypeVar

import numpy as np

from identify import kernels
from identify.bent.curved import CurvedPlay
from identify.between import source_of
from identify.blocks import Gain, LinearBlock, Play, Source, delay_line
from identify.discretise import without_leading_zeros
from identify.model import Backlash, CurvedBacklash, LinearF, Model, NonlinearF, Rational
from identify.stage import Block, Grid, Held, Parameter, Place, Ramp, Run, Shape, Stage, Values, is_fixed
from identify.trace import Array, Intersample, Samples, Trace

S = TypeVar("S", bound=Stage)

DELAY = "delay"  # the one parameter of all dead times that G1 and G2 are given
CHUNK = 1 << 16  # instants handled at once: bounds memory, stays near the cache


@dataclass(frozen=True)
class Chain:
    """Stages in the order of the signal, and the value of every parameter by full name.

    A local parameter ``hum.phase`` may also be given for one run: ``hum.phase[RUN]``. ``added`` lists the physics put
    into the plain chain, whether it became a stage of its own or changed one. ``tied`` names values that follow others:
    (follower, leader) pairs; a follower is not searched.
    """

    stages: tuple[Stage, ...]
    values: Mapping[str, float]
    added: tuple[Stage, ...] = ()
    tied: tuple[tuple[str, str], ...] = ()

    def __post_init__(self) -> None:
        """Freeze the values, those that follow others at what they follow."""
        follow = {follower: self.values[leader] for follower, leader in self.tied}
        object.__setattr__(self, "values", MappingProxyType({**self.values, **follow}))

    def parameters(self) -> tuple[Parameter, ...]:
        """Return the parameters of all stages, in the order of the signal."""
        return tuple(parameter for stage in self.stages for parameter in stage.parameters())

    def of(self, stage: Stage, run: str) -> Values:
        """Return the values of one stage in one run."""
        values, names, local = self.values, stage.names, stage.local_names
        if not local:
            return tuple(map(values.__getitem__, names))
        return tuple(values.get(local_name(n, run), values[n]) if n in local else values[n] for n in names)

    def with_values(self, values: Mapping[str, float]) -> "Chain":
        """Return this chain with some values replaced."""
        return replace(self, values={**self.values, **values})

    def with_stage(self, stage: Stage, values: Mapping[str, float]) -> "Chain":
        """Return this chain with one more stage, behind those of the same place."""
        at = sum(other.place <= stage.place for other in self.stages)
        return replace(self, stages=(*self.stages[:at], stage, *self.stages[at:]), values={**self.values, **values})

    def with_stage_behind(self, owner: str, stage: Stage, values: Mapping[str, float]) -> "Chain":
        """Return this chain with one more stage right behind the one called ``owner``; ValueError without that."""
        names = [other.name for other in self.stages]
        if owner not in names:
            raise ValueError(f"the chain has no {owner}")
        at = names.index(owner) + 1
        return replace(self, stages=(*self.stages[:at], stage, *self.stages[at:]), values={**self.values, **values})

    def with_replaced(self, old: Stage, new: Stage, values: Mapping[str, float]) -> "Chain":
        """Return this chain with ``new`` where ``old`` was."""
        stages = tuple(new if s is old else s for s in self.stages)
        return replace(self, stages=stages, values={**self.values, **values})

    def crediting(self, effect: Stage) -> "Chain":
        """Return this chain with ``effect`` listed among the physics put into it."""
        return replace(self, added=(*self.added, effect))

    def stage_of(self, kind: type[S]) -> S | None:
        """Return the first stage of a kind, None when there is none."""
        return next((stage for stage in self.stages if isinstance(stage, kind)), None)

    def index(self, place: Place) -> int:
        """Return the number of stages up to and including ``place``: the position just behind it."""
        return sum(stage.place <= place for stage in self.stages)

    def first_difference(self, other: "Chain", run: str) -> int:
        """Return the index of the first stage whose values differ in ``run`` (len(stages) when none does)."""
        for i, stage in enumerate(self.stages):
            if self.of(stage, run) != other.of(stage, run):
                return i
        return len(self.stages)

    def begin(self, grid: Grid, first: int = 0) -> list[Run]:
        """Return the running stages from ``first`` on, at rest. Raise ValueError for values no block can have."""
        return self.begun(grid)[0][first:]

    def begun(self, grid: Grid) -> tuple[list[Run], list[Shape]]:
        """Return all running stages, at rest, and the shapes of what enters every one, and of the answer."""
        runs, shapes = list[Run](), list[Shape]([Ramp()])
        for stage in self.stages:
            run, shape = stage.begin(self.of(stage, grid.run), grid, shapes[-1])
            runs.append(run)
            shapes.append(shape)
        return runs, shapes


def local_name(name: str, run: str) -> str:
    """Return the name under which one run's own value of a local parameter is kept."""
    return f"{name}[{run}]"


def plain_chain(model: Model, intersample: Intersample = "held") -> Chain:
    """Return the chain of G1, F and G2 as ``model`` gives them, without its further physics.

    Raises ValueError where the model has no values yet.
    """
    if model.unknown:
        raise ValueError(f"{model.unknown[0]} has no values: the rig file gives its orders alone")
    g1, g2 = (
        LinearBlock(replace(block, num=without_leading_zeros(block.num), dead_time_s=0.0), place.label, place)
        for block, place in ((model.g1, Place.G1), (model.g2, Place.G2))
    )
    f = f_stage(model.f)
    values: dict[str, float] = {}
    for stage in (g1, f, g2):
        values |= dict(zip([p.name for p in stage.parameters()], stage.start_values(), strict=True))
    late, delay = _late(g2, model)
    return Chain((Source(intersample == "held"), g1, f, late), {**values, **delay})


def as_promised(chain: Chain, model: Model) -> Chain:
    """Return the chain of a model with its borders' slopes tied where the rig file promises one slope for both."""
    tied = isinstance(model.f, Backlash) and model.f.tied and chain.stage_of(Play) is not None
    return replace(chain, tied=(("F.S_U", "F.S_L"),)) if tied else chain


def f_stage(f: NonlinearF | LinearF) -> Play | CurvedPlay | Gain:
    """Return the stage of F in the form the model gives it."""
    if isinstance(f, Backlash):
        return Play(f)
    return CurvedPlay(f) if isinstance(f, CurvedBacklash) else Gain(f)


def _late(g2: LinearBlock, model: Model) -> tuple[LinearBlock, dict[str, float]]:
    """Return G2 with the dead times of G1 and G2 as one: only their sum shows, so only the sum is searched.

    It is searched unless the rig file holds every dead time it gives.
    """
    given = {"G1.dead_time": model.g1.dead_time_s, "G2.dead_time": model.g2.dead_time_s}
    total_s = sum(given.values())
    if not any(value > 0.0 and not is_fixed(name, model.fixed) for name, value in given.items()):
        return replace(g2, fixed_delay_s=total_s), {}
    return replace(g2, delays=(Parameter(DELAY, "s", "log"),)), {DELAY: total_s}


def grid_of(trace: Trace, substeps: int = 1) -> Grid:
    """Return the instants on which ``trace`` is simulated."""
    return Grid(trace.name, 1.0 / (trace.rate_hz * substeps), substeps, trace.start_s, trace.late_s)


def samples_at_once(substeps: int, instants: int | None = None) -> int:
    """Return how many samples are handled at once: a multiple of eight, ``CHUNK`` instants or as many as are given."""
    return max((instants or CHUNK) // substeps // 8, 1) * 8


def chunks(source: Samples, grid: Grid, samples: int | None = None) -> Iterator[Block]:
    """Yield the source voltage in stretches of whole samples: as many as are handled at once, or are asked for."""
    size = (samples or samples_at_once(grid.substeps)) * grid.substeps
    for first in range(0, source.size, size):
        piece = source[first : first + size]
        yield Block(piece, piece, first, grid)


def advance(run: Run, block: Block) -> Block:
    """Return the block behind one more stage."""
    return block.holding(run(block))


def signals(chain: Chain, trace: Trace, substeps: int = 1) -> list[Array]:
    """Return the signal behind every stage at the sample instants, shape (N,) each: taps a bench does not have."""
    return [np.concatenate(tap) for tap in zip(*tapped(chain, trace, substeps), strict=True)]


def tapped(chain: Chain, trace: Trace, substeps: int = 1) -> Iterator[list[Array]]:
    """Yield the signal behind every stage at the sample instants, stretch by stretch, shape (n,) each."""
    grid = grid_of(trace, substeps)
    runs = chain.begin(grid)
    for entering in chunks(source_of(trace, substeps), grid):
        block, taps = entering, []
        for run in runs:
            block = advance(run, block)
            taps.append(block.signal[::substeps])
        yield taps


def simulate(chain: Chain, trace: Trace, substeps: int = 1) -> Array:
    """Return the chain's answer at the sample instants, V, shape (N,), from rest."""
    out = list(answered(chain, trace, substeps))
    return out[0] if len(out) == 1 else np.concatenate(out)


def answered(chain: Chain, trace: Trace, substeps: int = 1, samples: int | None = None) -> Iterator[Array]:
    """Yield the chain's answer at the sample instants, V, from rest, in stretches as ``chunks`` makes them."""
    grid = grid_of(trace, substeps)
    run = running(chain, grid)
    return (run(block)[::substeps] for block in chunks(source_of(trace, substeps), grid, samples))


def running(chain: Chain, grid: Grid) -> Run:
    """Return the whole chain as one running stage; the plain chain runs in one compiled loop."""
    fused = _fused(chain, grid)
    if fused is not None:
        return fused
    runs = chain.begin(grid)

    def run(block: Block) -> Array:
        for stage in runs:
            block = advance(stage, block)
        return block.signal

    return run


def _fused(chain: Chain, grid: Grid) -> Run | None:
    """Return the plain chain as one compiled loop, or None when the chain is another."""
    if tuple(type(stage) for stage in chain.stages) != (Source, LinearBlock, Play, LinearBlock):
        return None
    source, g1, f, g2 = chain.stages
    assert isinstance(g1, LinearBlock)
    assert isinstance(g2, LinearBlock)
    _, shape = source.begin((), grid, Ramp())
    one = g1.stepper(chain.of(g1, grid.run), grid, shape)
    two = g2.stepper(chain.of(g2, grid.run), grid, shape if one.g1 == (0.0,) and isinstance(shape, Held) else Ramp())
    late = delay_line(g2.late(chain.of(g2, grid.run), grid)[0])
    s_l, d_l, s_u, d_u = chain.of(f, grid.run)
    x1, w, x2, last = one.at_rest(), 0.0, two.at_rest(), 0.0

    def run(block: Block) -> Array:
        nonlocal x1, w, x2, last
        u, out = block.signal, np.empty_like(block.signal)
        x1, w, x2, last = kernels.plain_chain(
            one.rows, one.g0, one.g1, one.c, one.d, x1, s_l, d_l, s_u, d_u, w,
            two.rows, two.g0, two.g1, two.c, two.d, x2, last, u, out,
        )  # fmt: skip
        return late(block.holding(out))

    return run


def model_of(chain: Chain, plain: Model) -> Model:
    """Return ``plain`` with the values of ``chain``; physics beyond it are the caller's to add."""
    blocks: dict[str, Rational] = {}
    f: NonlinearF | LinearF = plain.f
    for stage in chain.stages:
        values = tuple(chain.values[p.name] for p in stage.parameters())
        if isinstance(stage, LinearBlock) and stage.name in ("G1", "G2"):
            blocks[stage.name] = stage.rational(values)
        elif isinstance(stage, Play):
            f = Backlash(*values[:4], tied=isinstance(plain.f, Backlash) and plain.f.tied)
        elif isinstance(stage, CurvedPlay):
            f = stage.backlash(values)
        elif isinstance(stage, Gain):
            f = LinearF(*values)
    late_s = _shares(plain, chain.values.get(DELAY))
    g1, g2 = (replace(blocks[name], dead_time_s=s) for name, s in zip(("G1", "G2"), late_s, strict=True))
    return replace(plain, g1=g1, f=f, g2=g2)


def _shares(plain: Model, total_s: float | None) -> tuple[float, float]:
    """Return the dead times of G1 and G2 that make up ``total_s``; what the rig file holds or gives G1 stays there."""
    first, second = plain.g1.dead_time_s, plain.g2.dead_time_s
    if total_s is None:
        return first, second
    if is_fixed("G2.dead_time", plain.fixed) or second == 0.0:
        return max(total_s - second, 0.0), min(second, total_s)
    return min(first, total_s), max(total_s - first, 0.0)


