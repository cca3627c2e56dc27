"""Is everything that the program needs in what `pip install .` puts on a machine?"""

import tomllib
from fnmatch import fnmatch

from tests.architecture.house import PACKAGES, ROOT

TOLD = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]


def test_every_package_is_installed() -> None:
    folders = [found.parent for top in PACKAGES for found in (ROOT / top).rglob("__init__.py")]
    there = {".".join(folder.relative_to(ROOT).parts) for folder in folders}
    assert there == set(TOLD["packages"])


def test_every_page_protocol_and_rig_is_installed() -> None:
    for suffix in ("html", "yaml"):
        for path in (file for top in PACKAGES for file in (ROOT / top).rglob(f"*.{suffix}")):
            inside = [path.relative_to(ROOT / name.replace(".", "/")) for name in TOLD["package-data"]
                      if path.is_relative_to(ROOT / name.replace(".", "/"))]
            patterns = [pattern for shown in TOLD["package-data"].values() for pattern in shown]
            assert any(fnmatch(str(name), pattern) for name in inside for pattern in patterns), path
