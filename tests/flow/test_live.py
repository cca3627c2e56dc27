"""Does an operator see a run in the browser as it forms, can it be aborted there, and does neither need the other?"""

import json
import os
import re
import signal
import socket
import subprocess
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from rig.cli import run_line
from rig.live import launching
from rig.live.page import WHO
from rig.recording import read
from tests.browser import DESK, PHONE, at_size, complaints, overflows
from tests.contrast import contrasts
from tests.flow.console import rig, start
from tests.rigs import GAP
from tests.wire import waiting
from tests.wire.emulated import Emulated, emulated

if TYPE_CHECKING:
    from selenium.webdriver import Chrome

HOSTILE = "<script>window.pwned = 1</script><img src=x onerror='window.pwned = 2'> $$x$$"
PROTOCOL = """\
spec: 1
title: "{title}"
question: "Is <b>this</b> text?"
rig: rig.yaml
limits: {{level: 5 V}}
acquisition: {{rate: 2 kHz, inputs: [y, u_measured]}}
ramp: 50 ms
steps:
  - repeats: {repeats}
    label: "<i>stairs</i>"
    staircase: {{levels: [{{from: -2 V, to: 2 V, step: 1 V}}, {{from: 1 V, to: -1 V, step: 1 V}}], dwell: 100 ms}}
"""
Watched = tuple[subprocess.Popen[str], str, Emulated]
SHOWN = "const at = document.getElementById(arguments[0]); return at ? at.textContent : ''"


def protocol(folder: Path, seconds: float) -> Path:
    """Return a protocol of stairs of 0.8 s each, its title and labels full of markup."""
    (folder / "rig.yaml").write_text(GAP)
    path = folder / "stairs.yaml"
    path.write_text(PROTOCOL.format(title=HOSTILE, repeats=round(seconds / 0.8)))
    return path


@contextmanager
def watched(folder: Path, seconds: float, idle_s: float = 60.0) -> Iterator[Watched]:
    """Give a run on an emulated board in real time, the URL of its page, and the board; all end with the test."""
    protocol(folder, seconds)
    os.environ[launching.IDLE_VARIABLE] = str(idle_s)
    with emulated(GAP) as board, start("run", "stairs.yaml", "--device", board.address, "--live", cwd=folder) as run:
        page = 0
        try:
            assert run.stderr is not None
            url = re.fullmatch(r"live page: (\S+)\n", run.stderr.readline())
            assert url
            page = page_of(run.pid)
            yield run, url[1], board
        finally:
            for process in (run.pid, page):
                kill(process)


def page_of(run: int) -> int:
    """Return the process that serves the page of a run."""
    children = Path(f"/proc/{run}/task/{run}/children").read_text().split()
    return next(int(each) for each in children if b"rig.live.process" in Path(f"/proc/{each}/cmdline").read_bytes())


def kill(process: int) -> None:
    """Kill a process that a test began, where it still is."""
    if process:
        try:
            os.kill(process, signal.SIGKILL)
        except ProcessLookupError:
            return


def answer(url: str, method: str = "GET", **headers: str) -> tuple[int, str, dict[str, str]]:
    """Return status, text and headers of what a server says."""
    asked = urllib.request.Request(url, method=method, headers=headers, data=b"" if method == "POST" else None)
    try:
        with urllib.request.urlopen(asked, timeout=20) as reply:
            return reply.status, reply.read().decode(), dict(reply.headers)
    except urllib.error.HTTPError as error:
        return error.code, error.read().decode(), dict(error.headers)


def told(url: str) -> dict[str, Any]:
    """Return what the page says, as programs ask for it."""
    return dict(json.loads(answer(url + "state")[1]))


def listening(process: int) -> set[str]:
    """Return the addresses a process listens on, as /proc has them."""
    mine = {os.readlink(entry) for entry in Path(f"/proc/{process}/fd").iterdir() if entry.is_symlink()}
    found = set()
    for table in ("tcp", "tcp6"):
        for row in Path(f"/proc/{process}/net/{table}").read_text().splitlines()[1:]:
            fields = row.split()
            if fields[3] == "0A" and f"socket:[{fields[9]}]" in mine:
                found.add(fields[1].partition(":")[0])
    return found


