"""Does the README say what is true now?"""

import re
from pathlib import Path

from rig.commands import commands
from tests.architecture.effect_table import BEGIN, END, table

README = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")


def test_the_table_of_effects_is_the_catalogue() -> None:
    assert README.partition(BEGIN)[2].partition(END)[0].strip() == table()


def test_every_command_named_exists_and_every_command_is_named() -> None:
    named = set(re.findall(r"^rig (\w+)|`rig (\w+)", README, re.MULTILINE))
    assert {a or b for a, b in named} == set(commands.commands)
