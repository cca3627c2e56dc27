"""Is nothing that stands in a file ever run: no pickle, no YAML objects, no text as code?"""

import ast
from collections.abc import Iterator

import pytest

from tests.architecture.house import modules

RUNS_WHAT_IT_READS = {"pickle", "cPickle", "shelve", "marshal", "dill", "cloudpickle", "joblib", "jsonpickle"}
TEXT_AS_CODE = {"eval", "exec", "compile", "__import__"}
OBJECTS_FROM_YAML = {"load", "load_all", "full_load", "unsafe_load", "full_load_all", "unsafe_load_all"}
MAY_PICKLE = {"load", "read_array", "load_npz", "open_memmap"}
"""Of numpy: what takes ``allow_pickle``, or may."""


def calls() -> Iterator[tuple[str, ast.Call]]:
    """Yield every call of the product beside the module it stands in."""
    for name, module in modules().items():
        yield from ((name, node) for node in ast.walk(module.tree) if isinstance(node, ast.Call))


def told(where: str, call: ast.Call) -> str:
    """Return a call as it is written, and where."""
    return f"{where}: {ast.unparse(call)}"


def owner_and_name(call: ast.Call) -> tuple[str, str]:
    """Return ``("np", "load")`` of ``np.load(...)``, an empty owner where there is none."""
    match call.func:
        case ast.Attribute(value=ast.Name(id=owner), attr=name):
            return owner, name
        case ast.Attribute(value=owner, attr=name):
            return ast.unparse(owner), name
        case ast.Name(id=name):
            return "", name
    return "", ast.unparse(call.func)


def test_nothing_is_unpickled() -> None:
    for name, module in modules().items():
        nodes = list(ast.walk(module.tree))
        named = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
        named |= {node.module or "" for node in nodes if isinstance(node, ast.ImportFrom)}
        assert not {each.partition(".")[0] for each in named} & RUNS_WHAT_IT_READS, name


def test_no_text_is_run_and_no_yaml_makes_objects() -> None:
    for where, call in calls():
        owner, called = owner_and_name(call)
        assert owner or called not in TEXT_AS_CODE, told(where, call)
        assert owner != "yaml" or called not in OBJECTS_FROM_YAML, told(where, call)
        assert not any(word.arg == "shell" for word in call.keywords), told(where, call)


def test_numpy_is_told_not_to_unpickle() -> None:
    for where, call in calls():
        owner, called = owner_and_name(call)
        given = {word.arg: ast.unparse(word.value) for word in call.keywords if word.arg == "allow_pickle"}
        assert given.get("allow_pickle", "False") == "False", told(where, call)
        if owner.startswith(("np", "numpy")) and called in MAY_PICKLE:
            assert given.get("allow_pickle") == "False", told(where, call)


def all_of_them() -> None:
    test_nothing_is_unpickled()
    test_no_text_is_run_and_no_yaml_makes_objects()
    test_numpy_is_told_not_to_unpickle()


@pytest.mark.parametrize("wrong", ["import pickle", "from dill import load", "eval(text)", "yaml.load(text)",
                                   "np.load(path)", "run(line, shell=True)"])
def test_these_tests_can_fail(wrong: str, monkeypatch: pytest.MonkeyPatch) -> None:
    some = next(iter(modules().values()))
    monkeypatch.setitem(modules(), some.name, type(some)(some.name, some.path, ast.parse(wrong)))
    with pytest.raises(AssertionError, match=some.name):
        all_of_them()
