"""How is work spread over the cores of this machine, so that a process that dies costs one piece of it?

Every worker is a process of its own with one numerical thread and one order at a time, so that it is known which
recording it died of; another takes its place. One that takes longer over an order than it may is ended. All end with
the program that started them, however that ends.
"""

import multiprocessing
import os
import signal
import threading
from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from math import isinf
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from time import monotonic
from typing import Self

from rig.errors import RigError
from rig.work import Do, Order, Outcome

ONE_THREAD = dict.fromkeys(
    ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)
READY = "ready"
GOODBYE_S = 5.0


def cores() -> int:
    """Return how many cores this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # a system that ties no process to cores
        return os.cpu_count() or 1


def outcomes(orders: Iterable[Order], workers: int, do: Do) -> Generator[Outcome]:
    """Yield what became of every order, as they end, over so many processes.

    ``do`` is done there. Raises RigError when a worker cannot even begin. Closing the iterator ends the workers.
    """
    left = iter(orders)
    crew: dict[Connection, Worker] = {}
    try:
        for order in (order for _, order in zip(range(workers), left, strict=False)):
            worker = Worker.hired(order, do)
            crew[worker.link] = worker
        while crew:
            ready = wait(list(crew), _patience_s(crew.values()))
            for link in [link for link, worker in crew.items() if link in ready or worker.left_s <= 0.0]:
                worker = crew.pop(link)
                outcome, able = worker.heard()
                following = next(left, None) if outcome else worker.order
                if following is not None:
                    worker = worker.given(following) if able else Worker.hired(following, do)
                    crew[worker.link] = worker
                elif able:
                    worker.dismiss()
                if outcome:
                    yield outcome
    finally:
        for worker in crew.values():
            worker.process.kill()
            worker.dismiss()


@dataclass(frozen=True)
class Worker:
    """A process, the line to it, and the order it has; it is given that once it is ``begun``, at a time in s."""

    process: SpawnProcess
    link: Connection
    order: Order
    begun: float | None = None

    @property
    def left_s(self) -> float:
        """Return how long the order may still take."""
        if self.begun is None or self.order.limit_s is None:
            return float("inf")
        return self.begun + self.order.limit_s - monotonic()

    @classmethod
    def hired(cls, order: Order, do: Do) -> Self:
        """Start a process for an order."""
        context = multiprocessing.get_context("spawn")
        mine, its = context.Pipe()
        process = context.Process(target=serve, args=(its, do), daemon=True)
        with _one_thread():
            process.start()
        its.close()
        return cls(process, mine, order)

    def heard(self) -> tuple[Outcome | None, bool]:
        """Return what became of the order, None where the process is only ready; and whether it can go on."""
        if not self.link.poll():
            self.process.kill()
            self.dismiss()
            return Outcome(self.order.path, "failed", message=self.order.too_long), False
        try:
            said = self.link.recv()
        except (EOFError, OSError):
            self.dismiss()
            if self.begun is None:
                raise RigError("a worker process does not start", value=_end(self.process.exitcode),
                               do="look for the reason above; see whether memory is left") from None  # fmt: skip
            message = f"{self.order.path}: the process that worked on it died: {_end(self.process.exitcode)}"
            return Outcome(self.order.path, "failed", message=message), False
        return (None, True) if said == READY else (said, True)

    def given(self, order: Order) -> Self:
        """Return the worker with an order, which it was sent."""
        with suppress(BrokenPipeError):  # it has died: that is heard next
            self.link.send(order)
        return type(self)(self.process, self.link, order, begun=monotonic())

    def dismiss(self) -> None:
        """Let go of the process, which ends when its line does."""
        self.link.close()
        self.process.join(GOODBYE_S)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()


def serve(link: Connection, do: Do) -> None:
    """Do orders until there is nobody to give them: what a worker process runs."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # whoever started it is told, and ends it
    threading.Thread(target=_end_with_parent, daemon=True).start()
    with suppress(EOFError, ConnectionError):  # whoever gave orders is gone, or was killed
        link.send(READY)
        while True:
            link.send(do(link.recv()))


def _patience_s(crew: Iterable[Worker]) -> float | None:
    """Return how long to wait for one to say something: until the time of one is over."""
    least_s = min(worker.left_s for worker in crew)
    return None if isinf(least_s) else max(least_s, 0.0)


def _end_with_parent() -> None:
    """End this process when the one that started it has ended."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)


def _end(code: int | None) -> str:
    """Return how a process ended, in words."""
    if code is None or code >= 0:
        return f"exit code {code}"
    name = signal.Signals(-code).name
    return f"{name}, as when memory runs out" if name == "SIGKILL" else name


@contextmanager
def _one_thread() -> Iterator[None]:
    """Have processes started meanwhile compute in one thread each."""
    before = {key: os.environ.get(key) for key in ONE_THREAD}
    os.environ.update(ONE_THREAD)
    try:
        yield
    finally:
        for key, value in before.items():
            os.environ.pop(key) if value is None else os.environ.update({key: value})
