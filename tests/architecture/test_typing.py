"""Is every package typed, strictly? Beside the other tests: a checker uses one processor alone."""

import subprocess
import sys
from pathlib import Path

import pytest


@pytest.mark.uncounted
def test_all_packages_are_strictly_typed() -> None:
    ended = subprocess.run(
        [sys.executable, "-m", "mypy"], cwd=Path(__file__).parents[2], capture_output=True, text=True, check=False
    )
    assert ended.returncode == 0, ended.stdout + ended.stderr
