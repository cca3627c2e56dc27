"""How is work spread over a Dask cluster, whose workers come and go and read the recordings where they are?

Orders are handed out in sheaves of about a second's work: handing over costs as much as a small order. Few sheaves are
out at a time, so that a worker that dies has few orders: the scheduler gives those to another. It gives up what several
workers died over, the culprit and whatever was beside it; alone, the culprit is told.
"""

from collections.abc import Generator, Iterable, Iterator
from contextlib import closing
from itertools import islice
from queue import Empty, Queue
from time import monotonic
from typing import TYPE_CHECKING

from rig.errors import IncompleteError, UsageError
from rig.provenance import program
from rig.question import versions
from rig.work import Do, Order, Outcome

if TYPE_CHECKING:
    from distributed import Client, Future

CONNECT_S = 10.0
ARRIVE_S = 60.0
ALONE_S = 300.0
AHEAD = 2
"""Sheaves for every worker: one it does, and one on its way."""
SHEAF_S = 1.0
MOST = 64
"""Orders of a sheaf."""
RECOUNT_S = 1.0
"""After which workers are counted again."""

Sheaf = tuple[Order, ...]


def outcomes(orders: Iterable[Order], address: str, do: Do) -> Generator[Outcome]:
    """Yield what became of every order, as they end, on the cluster whose scheduler is at ``address``.

    Raises UsageError where there is no such cluster or its workers run another program, IncompleteError when it goes.
    """
    with closing(_connected(address)) as client:
        _check_workers(client, address)
        yield from _done(client, iter(orders), address, do)


def _connected(address: str) -> "Client":
    """Return the line to a scheduler; raise UsageError."""
    try:
        from distributed import Client
    except ImportError as error:
        raise UsageError("Dask is not installed", where="--scheduler",
                         do="pip install 'backlash-rig[cluster]', here and on the cluster") from error  # fmt: skip
    try:
        return Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise UsageError("no Dask scheduler answers", where="--scheduler", value=f"{address}: {reason}",
                         allowed="an address such as tcp://10.0.0.1:8786") from error  # fmt: skip


def _check_workers(client: "Client", address: str) -> None:
    """Raise UsageError where there are no workers, or they run another program than this."""
    try:
        client.wait_for_workers(1, timeout=ARRIVE_S)
    except TimeoutError as error:
        raise UsageError("the cluster has no worker", where=address, do="start some with 'dask worker'") from error
    mine = versions(program())
    for worker, theirs in client.run(program, on_error="return").items():
        if isinstance(theirs, BaseException):
            raise UsageError("a worker cannot run this program", where=worker, value=f"{theirs}",
                             do="install it there, too") from theirs  # fmt: skip
        other = [key for key, value in mine.items() if theirs.get(key) != value]
        if other:
            raise UsageError(f"a worker runs another program: {other[0]} differs", where=worker,
                             value=theirs.get(other[0]), allowed=f"{mine[other[0]]}, as here") from None  # fmt: skip


def _done(client: "Client", left: Iterator[Order], address: str, do: Do) -> Iterator[Outcome]:
    """Yield outcomes; orders that workers died over are done again, each alone: then it is known which one it was."""
    suspects: list[Order] = []
    for sheaf, outcomes in _ended(client, left, address, do):
        suspects += [] if outcomes else sheaf
        yield from outcomes
    for suspect in suspects:
        for _, outcomes in _ended(client, iter([suspect]), address, do):
            message = f"{suspect.path}: the workers that worked on it died, as when memory runs out"
            yield from outcomes or [Outcome(suspect.path, "failed", message=message)]


def _ended(client: "Client", left: Iterator[Order], address: str, do: Do) -> Iterator[tuple[Sheaf, list[Outcome]]]:
    """Yield sheaves of orders and their outcomes while handing out what is left; no outcomes of what was given up."""
    ended: Queue[Future] = Queue()
    under_way: dict[Future, Sheaf] = {}  # a future that nobody holds is given up by the scheduler
    size, workers, counted = 1, 0, -RECOUNT_S
    while True:
        if monotonic() - counted > RECOUNT_S:  # that asks the scheduler: not for every sheaf
            workers, counted = max(len(client.nthreads()), 1), monotonic()
        while len(under_way) < AHEAD * workers and (sheaf := tuple(islice(left, size))):
            future = client.submit(_sheaf_done, do, sheaf, pure=False)
            under_way[future] = sheaf
            future.add_done_callback(ended.put)
        if not under_way:
            return
        future = _next(ended, client, address)
        sheaf = under_way.pop(future)
        outcomes, seconds = _result(future, sheaf, client, address)
        if outcomes:
            size = min(max(int(SHEAF_S * len(outcomes) / max(seconds, 1e-9)), 1), 2 * size, MOST)
        yield sheaf, outcomes


def _sheaf_done(do: Do, sheaf: Sheaf) -> tuple[list[Outcome], float]:
    """Return, on a worker, what became of every order of a sheaf, and how long that took, s."""
    began = monotonic()
    return [_outcome(do, order) for order in sheaf], monotonic() - began


def _outcome(do: Do, order: Order) -> Outcome:
    """Return what became of an order, whatever its fault."""
    try:
        return do(order)
    except Exception as error:
        return _failed(order, error)


def _failed(order: Order, error: Exception) -> Outcome:
    told = f"{type(error).__name__}: {error}".splitlines()[0]
    return Outcome(order.path, "failed", message=f"{order.path}: it failed on the cluster: {told}")


def _next(ended: "Queue[Future]", client: "Client", address: str) -> "Future":
    """Return the next sheaf that ended; raise IncompleteError when no worker is left to end one."""
    while True:
        try:
            return ended.get(timeout=ALONE_S)
        except Empty as error:
            if not client.nthreads():
                raise _gone("the cluster lost all its workers", address) from error


def _result(future: "Future", sheaf: Sheaf, client: "Client", address: str) -> tuple[list[Outcome], float]:
    """Return what became of a sheaf that ended, and the time it took; nothing where workers died, perhaps of another.

    A worker may die of the next sheaf before this outcome was fetched from it: then it is worked out once more.
    """
    from distributed import KilledWorker

    while future.status != "cancelled":
        try:
            found: tuple[list[Outcome], float] = future.result(timeout=ALONE_S)
            return found
        except TimeoutError as error:
            if not client.nthreads():
                raise _gone("the cluster lost all its workers", address) from error
        except KilledWorker:
            return [], 0.0
        except Exception as error:  # it could not travel
            if future.status != "cancelled":
                return [_failed(order, error) for order in sheaf], SHEAF_S
    raise _gone("the cluster went away", address)


def _gone(what: str, address: str) -> IncompleteError:
    return IncompleteError(what, where=address, do="type the same line again later: what was answered is kept")
