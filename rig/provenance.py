"""Which program recorded or computed this, and when: versions, the source and its commit, the clock of the host."""

import hashlib
import platform
import subprocess
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

PACKAGES = ("backlash-rig", "h5py", "numpy", "scipy", "numba", "llvmlite")
SOURCE = ("identify", "rig")
"""Packages of this program that shape its numbers."""
PLACE = ("system", "processor", "git_commit")
"""What `program` says of the machine it is on; the rest is the same wherever it is installed."""


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


def program() -> dict[str, str]:
    """Return what decides the bits of a computed number: software, the source itself, and the kind of processor.

    Compiled loops and linear algebra are made for the processor at hand, and round differently on another.
    """
    return {**software(), "source": source_digest(), "git_commit": git_commit(), "processor": _processor()}


@cache
def _processor() -> str:
    """Return the kind of processor as the compiler of the loops calls it."""
    from llvmlite.binding import get_host_cpu_name

    return str(get_host_cpu_name())


@cache
def source_digest() -> str:
    """Return the SHA-256 of the program's own text: two sources of one version number are told apart."""
    root, found = Path(__file__).resolve().parent.parent, hashlib.sha256()
    for path in sorted(path for package in SOURCE for path in (root / package).rglob("*.py")):
        found.update(f"{path.relative_to(root).as_posix()}\0".encode())
        found.update(hashlib.sha256(path.read_bytes()).digest())
    return found.hexdigest()


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
