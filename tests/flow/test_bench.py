"""Can an operator check, play and stop a protocol, on the loopback and on an emulated board on a real port?"""

import signal
import time
from pathlib import Path

import numpy as np
import pytest

from rig.recording import read
from tests.flow.console import here, protocol, rig, start

COMMANDS = ("check", "run", "import", "identify", "explain", "simulate", "devices", "emulate", "demo")


def test_help_lists_every_command(tmp_path: Path) -> None:
    ended = rig("--help", cwd=tmp_path)
    assert ended.code == 0
    assert all(f"  {command} " in ended.out for command in COMMANDS)


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help_with_an_example(tmp_path: Path, command: str) -> None:
    ended = rig(command, "--help", cwd=tmp_path)
    assert ended.code == 0
    assert f"\n    rig {command}" in ended.out


def test_check_tells_what_would_be_played_and_plays_nothing(tmp_path: Path) -> None:
    protocol(tmp_path)
    ended = here("check", "short.yaml", "--plot", "preview.png", cwd=tmp_path)
    assert ended.code == 0
    for words in (
        "accepted",
        "4000 Hz",
        "peak 9.5 V",
        "limits -10 to 10 V",
        "V/s",
        "of memory",
        "of disk",
        "loopback:",
    ):
        assert words in ended.out
    assert (tmp_path / "preview.png").read_bytes().startswith(b"\x89PNG")
    assert {path.name for path in tmp_path.iterdir()} == {"short.yaml", "preview.png"}


def test_check_finds_the_protocols_that_come_with_the_program(tmp_path: Path) -> None:
    ended = here("check", "protocols/fig13_staircase.yaml", cwd=tmp_path)
    assert ended.code == 0
    assert "Fig. 13 staircase: accepted" in ended.out


def test_run_keeps_every_sample_with_protocol_and_rig(recording: Path) -> None:
    kept = read(recording)
    assert kept.complete
    assert np.isfinite(kept.y).all()
    assert "rig: op-amp backlash circuit" in kept.rig_text
    assert "scale: 0.6" in kept.protocol_text
    assert kept.steps[-1].stop == kept.u.size
    assert kept.origin.equipment.address.startswith("loopback:")


def test_a_recording_is_not_overwritten_by_mistake(tmp_path: Path, recording: Path) -> None:
    protocol(tmp_path)
    kept = tmp_path / "kept.h5"
    kept.write_bytes(recording.read_bytes())
    assert here("run", "short.yaml", "--out", "kept.h5", cwd=tmp_path).code == 2
    assert kept.read_bytes() == recording.read_bytes()
    assert here("run", "short.yaml", "--out", "kept.h5", "--overwrite", cwd=tmp_path).code == 0
    assert kept.read_bytes() != recording.read_bytes()


def test_devices_lists_the_loopback(tmp_path: Path) -> None:
    ended = here("devices", cwd=tmp_path)
    assert ended.code == 0
    assert ended.out.startswith("loopback:")


def test_an_emulated_board_is_found_played_and_stopped(tmp_path: Path) -> None:
    protocol(tmp_path, ("periods: 3}", "periods: 300}"))
    with start("emulate", "serial", "--rig", "rigs/opamp_backlash.yaml", "--speed", "2", cwd=tmp_path) as board:
        try:
            assert board.stdout is not None
            address = board.stdout.readline().strip()
            assert address.startswith("serial:/")
            with start("run", "short.yaml", "--device", address, "--out", "stopped.h5", cwd=tmp_path) as played:
                _wait_for_samples(tmp_path / "stopped.h5")
                played.send_signal(signal.SIGINT)
                out, err = played.communicate(timeout=30)
            assert played.returncode == 4, err
            assert "samples kept" in out
            assert err.count("\n") == 1
            kept = read(tmp_path / "stopped.h5")
            assert not kept.complete
            assert any(event.kind == "safe" for event in kept.events)
            assert 0 < kept.trace().size < kept.u.size
        finally:
            board.send_signal(signal.SIGINT)
            board.communicate(timeout=10)
    assert board.returncode == 0


def _wait_for_samples(path: Path) -> None:
    """Wait until a recording is under way: its file is there and has been written to again."""
    deadline = time.monotonic() + 30.0
    while not path.exists():
        assert time.monotonic() < deadline
        time.sleep(0.05)
    begun = path.stat().st_mtime_ns
    while path.stat().st_mtime_ns == begun:
        assert time.monotonic() < deadline
        time.sleep(0.05)
    time.sleep(0.5)
