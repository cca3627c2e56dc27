"""How does a test install a package of somebody else's, with one entry point, and type a command beside it?"""

import os
import subprocess
import sys
from pathlib import Path

from tests.architecture.house import ROOT


def plug_in(folder: Path, module: str, text: str, group: str, name: str, member: str) -> None:
    """Install ``module`` with one entry point into ``folder``, as a package manager would."""
    (folder / f"{module}.py").write_text(text, encoding="utf-8")
    installed = folder / f"{module}-1.dist-info"
    installed.mkdir(exist_ok=True)
    (installed / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {module}\nVersion: 1\n")
    (installed / "entry_points.txt").write_text(f"[{group}]\n{name} = {module}:{member}\n")


def contract(folder: Path, suite: str, name: str) -> subprocess.CompletedProcess[str]:
    """Run the tests of a contract that are about ``name``, with what is installed in ``folder``."""
    path = os.pathsep.join([str(folder), str(ROOT), os.environ.get("PYTHONPATH", "")])
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "--no-cov", "-x", "-p", "no:cacheprovider", "-k", name,
         f"tests/contract/{suite}.py"],
        cwd=ROOT, env={**os.environ, "PYTHONPATH": path}, capture_output=True, text=True, timeout=100, check=False)


def passed(ended: subprocess.CompletedProcess[str]) -> int:
    """Return how many tests passed."""
    return int(ended.stdout.split(" passed")[0].split()[-1]) if " passed" in ended.stdout else 0
