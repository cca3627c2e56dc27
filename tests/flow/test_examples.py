"""Does every example in the help of every command do what it is an example of?

Each is typed as it stands, in a folder that holds what it names. Devices that no test machine has are the loopback, a
cluster is this machine, and what takes long is computed once: whether it is right is asked elsewhere.
"""

import shlex
import shutil
import sys
from collections.abc import Callable, Generator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from nptdms import ChannelObject, TdmsWriter

from rig.cli import run_line
from rig.commands import commands
from rig.work import Do, Order, Outcome
from tests.benchmarks.batch import recordings
from tests.flow.console import PROTOCOL
from tests.rigs import CABLE

ROOT = Path(__file__).parents[2]
ELSEWHERE = {
    "rig demo": ('rig("demo", cwd=tmp_path', "tests/flow/test_demo.py"),
    "rig demo --out /tmp/first-light": ('"demo": ("demo", "--out", "new/demo")', "tests/flow/pressed.py"),
    "rig emulate serial": ('"emulate": ("emulate", "serial")', "tests/flow/pressed.py"),
    "rig emulate serial --rig rigs/opamp_backlash.yaml --speed 10":
        ('"emulate", "serial", "--rig", "rigs/opamp_backlash.yaml", "--speed"', "tests/flow/test_bench.py"),
    "rig run my.yaml --live": ('"--live"', "tests/flow/test_live.py"),
    "rig live run.h5": ('"live"', "tests/flow/test_live.py"),
    "rig live run.h5 --address 192.168.1.20 --port 8080": ('"live"', "tests/flow/test_live.py"),
}
"""Examples that serve until they are stopped, or take minutes: where they are typed, and how they stand there."""
INSTEAD = {
    "--device serial:/dev/ttyACM0": "--device loopback:", "--follow-up serial:/dev/ttyACM0": "--follow-up loopback:",
    "calibrate serial:/dev/ttyACM0": "calibrate loopback:cable.yaml", "--scheduler tcp://10.0.0.1:8786": "--workers 1",
}  # fmt: skip
RIG = """\
spec: 1
rig: a rig of the bench
G1: {num: [1000], den: [1.0e-4, 20, 1000]}
F: {backlash: {S_L: 8, D_L: 1.25 V, S_U: 8, D_U: -1.25 V}}
G2: {num: [1000], den: [1.0e-6, 2, 1000]}
noise: 10 mV
"""


def examples() -> list[str]:
    """Return every example of every command."""
    texts = [str(command.epilog).partition("Examples:\n")[2].splitlines() for command in commands.commands.values()]
    return [line.strip() for lines in texts for line in lines if line.strip()]


@pytest.fixture(scope="module")
def stock(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with all that the examples name."""
    folder = tmp_path_factory.mktemp("stock")
    recordings(folder / "made", 2)
    one, two = sorted((folder / "made").glob("*.h5"))
    for name in ("run", "a", "monday", "monday/run", "recordings/run", "runs/run", "c"):
        (folder / name).parent.mkdir(exist_ok=True)
        shutil.copy(one, folder / f"{name}.h5")
    for name in ("b", "friday", "runs/more"):
        shutil.copy(two, folder / f"{name}.h5")
    shutil.rmtree(folder / "made")
    for name, text in (("my_rig", RIG), ("rig", RIG), ("cable", CABLE), ("my", PROTOCOL)):
        (folder / f"{name}.yaml").write_text(text)
    _tables(folder)
    return folder


def _tables(folder: Path) -> None:
    """Write what other programs left."""
    u = np.sin(np.arange(110_000) * 1e-3)
    np.savetxt(folder / "table.csv.gz", np.column_stack([u, 0.5 * u]), "%.4f", ",", header="u,y", comments="")
    rows = np.column_stack([np.arange(300) * 1e-3, u[:300], u[:300]])
    np.savetxt(folder / "scope.csv", rows, "%.6f", ",", header="Time,CH1,CH2", comments="")
    with TdmsWriter(folder / "daq.tdms") as writer:
        clock = {"wf_increment": 1e-3, "wf_start_offset": 0.0}
        writer.write_segment([ChannelObject("Untitled", name, u[:300], clock) for name in ("ao0", "ai0")])
    assert run_line(["export", str(folder / "run.h5"), "--to", "csv", "--out", str(folder / "exported.csv")]) == 0
    (folder / "answers").mkdir()
    for to in ("answer.json", "answers/run.identify.json"):
        assert run_line(["identify", str(folder / "monday/run.h5"), "--json", str(folder / to)]) == 0


@pytest.fixture(scope="module")
def known() -> dict[str, Any]:
    """Return what was computed before."""
    return {}


@pytest.fixture(autouse=True)
def _once(known: dict[str, Any], monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> None:
    """Have identifications, explanations and comparisons computed once, and a batch work in this process."""
    import identify.compared
    import identify.explain
    import identify.joint

    def once(key: str, compute: Callable[..., Any]) -> Callable[..., Any]:
        def first(*words: Any, **named: Any) -> Any:
            if key not in known:
                known[key] = compute(*words, **named)
            return known[key]

        return first

    compare = identify.compared.compare
    values_only = once("compare", lambda *words: compare(*words[:-1], False))
    monkeypatch.setattr(sys.modules["identify.compared"], "compare", values_only)
    monkeypatch.setattr(sys.modules["identify.explain"], "explain", once("explain", identify.explain.explain))
    if "rig verify" not in request.node.name:
        monkeypatch.setattr(sys.modules["identify.joint"], "identify", once("identify", identify.joint.identify))
    monkeypatch.setattr("rig.crew.outcomes", _here)


def _here(orders: Sequence[Order], workers: int, do: Do) -> Generator[Outcome]:
    yield from map(do, orders)


def typed(line: str, folder: Path) -> list[str]:
    """Return what a shell makes of an example."""
    for there, here in INSTEAD.items():
        line = line.replace(there, here)
    words = shlex.split(line)[1:]
    if "'" in line:
        return words
    return [name for word in words for name in (sorted(str(p) for p in folder.glob(word)) if "*" in word else [word])]


@pytest.mark.parametrize("line", [line for line in examples() if line not in ELSEWHERE])
def test_an_example_can_be_typed_as_it_stands(
    line: str, stock: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "bench"
    shutil.copytree(stock, folder)
    monkeypatch.chdir(folder)
    monkeypatch.setenv("RIG_CALIBRATIONS", str(tmp_path / "kept"))
    words = typed(line, folder)
    written = [Path(path) for option, path in pairwise(words) if option in ("--out", "--report", "--json", "--plot")]
    for path in written:
        if path.is_file():
            path.unlink()
    assert run_line(words) == 0, capsys.readouterr().err
    assert capsys.readouterr().out
    assert all(path.exists() for path in written if str(path) != "-")


@pytest.mark.parametrize("line", ELSEWHERE)
def test_an_example_that_is_typed_elsewhere_stands_there(line: str) -> None:
    assert line in examples()
    words, where = ELSEWHERE[line]
    assert words in (ROOT / where).read_text(encoding="utf-8")


def test_every_command_has_an_example_of_itself() -> None:
    assert {line.split()[1] for line in examples()} == set(commands.commands)
