"""Can Ctrl-C be pressed while compiled code runs? Not where that returns an array: numba crashes wrapping it."""

import ast
import signal
import subprocess
import sys

import pytest

from tests.architecture.house import modules

PRESSED = """
import signal
import numpy as np
from identify import kernels

y, use, gains = np.zeros(100_000), np.ones(100_000, dtype=bool), np.zeros(5000)
kernels.best_cuts(y[:9], y[:9], use[:9], gains)
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGALRM, lambda *_: signal.raise_signal(signal.SIGINT))
signal.setitimer(signal.ITIMER_REAL, 0.05)
try:
    kernels.best_cuts(y, y, use, gains)
    print("came too late")
except KeyboardInterrupt:
    print("interrupted")
"""
KERNELS = [
    (module.name, function)
    for module in modules().values()
    for function in ast.walk(module.tree)
    if isinstance(function, ast.FunctionDef) and any("njit" in ast.unparse(d) for d in function.decorator_list)
]


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="needs signal.setitimer, which this system lacks")
def test_ctrl_c_in_a_compiled_loop_interrupts_once_it_is_through():
    done = subprocess.run([sys.executable, "-c", PRESSED], capture_output=True, text=True, timeout=120, check=False)
    assert (done.returncode, done.stdout) == (0, "interrupted\n"), done.stderr


@pytest.mark.parametrize(("module", "kernel"), KERNELS, ids=[f"{name}.{k.name}" for name, k in KERNELS])
def test_a_compiled_function_returns_no_array_of_its_own(module, kernel):
    made = {
        target.id
        for step in ast.walk(kernel)
        if isinstance(step, ast.Assign)
        for targets, value in _pairs(step)
        if isinstance(value, ast.Call) and ast.unparse(value.func).startswith("np.")
        for target in targets
        if isinstance(target, ast.Name)
    }
    returned = {
        name.id
        for step in ast.walk(kernel)
        if isinstance(step, ast.Return) and step.value is not None
        for name in ([step.value] if isinstance(step.value, ast.Name) else getattr(step.value, "elts", []))
        if isinstance(name, ast.Name)
    }
    assert not made & returned, f"{module}.{kernel.name} returns {made & returned}: have it write into what it is given"


def _pairs(step: ast.Assign) -> list[tuple[list[ast.expr], ast.expr]]:
    """Return what is assigned to what, tuples taken apart."""
    target, value = step.targets[0], step.value
    if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
        return [([t], v) for t, v in zip(target.elts, value.elts, strict=True)]
    return [(step.targets, value)]
