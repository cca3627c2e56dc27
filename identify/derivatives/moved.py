"""What do chains answer that differ in one stage, behind which all of them are the same?

They go through what comes behind it eight abreast (lanes): each stage is begun once for all, and its compiled loop
takes eight signals in the time of one or two.
"""

import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from identify.blocks import LinearBlock, Play, Source
from identify.chain import Chain, advance
from identify.derivatives import lane_kernels
from identify.derivatives.lanes import WIDTH
from identify.discretise import Matrix
from identify.stage import Block, Eightfold, Grid, Memoryless, Run, Shape, Stage, Values
from identify.trace import Array

AT_ONCE = 1 << 14  # instants: eight signals of as many stay in the near cache
TOGETHER = WIDTH - 1  # movers in a team, beside the unmoved signal
Wide = Callable[[Block, Matrix], None]  # what turns eight signals into eight in their place, shape (8, n)


class _Room(threading.local):
    """Memory for eight signals on their way, the same every time: new memory costs more than what is done in it."""

    def __init__(self) -> None:
        """Begin with none."""
        self._all = np.zeros(0)

    def of(self, size: int) -> Matrix:
        """Return room for eight signals of so many instants, with whatever was left in it."""
        if self._all.size < WIDTH * size:
            self._all = np.zeros(WIDTH * size)
        return self._all[: WIDTH * size].reshape(WIDTH, size)


_ROOM = _Room()


@dataclass(frozen=True)
class Mover:
    """What one of the chains does in a stage that is its own: the ``first`` in which it differs.

    Of what ``adds`` to its input that stage runs with what its weights are moved by alone: no other shape is needed.
    Where it puts out a signal of another shape than the unmoved one, what comes behind is run here, too. A stage that
    goes on eight signals at once is its ``own`` among those of the other chains, and none is run here.
    """

    first: int
    runs: tuple[Run, ...]
    adds: bool = False
    own: Eightfold | None = None

    def answer(self, passed: Sequence[Block]) -> Array:
        """Return what it puts out, where the unmoved chain's stages were passed by a block and left others."""
        block, runs = passed[self.first], self.runs
        if self.adds:
            block = block.holding(passed[self.first + 1].signal + (runs[0](block) - block.signal))
            runs = runs[1:]
        for stage in runs:
            block = advance(stage, block)
        return block.signal

    @property
    def last(self) -> int:
        """Return the last stage that is run here, or the one before the first."""
        return self.first + len(self.runs) - 1


def mover(chain: Chain, first: int, values: Values, adds: bool, grid: Grid, shapes: Sequence[Shape]) -> Mover:
    """Return a stage of a chain with values of its own; ``shapes`` are those of what enters every stage, and leaves."""
    run, shape = chain.stages[first].begin(values, grid, shapes[first])
    if isinstance(run, Eightfold) and shape == shapes[first + 1] and first > 0:
        return Mover(first, (), own=run)
    if shape == shapes[first + 1]:
        return Mover(first, (run,), adds)
    runs = [run]
    for stage in chain.stages[first + 1 :]:
        run, shape = stage.begin(chain.of(stage, grid.run), grid, shape)
        runs.append(run)
    return Mover(first, tuple(runs), adds)