def eventually(true: Callable[[], object], within_s: float = 60.0) -> bool:
    """Return whether ``true`` comes in time, long where a machine is busy: the page yields to all others."""
    return waiting.eventually(true, within_s, every_s=0.3)


def text(browser: "Chrome", name: str) -> str:
    """Return what the page says in one place, nothing where there is no such place yet."""
    return str(browser.execute_script(SHOWN, name))


def test_a_run_is_seen_forming_and_its_abort_button_ramps_the_output_down(tmp_path: Path, browser: "Chrome") -> None:
    with watched(tmp_path, 300.0) as (run, url, board):
        at_size(browser, DESK)
        browser.get(url)
        assert eventually(lambda: "left" in text(browser, "progress") and int(text(browser, "figure-dwells")) > 2)
        _looks_right(browser)
        complaints(browser)
        assert browser.execute_script("return window.pwned") is None
        ticks = "return window.rigTicks.length"
        before = browser.execute_script(ticks)
        assert eventually(lambda: browser.execute_script(ticks) > before + 5)
        browser.find_element("id", "stop").click()
        assert run.wait(60) == 4
        assert board.look().level_v == pytest.approx(0.0, abs=1e-3)
        assert run.stderr is not None
        assert f"stopped by {WHO}" in run.stderr.read()
        assert eventually(lambda: "Ended early" in text(browser, "state"))
        assert WHO in text(browser, "state")
        assert not browser.find_element("id", "stop").is_enabled()
        assert eventually(lambda: text(browser, "answer") == "The run has ended.")
    kept = read(tmp_path / "stairs.h5")
    assert WHO in kept.reason
    assert 0 < kept.trace().size < kept.u.size
    assert kept.trace().valid is None, "the page cost the run samples"


def _looks_right(browser: "Chrome") -> None:
    """Assert what holds of the page at a desk and on a phone: text is text, lamps speak, pictures have words."""
    assert text(browser, "title") == HOSTILE
    assert text(browser, "question") == "Is <b>this</b> text?"
    assert "<i>stairs</i>" in text(browser, "step")
    assert re.search(r" of 5.0 min .*, about .* left", text(browser, "progress"))
    assert text(browser, "lamp-overrun") == "Overrunno sample lost"
    assert "within the input's" in text(browser, "lamp-input")
    assert "within its limits -5 to 5 V" in text(browser, "lamp-output")
    assert "x the noise" in text(browser, "figure-residual")
    for size in (PHONE, DESK):
        at_size(browser, size)
        assert overflows(browser, size) <= 0
        faint = {where: ratio for where, ratio in contrasts(browser).items() if ratio < 4.5}
        assert not faint
    for picture in browser.find_elements("css selector", "[role=img]"):
        words = [text(browser, name) for name in (picture.get_attribute("aria-labelledby") or "",
                                                  picture.get_attribute("aria-describedby") or "")]
        assert all(len(each) > 5 for each in words)
        assert eventually(partial(picture.find_elements, "css selector", ".bk-Figure")), "nothing is drawn here"
    assert browser.execute_script("return document.documentElement.lang") == "en"


def test_a_run_survives_the_death_of_its_page(tmp_path: Path) -> None:
    with watched(tmp_path, 3.2) as (run, url, _):
        assert eventually((tmp_path / "stairs.h5").exists)  # the page itself may be asked too late on a busy machine
        os.kill(page_of(run.pid), signal.SIGKILL)
        assert run.wait(60) == 0
        with pytest.raises(OSError, match=r"refused|reset"):
            answer(url)
    kept = read(tmp_path / "stairs.h5")
    assert kept.complete
    assert kept.trace().valid is None


def test_a_page_survives_the_death_of_its_run_and_nobody_without_its_token_sees_it(tmp_path: Path) -> None:
    with watched(tmp_path, 300.0, idle_s=2.0) as (run, url, board):
        page = page_of(run.pid)
        assert eventually(lambda: told(url).get("state") == "Recording.")
        _closed_to_others(url, page)
        os.kill(run.pid, signal.SIGKILL)
        run.wait()
        assert eventually(lambda: "the program ended before the run did" in told(url)["state"])
        status, words, _ = answer(url + "abort", "POST")
        assert (status, words) == (409, "The run has ended already.")
        assert eventually(lambda: board.look().level_v == pytest.approx(0.0, abs=1e-3), 30.0)
        assert eventually(lambda: not Path(f"/proc/{page}").exists()), "nobody looks, and it stays"


