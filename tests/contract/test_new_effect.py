"""Is a new effect one file and one entry point, put on trial by being installed? The example of the README is."""

from contextlib import nullcontext
from pathlib import Path
from types import ModuleType

import pytest

from tests.contract.test_effects import test_at_its_absent_value_an_effect_is_the_identity as absent_is_identity
from tests.pages import example
from tests.plugged import contract, passed, plug_in

PAGE = "identify/effects/README.md"
FLAW = ("- 0.5 * width", "- 0.5 * (width + 1e-3)")
"""At a width of 0 it is not the identity any more."""


def test_the_example_of_the_readme_passes_the_contract(tmp_path: Path) -> None:
    plug_in(tmp_path, "crossover", example(PAGE, "crossover.py"), "identify.effects", "crossover", "Crossover")
    ended = contract(tmp_path, "test_effects", "crossover")
    assert ended.returncode == 0, ended.stdout
    assert passed(ended) >= 15


def test_an_effect_that_breaks_the_contract_is_found_out() -> None:
    text = example(PAGE, "crossover.py")
    assert text.count(FLAW[0]) == 1
    for source, sound in ((text, True), (text.replace(*FLAW), False)):
        module = ModuleType("crossover")
        exec(source, module.__dict__)
        (effect,) = module.Crossover.variants()
        with nullcontext() if sound else pytest.raises(AssertionError):
            absent_is_identity(effect)