class Abreast:
    """Some movers of one chain on one grid, and the stages behind them, at work, at rest.

    The unmoved signal goes along in the first lane: what moves nothing changes nothing, to the last bit.
    """

    def __init__(self, chain: Chain, grid: Grid, movers: Sequence[Mover], shapes: Sequence[Shape]) -> None:
        """Take one to ``TOGETHER`` of them, and the shapes of what enters every stage."""
        lasts, count = [m.last for m in movers], len(chain.stages)
        self._begin, self._joining = min(lasts), [list[tuple[int, Mover]]() for _ in range(count)]
        firsts = {m.first for m in movers}  # of which the unmoved chain may have none, where all have it of their own
        self._all_own = firsts.pop() if all(m.own for m in movers) and len(firsts) == 1 else count
        for lane, (m, last) in enumerate(zip(movers, lasts, strict=True), 1):
            self._joining[last].append((lane, m))
        self._behind = list[Wide]()
        for i in range(self._begin + 1, count):
            used = [0, *(lane for lane, last in enumerate(lasts, 1) if last < i)]
            own = {lane: m.own for lane, m in enumerate(movers, 1) if m.own and m.first == i}
            stage = chain.stages[i]
            self._behind.append(_abreast(stage, chain.of(stage, grid.run), grid, shapes[i], used, own))

    def write_changes(self, passed: Sequence[Block], every: int, scale: float, out: Matrix) -> None:
        """Write by how much the answers differ from the unmoved one at ``every`` so many-th instant, times ``scale``.

        Into ``out``, shape (movers, n / every). The unmoved chain's stages were ``passed`` by these blocks: what enters
        the first, and what every one left. All but the last stretch are of a multiple of eight instants.
        """
        size = passed[0].signal.size
        signals = _ROOM.of(-(-size // WIDTH) * WIDTH)
        signals[0, :size] = passed[self._begin + 1].signal
        for i in range(self._begin, len(self._joining)):
            if i > self._begin:
                self._behind[i - self._begin - 1](passed[i], signals)
            if i == self._all_own:
                signals[0, :size] = passed[i + 1].signal
            for lane, joining in self._joining[i]:
                signals[lane, :size] = joining.answer(passed)
        lane_kernels.differences(signals, every, scale, out)


def teams(
    chain: Chain, grid: Grid, movers: Sequence[Mover], shapes: Sequence[Shape]
) -> Iterator[tuple[slice, Abreast]]:
    """Yield all movers in teams, and which of them they are: those that follow one another go together."""
    for at in range(0, len(movers), TOGETHER):
        some = movers[at : at + TOGETHER]
        yield slice(at, at + len(some)), Abreast(chain, grid, some, shapes)


def _abreast(
    stage: Stage, values: Values, grid: Grid, shape: Shape, used: Sequence[int], own: Mapping[int, Eightfold]
) -> Wide:
    """Return a stage at work on eight signals, at rest; only those that are ``used`` need be right.

    Some may go through one of their ``own``.
    """
    if isinstance(stage, Source) or (stage.sums and not any(values)):
        return _untouched
    if type(stage) is LinearBlock:
        return _linear(stage, values, grid, shape)
    if type(stage) is Play:
        return _play(values)
    run = stage.begin(values, grid, shape)[0]
    if isinstance(run, Memoryless):
        return _law(run, used)
    if isinstance(run, Eightfold):
        return _eightfold(run, [own.get(lane) or run for lane in range(WIDTH)], used)
    return _one_by_one([stage.begin(values, grid, shape)[0] for _ in used], used)


def _untouched(_: Block, signals: Matrix) -> None:
    """Leave signals as they are."""


def _law(of_each: Memoryless, used: Sequence[int]) -> Wide:
    """Return a memoryless stage at work on signals all at once."""

    def run(block: Block, signals: Matrix) -> None:
        some = signals[list(used), : block.signal.size]
        signals[list(used), : block.signal.size] = of_each.law(some.ravel()).reshape(some.shape)

    return run


def _linear(block: LinearBlock, values: Values, grid: Grid, shape: Shape) -> Wide:
    """Return a linear block at work on eight signals."""
    step, whole, _ = block.step(values, grid, shape)
    one = (step.rows, tuple(zip(step.g0, step.g1, strict=True)), step.c, step.d)
    state, past, silent = np.zeros((step.order + 1, WIDTH)), np.empty((WIDTH, 0)), whole

    def run(_: Block, signals: Matrix) -> None:
        nonlocal past, silent
        if whole:
            zeros = min(silent, signals.shape[1])
            joined = np.concatenate((np.zeros((WIDTH, zeros)), past, signals), axis=1)
            signals[:], past, silent = joined[:, : signals.shape[1]], joined[:, signals.shape[1] :], silent - zeros
        lane_kernels.linear(one, state, signals)

    return run


def _play(borders: Values) -> Wide:
    """Return the play operator at work on eight signals."""
    s_l, d_l, s_u, d_u = borders
    levels = np.zeros((1, WIDTH))
    return lambda _, signals: lane_kernels.play(s_l, d_l, s_u, d_u, levels, signals)


def _eightfold(kind: Eightfold, runs: Sequence[Eightfold], used: Sequence[int]) -> Wide:
    """Return stages of one kind at work, each on one of eight signals; what is left in other lanes takes no time."""
    together, idle = kind.abreast(runs), [lane for lane in range(WIDTH) if lane not in used]

    def run(_: Block, signals: Matrix) -> None:
        signals[idle] = signals[0]
        together(signals)

    return run


def _one_by_one(runs: Sequence[Run], used: Sequence[int]) -> Wide:
    """Return a stage at work on signals one after the other: each has a run of its own."""

    def run(block: Block, signals: Matrix) -> None:
        size = block.signal.size
        for lane, one in zip(used, runs, strict=True):
            signals[lane, :size] = one(block.holding(signals[lane, :size].copy()))

    return run
