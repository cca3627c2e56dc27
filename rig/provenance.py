"""Which program recorded this, and when: versions, the commit of the source, the clock of the host."""

import platform
import subprocess
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

PACKAGES = ("backlash-rig", "h5py", "numpy", "scipy", "numba")


def now() -> str:
    """Return the host's clock in UTC, ISO 8601, to the microsecond."""
    return datetime.now(UTC).isoformat(timespec="microseconds")


@cache
def _versions() -> dict[str, str]:
    found = {"python": platform.python_version(), "system": platform.platform()}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found


def software() -> dict[str, str]:
    """Return the versions of the program, of the libraries that shape its numbers, and of the system."""
    return dict(_versions())


@cache
def git_commit() -> str:
    """Return the commit of the source tree this runs from, ``-dirty`` when it was changed since; empty outside one."""
    root = Path(__file__).resolve().parent.parent
    if not (root / ".git").exists():
        return ""
    command = ["git", "-C", str(root), "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]
    try:
        return subprocess.run(command, capture_output=True, text=True, timeout=5, check=True).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return ""
