"""What do the product's files import, and how long are they? Read from their syntax trees, nothing is executed."""

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = ("identify", "rig", "drivers", "protocols")


@dataclass(frozen=True)
class Module:
    """One file of the product under its dotted name."""

    name: str
    path: Path
    tree: ast.Module

    @property
    def package(self) -> str:
        return self.name.partition(".")[0]

    @property
    def lines(self) -> int:
        return len(self.path.read_text(encoding="utf-8").splitlines())


@dataclass(frozen=True)
class Import:
    """One module that another imports; ``top`` when that happens as soon as the importer is imported."""

    importer: str
    imported: str
    top: bool


@cache
def modules() -> dict[str, Module]:
    """Return every module of the product by name."""
    found = {}
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            parts = path.relative_to(ROOT).with_suffix("").parts
            name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
            found[name] = Module(name, path, ast.parse(path.read_text(encoding="utf-8")))
    return found


def imports_of(module: Module) -> Iterator[Import]:
    """Yield what a module imports, except for type checkers only."""
    yield from _imports(module, module.tree, top=True)


def _imports(module: Module, node: ast.AST, top: bool) -> Iterator[Import]:
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test):
            continue
        if isinstance(child, ast.Import):
            yield from (Import(module.name, alias.name, top) for alias in child.names)
        elif isinstance(child, ast.ImportFrom):
            yield from (Import(module.name, name, top) for name in _named(module, child))
        else:
            inside = isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
            yield from _imports(module, child, top and not inside)


def _named(module: Module, node: ast.ImportFrom) -> set[str]:
    """Return the modules a ``from`` statement imports: the submodules named, or the module names come from."""
    source = node.module or ""
    if node.level:
        here = module.name.split(".")
        keep = len(here) - node.level + (module.path.name == "__init__.py")
        source = ".".join(filter(None, (*here[:keep], node.module)))
    names = {f"{source}.{alias.name}" for alias in node.names if alias.name not in bound_in(source)}
    submodules = names & set(modules())
    return submodules | ({source} if len(submodules) < len(node.names) else set())


def bound_in(package: str) -> set[str]:
    """Return the names a package's front door binds itself; they hide submodules of the same name."""
    if package not in modules():
        return set()
    body = modules()[package].tree.body
    return {alias.asname or alias.name for n in body if isinstance(n, ast.ImportFrom) for alias in n.names}


def functions_of(module: Module) -> list[ast.FunctionDef]:
    """Return every function and method."""
    return [node for node in ast.walk(module.tree) if isinstance(node, ast.FunctionDef)]


def length_of(function: ast.FunctionDef) -> int:
    """Return the number of lines from ``def`` to the end, docstring and decorators not counted."""
    body = function.body
    if ast.get_docstring(function) is not None:
        body = body[1:]
    head = function.body[0].lineno - function.lineno
    return head + (body[-1].end_lineno or 0) - body[0].lineno + 1 if body else head