def _closed_to_others(url: str, page: int) -> None:
    """Assert that the page listens on the loopback address alone, and shows nothing to whoever has not its URL."""
    assert listening(page) == {"0100007F"}
    root, _, token = url.rstrip("/").rpartition("/")
    assert len(token) >= 32
    for path in ("/", "/ws", "/abort", "/static/js/bokeh.min.js", "/metadata", "/autoload.js", f"/{token[:-1]}/"):
        assert answer(root + path)[0] == 404, path
    assert answer(root + "/abort", "POST")[0] == 404
    assert answer(url + "abort", "POST", Origin="http://evil.example")[0] == 403
    assert answer(url + "abort")[0] == 405
    status, _, headers = answer(url)
    assert status == 200
    assert "connect-src 'self'" in headers["Content-Security-Policy"]
    assert headers["Referrer-Policy"] == "no-referrer"
    assert _upgraded(url, "http://evil.example") == 403


def _upgraded(url: str, origin: str) -> int:
    """Return what a web socket from a page of another host is told."""
    host, _, path = url.removeprefix("http://").partition("/")
    name, _, port = host.partition(":")
    with socket.create_connection((name, int(port)), timeout=10) as link:
        link.sendall(f"GET /{path}ws HTTP/1.1\r\nHost: {host}\r\nOrigin: {origin}\r\nConnection: Upgrade\r\n"
                     "Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                     "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Protocol: bokeh, x\r\n\r\n".encode())
        return int(link.recv(64).split()[1])


def test_a_finished_recording_is_shown_and_ctrl_c_ends_the_page_alone(recording: Path, tmp_path: Path) -> None:
    with start("live", recording, cwd=tmp_path) as page:
        try:
            assert page.stdout is not None
            url = page.stdout.readline().split()[-1]
            status, shown, _ = answer(url)
            assert status == 200
            assert "Ended: all" in shown
            assert "settled" in shown
            page.send_signal(signal.SIGINT)
            assert page.wait(10) == 0
            assert page.stderr is not None
            assert page.stderr.read() == ""
        finally:
            kill(page.pid)


def test_without_bokeh_nothing_is_output(tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                         capsys: pytest.CaptureFixture[str]) -> None:
    protocol(tmp_path, 0.8)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(launching, "find_spec", lambda name: None)
    for line in (["run", "stairs.yaml", "--live"], ["live", "stairs.h5"]):
        assert run_line(line) == 2
        assert "pip install 'backlash-rig[live]'" in capsys.readouterr().err
    assert not (tmp_path / "stairs.h5").exists()


def test_a_refused_run_leaves_no_page_behind(tmp_path: Path) -> None:
    (tmp_path / "stairs.h5").write_bytes(b"mine")
    protocol(tmp_path, 0.8)
    ended = rig("run", "stairs.yaml", "--live", cwd=tmp_path)
    assert ended.code == 2
    said = ended.err.splitlines()
    assert said[0].startswith("live page: ")
    assert "there is a file of this name already" in said[1]
    url = said[0].split()[-1]
    assert eventually(lambda: _gone(url)), "the page of no run stays"


def _gone(url: str) -> bool:
    try:
        answer(url)
    except OSError:
        return True
    return False


@pytest.mark.parametrize(("address", "what"), [("192.0.2.1", "cannot be served"), ("0.0.0.0", "every address")])
def test_an_address_that_cannot_be_is_refused(recording: Path, tmp_path: Path, address: str, what: str) -> None:
    ended = rig("live", recording, "--address", address, cwd=tmp_path)
    assert ended.code == 2
    assert what in ended.err


def test_a_page_of_nothing_says_so() -> None:
    from rig.live.page import Page

    status, words = Page().abort()
    assert status == 409
    assert "Ctrl-C" in words
