"""Do imports run drivers -> rig -> identify and never back, and does starting the command line stay cheap?"""

import ast
import json
import subprocess
import sys
from graphlib import CycleError, TopologicalSorter

import pytest

from tests.architecture.house import Module, imports_of, modules

ALLOWED = {  # package: what it may import of the product
    "identify": {"identify"},
    "rig": {"rig", "identify", "protocols"},
    "drivers": {"drivers", "rig", "identify", "protocols"},
    "protocols": {"protocols"},
}
PLAIN_DATA = {
    "identify.trace", "identify.model", "identify.interval", "identify.natural_units", "identify.notebook.glance",
}  # fmt: skip
SEES_BOTH = {  # who may import more of identify than its plain data, and what
    "rig.workflow": {
        "identify.joint", "identify.explain", "identify.explain.revised", "identify.page.report",
        "identify.page.document", "identify.chain",
        "identify.compared", "identify.effects", "identify.simulate", "identify.uncertainty.band",
        "identify.uncertainty.coefficients",
    },
    "rig.recorded": {"identify.notebook.plots"},
    "rig.simulated": {"identify.notebook.plots", "identify.observe"},
    "rig.design": {
        "identify.planning.candidates", "identify.planning.design", "identify.planning.fig13",
        "identify.planning.sampling",
    },
    "rig.comparing": {"identify.page.comparison_page", "identify.page.document"},
    "rig.summaries": {"identify.observe"},
    "rig.asking": {"identify.planning.advice"},
    "rig.newprotocol": {"identify.planning.sampling"},
    "rig.compared_words": {"identify.compared.sentence"},
    "rig": {"identify.offered"},
    "rig.separating": {"identify.explain.separate", "identify.planning.candidates"},
    "rig.protocolfile": {"identify.planning.candidates"},
    "rig.foresight": {
        "identify.planning.advice", "identify.planning.information", "identify.bent.bend", "identify.effects",
        "identify.coordinate", "identify.observe", "identify.harmonic.sines", "identify.starts.start",
    },
    "rig.rigfile": {"identify.bent.border"},
    "rig.rigphysics": {"identify.effects", "identify.unnamed.stored"},
    "rig.linearblock": {"identify.discretise"},
    "rig.preview": {"identify.page.drawing"},
    "rig.live.plain": {"identify.simulate"},
    "rig.live.watching": {"identify.identification", "identify.staircase"},
    "rig.live.dwells": {"identify.staircase"},
    "rig.calibrating": {"identify.calibration"},
    "rig.narration": {"identify.of_device", "identify.page.report"},
    "drivers.emulators.bench": {"identify.simulate"},
}  # fmt: skip
IMPURE = {"serial", "socket", "pathlib", "time", "datetime", "os", "sys", "click", "rich", "h5py", "yaml", "subprocess"}
IMPURE_CALLS = {"open", "print", "input", "exec", "eval"}
HEAVY = ("numpy", "scipy", "numba", "matplotlib", "h5py", "jinja2", "serial", "pyvisa", "usb")


def product_edges(module: Module, top_only: bool = False) -> set[str]:
    """Return the modules of the product that ``module`` imports."""
    known = set(modules())
    return {i.imported for i in imports_of(module) if i.imported in known and (i.top or not top_only)}


def test_every_module_is_read() -> None:
    assert {"identify.chain", "identify.explain.explain", "rig.cli", "drivers.loopback"} <= set(modules())
    assert "identify.kernels" in product_edges(modules()["identify.chain"])
    assert "identify.page.report" in product_edges(modules()["rig.workflow"])
    assert "identify.page.report" not in product_edges(modules()["rig.workflow"], top_only=True)


@pytest.mark.parametrize("name", modules())
def test_imports_run_from_drivers_to_rig_to_identify(name: str) -> None:
    module = modules()[name]
    assert {edge.partition(".")[0] for edge in product_edges(module)} <= ALLOWED[module.package]


@pytest.mark.parametrize("name", [n for n, m in modules().items() if m.package in ("rig", "drivers")])
def test_identification_is_seen_by_few_outside_it(name: str) -> None:
    seen = {edge for edge in product_edges(modules()[name]) if edge.startswith("identify")} - {"identify"}
    assert seen - PLAIN_DATA <= SEES_BOTH.get(name, set())


def test_the_table_of_who_sees_identification_is_not_stale() -> None:
    assert SEES_BOTH.keys() <= modules().keys()
    for name, allowed in SEES_BOTH.items():
        assert allowed <= product_edges(modules()[name])


def test_no_module_imports_itself_by_way_of_others() -> None:
    graph = {name: product_edges(module, top_only=True) - {name} for name, module in modules().items()}
    graph = {name: {e for e in edges if not is_parent(e, name)} for name, edges in graph.items()}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))


def is_parent(package: str, name: str) -> bool:
    """Return whether ``package`` is a package ``name`` lies in, whose front door names its modules."""
    return name.startswith(package + ".")


@pytest.mark.parametrize("name", [n for n, m in modules().items() if m.package == "identify"])
def test_identification_has_no_ports_files_clocks_or_printing(name: str) -> None:
    module = modules()[name]
    assert not {i.imported.partition(".")[0] for i in imports_of(module)} & IMPURE
    calls = {n.func.id for n in ast.walk(module.tree) if isinstance(n, ast.Call) and isinstance(n.func, ast.Name)}
    assert not calls & IMPURE_CALLS


@pytest.mark.parametrize("name", modules())
def test_relative_imports_and_stars_are_not_used(name: str) -> None:
    for node in ast.walk(modules()[name].tree):
        if isinstance(node, ast.ImportFrom):
            assert node.level == 0
            assert all(alias.name != "*" for alias in node.names)


def loaded_by(statement: str) -> list[str]:
    """Return the top packages a fresh interpreter has loaded after ``statement``."""
    code = f"import json, sys; {statement}; print(json.dumps(sorted({{n.partition('.')[0] for n in sys.modules}})))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return list(json.loads(done.stdout))


def test_starting_the_command_line_loads_nothing_heavy() -> None:
    assert not set(loaded_by("import rig.cli")) & set(HEAVY)


def test_what_is_heavy_would_be_seen() -> None:
    assert set(loaded_by("import identify.chain")) >= {"numpy", "scipy", "numba"}


def test_identification_can_be_used_without_rig_and_drivers() -> None:
    loaded = loaded_by("import identify.explain, identify.simulate, identify.page.report")
    assert not set(loaded) & {"rig", "drivers", "protocols", "serial", "h5py", "click", "rich", "pydantic"}
