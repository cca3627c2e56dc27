"""Is what a command prints what a page shows of it?"""

import re
from itertools import pairwise

from tests.flow.console import Ended

NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?")
SAME = 0.01
"""Relative: another processor rounds otherwise, and an interval's last digit moves; a worse fit moves far more."""
OMITTED = "  ..."


def agree(told: str, shown: str) -> bool:
    """Return whether two lines have the same words, and numbers that are the same but for rounding."""
    if NUMBER.sub("#", told) != NUMBER.sub("#", shown):
        return False
    pairs = zip(map(float, NUMBER.findall(told)), map(float, NUMBER.findall(shown)), strict=True)
    return all(abs(a - b) <= SAME * max(abs(a), abs(b)) for a, b in pairs)


def check_printed(ended: Ended, shown: list[str], line: str) -> None:
    """Assert that what was printed is what is shown, lines left out where the page says so."""
    assert ended.code == 0, ended
    rest = ended.out.splitlines()
    for before, expected in pairwise(["", *shown]):
        if expected == OMITTED:
            continue
        skipped = before == OMITTED
        while skipped and rest and not agree(rest[0], expected):
            rest.pop(0)
        assert rest, (line, expected)
        assert agree(rest.pop(0), expected), (line, expected)
    assert not rest or shown[-1] == OMITTED, (line, rest)
