"""Does a cluster whose worker dies do every order, each once, and is what cannot be done there said in a sentence?"""

import os
import signal
from collections.abc import Iterator
from pathlib import Path

import dask
import pytest
from distributed import LocalCluster
from distributed.worker import thread_state

from rig import cluster
from rig.errors import UsageError
from rig.provenance import program
from rig.question import Question
from rig.work import Order, Outcome


@pytest.fixture(scope="module")
def scheduler() -> Iterator[str]:
    """Return the address of two workers; an order that two of them died of is given up."""
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 1}),
        LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0", silence_logs="CRITICAL") as local,
    ):
        yield local.scheduler_address


def done(order: Order) -> Outcome:
    """Note in the order's folder that it was begun; kill this worker where the name says so, once or always."""
    path = order.path
    begun = path.with_name(f"{path.name}.begun")
    with begun.open("a") as file:
        file.write("x")
    if path.name == "always" or (path.name == "once" and begun.read_text() == "x"):
        os.kill(os.getpid(), signal.SIGKILL)
    if path.name == "fault":
        raise ZeroDivisionError("division by zero")
    return Outcome(path, "answered", text=path.name)


def test_a_worker_that_dies_costs_nothing_and_what_kills_every_worker_is_one_failure(
    scheduler: str, tmp_path: Path
) -> None:
    names = ["a", "once", "b", "always", "c", "fault", *map(str, range(6))]
    orders = [Order(tmp_path / name, Question("identify"), {}) for name in names]
    found = {outcome.path.name: outcome for outcome in cluster.outcomes(orders, scheduler, done)}
    assert sorted(found) == sorted(names)
    assert {name for name, outcome in found.items() if outcome.kind == "failed"} == {"always", "fault"}
    assert "the workers that worked on it died" in found["always"].message
    assert "ZeroDivisionError: division by zero" in found["fault"].message
    assert len((tmp_path / "once.begun").read_text()) >= 2
    assert not found["always"].text


def named(order: Order) -> Outcome:
    """Tell which task of the cluster this order was part of."""
    return Outcome(order.path, "answered", text=str(thread_state.key))


def test_small_orders_are_handed_over_many_at_a_time(scheduler: str, tmp_path: Path) -> None:
    orders = [Order(tmp_path / str(number), Question("identify"), {}) for number in range(400)]
    found = list(cluster.outcomes(orders, scheduler, named))
    assert sorted(outcome.path for outcome in found) == sorted(order.path for order in orders)
    assert len({outcome.text for outcome in found}) < len(orders) / 10


def test_workers_with_another_program_are_refused(scheduler: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "versions", lambda of: {**of, "numpy": "0.1"} if of is mine else dict(of))
    mine = program()
    monkeypatch.setattr(cluster, "program", lambda: mine)
    with pytest.raises(UsageError, match="a worker runs another program: numpy differs"):
        list(cluster.outcomes([], scheduler, done))


def test_where_no_scheduler_answers_it_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "CONNECT_S", 0.2)
    for address in ("tcp://127.0.0.1:1", "nonsense://"):
        with pytest.raises(UsageError, match="no Dask scheduler answers"):
            list(cluster.outcomes([], address, done))
