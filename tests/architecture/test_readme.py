"""Do the READMEs say what is true now?"""

import re

from rig.commands import commands
from tests.architecture.effect_table import BEGIN, END, NAMED, summary, table
from tests.architecture.house import ROOT
from tests.proof.in_short import FOREMOST
from tests.proof.tables import BEGIN as PROOF
from tests.proof.tables import END as PROVEN

README, EFFECTS, TRIALS = (
    (ROOT / path).read_text(encoding="utf-8")
    for path in ("README.md", "identify/effects/README.md", "tests/proof/README.md")
)  # fmt: skip
WORDS_IN_FIVE_MINUTES = 1600
"""Of prose and tables; what is typed and what is printed is looked at, not read."""


def between(text: str, begin: str, end: str) -> str:
    return text.partition(begin)[2].partition(end)[0].strip()


def test_the_table_of_effects_is_the_catalogue() -> None:
    assert between(EFFECTS, BEGIN, END) == table()
    assert between(README, *NAMED) == summary()


def test_the_figures_of_the_proof_are_those_of_the_study() -> None:
    told = between(README, PROOF, PROVEN).splitlines()
    assert len([line for line in told if line.startswith("| ")]) == 1 + len(FOREMOST)
    assert set(told) <= set(between(TRIALS, PROOF, PROVEN).splitlines())


def test_every_command_named_exists_and_every_command_is_named() -> None:
    named = set(re.findall(r"^rig (\w+)|`rig (\w+)", README, re.MULTILINE))
    assert {a or b for a, b in named} == set(commands.commands)


def test_the_first_page_is_read_in_five_minutes() -> None:
    prose = re.sub(r"```.*?```", "", README, flags=re.DOTALL)
    assert len(re.findall(r"[A-Za-z0-9][\w.'-]*", prose)) <= WORDS_IN_FIVE_MINUTES


def test_links_between_pages_lead_somewhere() -> None:
    pages = [path for path in ROOT.rglob("README.md") if ".venv" not in path.parts]
    for page in pages:
        for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
            assert target.startswith("http") or (page.parent / target).exists(), (page, target)
