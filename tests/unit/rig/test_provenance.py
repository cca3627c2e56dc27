"""Does a recording know which program made it?"""

import subprocess
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from rig import provenance


def test_versions_of_program_and_libraries() -> None:
    assert provenance.software()["numpy"] == np.__version__
    assert provenance.software()["backlash-rig"] != "not installed"


def test_the_clock_is_utc_and_sortable() -> None:
    first = provenance.now()
    assert abs((datetime.fromisoformat(first) - datetime.now(UTC)).total_seconds()) < 5
    assert first <= provenance.now()


def test_a_package_that_is_not_installed_is_said_to_be_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(provenance, "PACKAGES", ("no-such-package",))
    assert provenance._versions.__wrapped__()["no-such-package"] == "not installed"


@pytest.mark.parametrize("failure", [FileNotFoundError("git"), subprocess.TimeoutExpired("git", 5)])
def test_no_git_no_commit(monkeypatch: pytest.MonkeyPatch, failure: Exception) -> None:
    def fail(*arguments: object, **options: object) -> None:
        raise failure

    monkeypatch.setattr(subprocess, "run", fail)
    assert provenance.git_commit.__wrapped__() == ""


@pytest.mark.skipif(not (Path(provenance.__file__).parents[1] / ".git").exists(), reason="not a clone")
def test_the_commit_is_that_of_the_tree() -> None:
    root = Path(provenance.__file__).parents[1]
    head = subprocess.run(["git", "-C", str(root), "rev-parse", "HEAD"], capture_output=True, text=True, check=True)
    provenance.git_commit.cache_clear()
    assert provenance.git_commit().removesuffix("-dirty") == head.stdout.strip()
