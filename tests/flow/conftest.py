"""Recordings that several flow tests look at, made once through the command line, typed in this process."""

from pathlib import Path

import pytest

from tests.flow.console import here, protocol


@pytest.fixture(scope="session")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the short protocol as played on the loopback device, whose rig conceals its rails."""
    folder = tmp_path_factory.mktemp("recording")
    ended = here("run", protocol(folder).name, cwd=folder)
    assert ended.code == 0, ended
    return folder / "short.h5"


@pytest.fixture(scope="session")
def held_out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return another protocol on the same rig: other levels, another sine."""
    folder = tmp_path_factory.mktemp("held_out")
    path = protocol(folder, ("scale: 0.6", "scale: 0.7"), ("frequency: 10 Hz", "frequency: 12.5 Hz"), name="other.yaml")
    ended = here("run", path.name, cwd=folder)
    assert ended.code == 0, ended
    return folder / "other.h5"
