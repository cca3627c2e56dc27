"""Does a worker that dies cost its own recording and no other, and do workers end with whoever started them?"""

import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

import pytest

from rig.crew import ONE_THREAD, outcomes, serve
from rig.errors import RigError
from rig.question import Question
from rig.work import Order, Outcome


def orders(*names: str) -> list[Order]:
    return [Order(Path(name), Question("identify"), {}) for name in names]


def named_deaths(order: Order) -> Outcome:
    """Die as the name of the order says, else answer with what this process was given."""
    if order.path.name in signal.Signals.__members__:
        os.kill(os.getpid(), signal.Signals[order.path.name])
    if order.path.name == "exit":
        os._exit(3)
    threads = ",".join(os.environ.get(key, "") for key in ONE_THREAD)
    return Outcome(order.path, "answered", f"{os.getpid()} {threads}")


def sleeps(order: Order) -> Outcome:
    print(os.getpid(), flush=True)
    time.sleep(60.0)
    return Outcome(order.path, "answered")


def test_a_worker_that_dies_costs_its_own_recording_and_another_goes_on() -> None:
    names = ["a", "SIGKILL", "b", "SIGSEGV", "exit", "c"]
    before = {key: os.environ.get(key) for key in ONE_THREAD}
    found = {outcome.path.name: outcome for outcome in outcomes(orders(*names), 1, named_deaths)}
    assert sorted(found) == sorted(names)
    assert {name for name in names if found[name].kind == "answered"} == {"a", "b", "c"}
    assert "SIGKILL, as when memory runs out" in found["SIGKILL"].message
    assert "SIGSEGV" in found["SIGSEGV"].message
    assert "exit code 3" in found["exit"].message
    assert not any(found[name].text for name in ("SIGKILL", "SIGSEGV", "exit"))  # tried again next time
    pids = {found[name].text.split()[0] for name in "abc"}
    assert len(pids) == 3
    assert str(os.getpid()) not in pids
    assert found["a"].text.split()[1] == "1,1,1,1"
    assert all(os.environ.get(key) == value for key, value in before.items())


def test_a_worker_whose_giver_is_gone_before_it_listens_ends_without_a_word(capfd: pytest.CaptureFixture[str]) -> None:
    """As when a batch is killed while its workers start: what they said is still unread, and their line is cut."""
    context = get_context("spawn")
    mine, theirs = context.Pipe()
    worker = context.Process(target=serve, args=(theirs, named_deaths))
    worker.start()
    theirs.close()
    assert mine.poll(60.0)
    mine.close()
    worker.join(60.0)
    assert worker.exitcode == 0
    assert "Traceback" not in capfd.readouterr().err


def dawdles(order: Order) -> Outcome:
    if order.path.name.startswith("long"):
        time.sleep(60.0)
    return Outcome(order.path, "answered", str(os.getpid()))


def test_what_takes_too_long_is_given_up_and_the_rest_is_done() -> None:
    given = [replace(order, limit_s=0.3) for order in orders("a", "long", "b", "longer", "c")]
    began = time.monotonic()
    found = {outcome.path.name: outcome for outcome in outcomes(given, 2, dawdles)}
    assert time.monotonic() - began < 30.0
    assert {name for name, outcome in found.items() if outcome.kind == "answered"} == {"a", "b", "c"}
    for name in ("long", "longer"):
        assert found[name].message == f"{name}: not answered within --time-limit, 0.3 s; give it more"
        assert not found[name].text  # tried again next time


def test_a_worker_that_cannot_begin_ends_the_batch_with_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rig.crew.serve", ends_at_once)
    with pytest.raises(RigError, match="a worker process does not start: exit code 9"):
        list(outcomes(orders("a", "b"), 2, named_deaths))


def ends_at_once(link: object, do: object) -> None:
    os._exit(9)


def test_workers_end_with_the_program_that_started_them(tmp_path: Path) -> None:
    script = (
        "from tests.unit.rig.test_crew import orders, outcomes, sleeps\n"
        "if __name__ == '__main__':\n    list(outcomes(orders('a'), 1, sleeps))\n"
    )
    (tmp_path / "script.py").write_text(script)
    root = str(Path(__file__).parents[3])
    surroundings = {**os.environ, "PYTHONPATH": root}
    with subprocess.Popen([sys.executable, "script.py"], cwd=tmp_path, stdout=subprocess.PIPE, env=surroundings) as run:
        assert run.stdout is not None
        worker = int(run.stdout.readline())
        run.kill()
        run.wait()
        until = time.monotonic() + 10.0
        while is_running(worker) and time.monotonic() < until:
            time.sleep(0.01)
    assert not is_running(worker)


def is_running(pid: int) -> bool:
    """Return whether a process has not ended; one that nobody has buried yet has."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
