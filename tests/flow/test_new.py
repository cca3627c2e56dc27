"""Does `rig new` write a protocol that is valid, moves the gap and stays within its bounds, asked or not?"""

import json
import os
import pty
import select
import signal
import subprocess
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from identify.simulate import Player
from rig.asking import KINDS, long, short
from rig.cli import run_line
from rig.plan import plan
from rig.protocol import read_protocol
from rig.protocol_commands import ABOUT
from rig.schemas import MODELINE
from tests.flow.console import COMMAND, Ended, refused

RIGS = ("rigs/opamp_backlash.yaml", "rigs/paper_simulation.yaml", "rigs/opamp_behind_amplifier.yaml", "rigs/cable.yaml")


@pytest.fixture(autouse=True)
def _there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_what_may_be_asked_is_one_list() -> None:
    assert tuple(KINDS) == ABOUT


@pytest.mark.parametrize("about", ABOUT)
@pytest.mark.parametrize("rig", RIGS)
def test_every_question_becomes_a_valid_protocol_for_every_rig(
    rig: str, about: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_line(["new", "mine.yaml", "--about", about, "--rig", rig, "--level", "8 V", "--yes", "--json", "-"]) == 0
    told = json.loads(capsys.readouterr().out)
    text = Path("mine.yaml").read_text(encoding="utf-8")
    assert text.startswith(f"# Question: {KINDS[about].question}\n")
    assert MODELINE in text
    protocol = read_protocol("mine.yaml")
    made = plan(protocol)
    assert (told["schema"], told["peak_V"]) == ("rig.new/1", pytest.approx(made.peak_v))
    assert made.peak_v <= 8.0
    assert not [note for note in made.notes if "settles to" not in note]
    assert protocol.rig is not None
    if made.u.size < 400_000 and about not in ("noise", "held"):  # the slow rig's are as good, and take long to play
        y = Player(protocol.rig.model, made.rate_hz).play(made.u)
        assert all(np.ptp(y[s.start:s.stop]) > 5.0 * (protocol.rig.model.noise_v or 0.0) for s in made.steps)


def test_bounds_are_kept_and_what_moves_nothing_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    line = ["new", "mine.yaml", "--yes", "--about", "speed"]
    assert run_line([*line, "--level", "4 V", "--frequency", "3 Hz", "--rate", "5 kHz", "--title", "mine: 1"]) == 0
    protocol = read_protocol("mine.yaml")
    assert (protocol.limits.high_v, protocol.rate_hz, protocol.title) == (4.0, 5000.0, "mine: 1")
    capsys.readouterr()
    code = run_line(line)
    refused(Ended(code, *capsys.readouterr()), 2, "mine.yaml: there is a file of this name already", "--overwrite")
    code = run_line([*line, "--overwrite", "--level", "1 V"])
    refused(Ended(code, *capsys.readouterr()), 1, "the gap does not move", "--level: ", "1.6 V or more")
    code = run_line([*line, "--overwrite", "--level", "11 V"])
    refused(Ended(code, *capsys.readouterr()), 1, "the level is beyond", "11 V", "up to 10 V")
    code = run_line([*line, "--overwrite", "--rate", "10"])
    refused(Ended(code, *capsys.readouterr()), 2, "--rate: a number without a unit", "write '10 Hz'")
    Path("orders.yaml").write_text("spec: 1\nrig: r\nG1: {order: 1}\nF: backlash\nG2: {order: 1}\n")
    code = run_line([*line, "--overwrite", "--rig", "orders.yaml"])
    refused(Ended(code, *capsys.readouterr()), 1, "a rig without values")


@pytest.mark.parametrize(
    ("value", "low", "high"),
    [(2.0, 2.0, 2.0), (2.25, 2.2, 2.3), (0.1403, 0.14, 0.15), (99.5, 99.0, 100.0), (0.3, 0.3, 0.3), (0.0, 0.0, 0.0)],
)
def test_values_are_rounded_to_two_digits_towards_the_safe_side(value: float, low: float, high: float) -> None:
    assert (short(value), long(value)) == (low, high)


class Asked:
    """``rig new mine.yaml`` on a terminal of its own."""

    def __init__(self, folder: Path) -> None:
        self._mine, its = pty.openpty()
        self.process = subprocess.Popen(
            [*COMMAND, "new", "mine.yaml"], cwd=folder, stdin=its, stderr=its, stdout=subprocess.PIPE,
            start_new_session=True,
        )  # fmt: skip
        os.close(its)

    def until(self, words: str) -> str:
        """Return what it says up to ``words``."""
        said, last = "", time.monotonic() + 60.0
        while words not in said:
            assert time.monotonic() < last, said
            said += self.heard(1.0)
        return said

    def heard(self, timeout_s: float) -> str:
        """Return what it says next, nothing when that takes longer."""
        if not select.select([self._mine], [], [], timeout_s)[0]:
            return ""
        with suppress(OSError):
            return os.read(self._mine, 4096).decode()
        return ""

    def press(self) -> None:
        """Press Ctrl-C until it is heard: a signal that comes just before a program reads waits for what is typed."""
        said, last = "", time.monotonic() + 60.0
        while "rig: stopped" not in said:
            assert time.monotonic() < last, said
            self.process.send_signal(signal.SIGINT)
            said += self.heard(1.0)

    def type(self, line: str) -> None:
        os.write(self._mine, f"{line}\n".encode())

    def end(self) -> str:
        out, _ = self.process.communicate(timeout=60)
        os.close(self._mine)
        return out.decode()


def test_on_a_terminal_it_asks_and_asks_again_and_enter_takes_what_is_usual(tmp_path: Path) -> None:
    asked = Asked(tmp_path)
    assert "5  Does a held level stay where it is" in asked.until("What do you want to know? [1]:")
    asked.type("7")
    assert "'7' is none of 1 to 6" in asked.until("What do you want to know? [1]:")
    asked.type("5")
    asked.until("Rig file [rigs/opamp_backlash.yaml]:")
    asked.type("nowhere.yaml")
    assert "nowhere.yaml: no such file" in asked.until("Rig file [rigs/opamp_backlash.yaml]:")
    asked.type("")
    asked.until("Largest level [10 V]:")
    asked.type("5")
    assert "a number without a unit" in asked.until("Largest level [10 V]:")
    asked.type("5 V")
    asked.until("Frequency to begin with [7 Hz]:")
    asked.type("")
    asked.until("Sample rate [10000 Hz]:")
    asked.type("")
    asked.until("Title [held of op-amp backlash circuit]:")
    asked.type("my hold")
    out = asked.end()
    assert asked.process.returncode == 0
    assert out.startswith("mine.yaml: my hold\n")
    protocol = read_protocol(tmp_path / "mine.yaml")
    assert (protocol.title, protocol.limits.high_v, len(protocol.steps)) == ("my hold", 5.0, 3)


def test_stopped_while_it_asks_it_leaves_nothing(tmp_path: Path) -> None:
    asked = Asked(tmp_path)
    asked.until("What do you want to know? [1]:")
    asked.press()
    asked.end()
    assert asked.process.returncode == 130
    assert not list(tmp_path.iterdir())
