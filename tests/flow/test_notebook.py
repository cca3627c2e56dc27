"""Does a cell of a real notebook kernel show how far a long job is, and nothing of it once it is over?"""

import sys
from collections.abc import Iterator
from typing import Any

import pytest
from jupyter_client.blocking.client import BlockingKernelClient
from jupyter_client.manager import KernelManager

from rig.cell import told_here
from tests.flow.console import here

PATIENCE_S = 120.0
SHOWN = ("display_data", "update_display_data")


@pytest.fixture(scope="module")
def kernel(tmp_path_factory: pytest.TempPathFactory) -> Iterator[BlockingKernelClient]:
    """Return a kernel that works in a folder with one recording: any test may be its first, or its only one."""
    folder = tmp_path_factory.mktemp("notebook")
    assert here("run", "hold_ladder.yaml", "--out", "hold.h5", cwd=folder).code == 0
    manager = KernelManager(kernel_name="python3")
    manager.start_kernel()
    client = manager.blocking_client()
    client.start_channels()
    client.wait_for_ready(timeout=PATIENCE_S)
    assert played(client, f"import os, rig\nos.chdir({str(folder)!r})") == ([], "")
    yield client
    client.stop_channels()
    manager.shutdown_kernel(now=True)


def played(kernel: BlockingKernelClient, cell: str) -> tuple[list[str], str]:
    """Run a cell; return the lines that were shown under it, in order, and its result."""
    lines: list[str] = []
    results: list[str] = []

    def heard(message: dict[str, Any]) -> None:
        kind, content = message["msg_type"], message["content"]
        if kind in SHOWN:
            lines.append(content["data"]["text/plain"])
        if kind == "execute_result":
            results.append(content["data"]["text/plain"])

    reply = kernel.execute_interactive(cell, timeout=PATIENCE_S, output_hook=heard)
    assert reply["content"]["status"] == "ok", reply["content"]
    return lines, "".join(results)


def test_a_cell_shows_how_far_a_job_is_and_clears_that_at_its_end(kernel: BlockingKernelClient) -> None:
    lines, result = played(kernel, "rig.identify('hold.h5')")
    assert lines[0] == "identify"
    assert any("%" in line for line in lines[1:])
    assert lines[-1] == ""
    assert result.startswith("Identification")


def test_what_goes_wrong_in_a_cell_leaves_no_line_behind(kernel: BlockingKernelClient) -> None:
    cell = "try:\n    rig.compare('hold.h5', 'missing.h5')\nexcept rig.errors.FileError as error:\n    print(error)"
    assert played(kernel, cell) == (["compare", ""], "")


def test_a_script_that_talks_to_a_kernel_is_no_notebook(
    kernel: BlockingKernelClient, capsys: pytest.CaptureFixture[str]
) -> None:
    assert kernel.is_alive()
    assert "ipykernel" in sys.modules
    with told_here("identify", None) as show:
        show("half way", 0.5)
    assert capsys.readouterr() == ("", "")


def test_who_listens_is_told_instead(kernel: BlockingKernelClient) -> None:
    cell = "told = []\nrig.identify('hold.h5', progress=lambda words, share: told.append(share))\nlen(told) > 1"
    assert played(kernel, cell) == ([], "True")
