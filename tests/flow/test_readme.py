"""Does what the READMEs show work as shown? Every file, every line typed, every line printed of the worked example."""

import io
import json
import re
import shlex
import shutil
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path
from textwrap import dedent
from types import ModuleType
from typing import Any, cast

import click
import pytest
import yaml
from matplotlib import pyplot

import identify
import rig as front
from rig.cli import run_line
from rig.commands import commands
from rig.plan import plan
from rig.protocol import parse_protocol
from rig.rigfile import parse_rig
from rig.steps import STIMULI
from tests.architecture.house import ROOT
from tests.flow.console import Ended
from tests.flow.printed import agree, check_printed
from tests.pages import Example, example, examples, pages

PROSE = ("README.md", "rig/README.md", "protocols/README.md", "protocols/rigs/README.md", "drivers/README.md",
         "identify/README.md", "identify/effects/README.md")  # fmt: skip


def typed() -> list[tuple[str, list[str]]]:
    """Return every line of a README that begins with ``rig COMMAND``, and where it stands."""
    found = []
    for each in examples("", "console"):
        lines = [line.removeprefix("$ ") for line in each.text.splitlines()]
        found += [(str(each), line) for line in lines if line.startswith("rig ")]
    for path in pages():
        spoken = re.findall(r"`(rig [a-z]+ [^`]+)`", path.read_text(encoding="utf-8").replace("\n", " "))
        found += [(str(path), line) for line in spoken]
    return [(where, shlex.split(line, comments=True)[1:]) for where, line in found if "{" not in line]


def test_there_is_something_to_type() -> None:
    assert len(typed()) > 60
    assert {words[0] for _, words in typed()} == set(commands.commands)


@pytest.mark.parametrize(("where", "words"), typed(), ids=lambda item: " ".join(item) if isinstance(item, list) else "")
def test_every_line_typed_has_options_that_exist(where: str, words: list[str]) -> None:
    """Arguments may be left out where a sentence speaks of a command; an option nobody knows is an error."""
    found = cast(click.Command, commands.commands[words[0]])
    found.make_context(words[0], words[1:], resilient_parsing=True)
    known = {option for parameter in found.params for option in (*parameter.opts, *parameter.secondary_opts)}
    assert [word for word in words if word.startswith("--") and word not in {*known, "--help"}] == [], where


@pytest.mark.parametrize("shown", [e for e in examples("yaml") if e.page in PROSE], ids=str)
def test_every_yaml_shown_is_accepted(shown: Example, tmp_path: Path) -> None:
    if "steps" not in yaml.safe_load(shown.text):
        assert parse_rig(shown.text, str(shown)).model
        return
    for other in examples("yaml", page=shown.page):
        (tmp_path / (other.file or "other.yaml")).write_text(other.text)
    made = plan(parse_protocol(shown.text, str(tmp_path / "shown.yaml")))
    assert made.u.size > 0


def test_every_stimulus_is_shown() -> None:
    steps = yaml.safe_load(example("protocols/README.md", "every_stimulus.yaml"))["steps"]
    assert {kind for step in steps for kind in step} == set(STIMULI)


def type_in(line: str, folder: Path) -> Ended:
    """Return how a line ended, typed in a folder: in this process, which has loaded what is slow to load."""
    out, err = io.StringIO(), io.StringIO()
    with chdir(folder), redirect_stdout(out), redirect_stderr(err):
        code = run_line(shlex.split(line)[1:])
    return Ended(code, out.getvalue(), err.getvalue())


def session(page: str) -> list[tuple[str, list[str]]]:
    """Return what is typed on a page, and what is shown below each line."""
    found: list[tuple[str, list[str]]] = []
    for each in examples("console", page=page):
        for line in each.text.splitlines():
            if line.startswith("$ "):
                found.append((line[2:], []))
            else:
                found[-1][1].append(line)
    return found


@pytest.fixture(scope="module")
def worked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder in which the worked example of the README was typed, each line held against what is shown."""
    folder = tmp_path_factory.mktemp("worked")
    for each in examples("yaml"):
        if each.page == "README.md":
            (folder / each.file).write_text(each.text)
    for line, shown in session("README.md"):
        check_printed(type_in(line, folder), shown, line)
    return folder


def test_the_worked_example_goes_as_shown(worked: Path) -> None:
    assert {path.name for path in worked.iterdir()} == {
        "my_rig.yaml", "hold.yaml", "hold.h5", "hold.html", "hold.json", "hold.csv"}


def test_python_shown_runs(worked: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("RUN.h5", "OTHER.h5"):
        shutil.copy(worked / "hold.h5", name)
    shown = [each for each in examples("python") if each.page in PROSE and not each.file]
    assert len(shown) >= 2
    for each in shown:
        names: dict[str, Any] = {}
        exec(compile(each.text, str(each), "exec"), names)
        if "told" in names:
            first = names["told"].plot()[0]
            assert first.get_legend_handles_labels()[1] == ["recorded", "plain model", "improved model"]
            assert names["found"].plot()[0].get_xlabel() == "level of u in V"
    pyplot.close("all")


def test_every_key_of_an_answer_is_told(worked: Path) -> None:
    page = (ROOT / "identify" / "README.md").read_text(encoding="utf-8")
    table, _, after = page.partition("## The answer as JSON")[2].partition("`rig identify` has")
    keys = [row.split("|")[1] for row in table.splitlines() if row.startswith("| `")]
    listed = {key for cell in keys for key in re.findall(r"`(\w+)`", cell)}
    told = json.loads((worked / "hold.json").read_text(encoding="utf-8"))
    assert listed - {"incomplete"} == set(told)
    found = json.loads(type_in("rig identify hold.h5 --json -", worked).out)
    named = set(re.findall(r"`(\w+)`", after.partition("\n\n")[0]))
    assert set(found) - {"backlash_own_scale"} <= named


@pytest.mark.parametrize("package", [identify, front], ids=lambda package: package.__name__)
def test_what_help_shows_runs(
    package: ModuleType, worked: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The lines indented behind ``::`` in the docstring of a front door."""
    monkeypatch.chdir(tmp_path)
    for name in ("my_rig.yaml", "hold.yaml"):
        shutil.copy(worked / name, name)
    shown = dedent("\n".join(re.findall(r"^    .*$|^$", (package.__doc__ or "").partition("::\n")[2], re.MULTILINE)))
    assert "import " in shown
    trace = front.read(worked / "hold.h5").trace()
    names: dict[str, Any] = {"rate_hz": trace.rate_hz, "u": trace.u[:], "y": trace.y[:]}
    exec(compile(shown, package.__name__, "exec"), names)
    pyplot.close("all")


@pytest.mark.parametrize(("told", "same"), [
    ("rate 0.40001 1/s ± 0.00015 1/s", True), ("rate 0.40101 1/s ± 0.00015 1/s", True),
    ("rate 0.41 1/s ± 0.00015 1/s", False), ("leak 0.40001 1/s ± 0.00015 1/s", False),
])  # fmt: skip
def test_a_line_is_the_same_but_for_rounding(told: str, same: bool) -> None:
    assert agree(told, "rate 0.40001 1/s ± 0.00015 1/s") is same
