"""Does the trial bench share no code with the product it puts on trial?"""

import ast
from pathlib import Path

import pytest

import tests.proof

PRODUCT = {"identify", "rig", "drivers", "protocols"}
MEETS_THE_PRODUCT = {"ask.py", "__main__.py", "device.py", "follow_up.py", "recorded.py", "told.py"}
"""They ask it, or answer it; none draws."""
FILES = Path(tests.proof.__file__).parent.glob("**/*.py")
BENCH = sorted(p for p in FILES if not p.name.startswith("test_") and p.name not in MEETS_THE_PRODUCT)


def _imported(source: str) -> set[str]:
    """Return the top packages of every import in ``source``, at any depth, and of importlib's literal arguments."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            found |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found.add("relative import" if node.level else (node.module or "").split(".")[0])
        elif isinstance(node, ast.Call) and "import" in ast.unparse(node.func):
            found |= {str(a.value).split(".")[0] for a in node.args if isinstance(a, ast.Constant)}
    return found


def test_the_bench_is_found():
    assert {"bench.py", "cases.py", "integrator.py", "physics.py", "rigs.py", "stimuli.py", "trial.py"} <= {
        p.name for p in BENCH
    }


@pytest.mark.parametrize("path", BENCH, ids=lambda path: path.name)
def test_bench_imports_nothing_of_the_product(path):
    assert _imported(path.read_text(encoding="utf-8")) <= {
        "collections", "concurrent", "contextlib", "dataclasses", "functools", "hashlib", "itertools", "json", "lzma",
        "math", "numba", "numpy", "pathlib", "scipy", "secrets", "tests", "typing", "zlib",
    }  # fmt: skip


@pytest.mark.parametrize(
    "source",
    ["import identify.fit", "from rig import plan", "def f():\n    import drivers", "import_module('rig.plan')"],
)
def test_an_import_of_the_product_would_be_seen(source):
    assert _imported(source) & PRODUCT
