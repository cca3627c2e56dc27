"""What is a SPICE netlist made of, which part has which value, and is it one that a stranger may have written?

A netlist describes a circuit and nothing else: no analysis, no commands, no files. ngspice would run commands it finds
there, so every line is known to be a part, a model, a value or a starting condition, or the netlist is refused.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from rig.errors import FileError, UsageError, unknown

NODES = {"R": 2, "C": 2, "L": 2, "V": 2, "I": 2, "D": 2, "E": 4, "G": 4, "Q": 3, "J": 3, "M": 4, "K": 2, "B": 2, "A": 2}
"""How many nodes a part of each letter has; those of an X are all but its last word."""
PARTS = [letter for letter in (*NODES, "X") if letter != "A"]
"""What a file may hold: an A may read and write files."""
DIRECTIVES = {".model", ".subckt", ".ends", ".param", ".func", ".ic", ".nodeset", ".end"}
NUMERIC = "RCL"
VALUE = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?(t|g|meg|k|mil|m|u|µ|n|p|f)?[a-zΩ]*", re.IGNORECASE)
FILED = re.compile(r"\b(file|pwlfile|pwl_file|wavefile)\s*=", re.IGNORECASE)


@dataclass(frozen=True)
class Netlist:
    """The lines of a circuit, each whole and without comments."""

    title: str
    lines: tuple[str, ...]

    @cached_property
    def top(self) -> dict[str, int]:
        """Return where in ``lines`` each part of the circuit itself stands, by its designator in capitals."""
        found, depth = {}, 0
        for at, line in enumerate(self.lines):
            word = line.split()[0]
            depth += {".subckt": 1, ".ends": -1}.get(word.lower(), 0)
            if depth == 0 and not word.startswith("."):
                found[word.upper()] = at
        return found

    @cached_property
    def nodes(self) -> frozenset[str]:
        """Return the nodes of the circuit itself, in small letters."""
        parts = (self.lines[at].split() for at in self.top.values())
        return frozenset(node.lower() for words in parts for node in words[1:1 + _node_count(words)])

    @cached_property
    def models(self) -> frozenset[str]:
        """Return the models and subcircuits there are, in capitals."""
        heads = (line.split()[:2] for line in self.lines)
        return frozenset(words[1].upper() for words in heads if words[0].lower() in (".model", ".subckt"))

    def with_parts(self, parts: Mapping[str, str], stock: frozenset[str] = frozenset()) -> "Netlist":
        """Return the circuit with other values, or other models, of the parts named; raise UsageError.

        ``stock`` are the models there are beside those of the netlist.
        """
        lines = list(self.lines)
        for name, value in parts.items():
            if name.upper() not in self.top:
                raise UsageError(**unknown("part", name, list(self.top)), where=self.title)
            at = self.top[name.upper()]
            lines[at] = self._replaced(lines[at].split(), value, stock | self.models)
        return Netlist(self.title, tuple(lines))

    def _replaced(self, words: list[str], value: str, known: frozenset[str]) -> str:
        """Return the line of one part with another value or model."""
        letter = words[0][0].upper()
        if letter in NUMERIC + "VI":
            if not VALUE.fullmatch(value):
                raise UsageError("not the value of a part", where=words[0], value=repr(value),
                                 allowed="a number as SPICE writes it, such as 10k, 4.7u, 1meg")
        elif value.upper() not in known:
            raise UsageError(**unknown("model", value, sorted(known)), where=words[0])
        return " ".join([*words[:1 + _node_count(words)], value])


def parse_netlist(text: str, where: str) -> Netlist:
    """Return the netlist in ``text``, whose first line is its title; raise FileError for what is no mere circuit."""
    title, *rest = text.splitlines() or [""]
    lines: dict[int, str] = {}
    for number, raw in enumerate(rest, start=2):
        line = _uncommented(raw)
        if line.lower() == ".end":
            break
        if line.startswith("+") and lines:
            lines[max(lines)] += f" {line[1:].strip()}"
        elif line:
            lines[number] = line
    for number, line in lines.items():
        _check(line, f"{where}, line {number}")
    return Netlist(title.lstrip("* ").strip() or where, tuple(lines.values()))


def _uncommented(line: str) -> str:
    """Return a line without what follows ``;`` or a lone ``$``, empty where all of it is a comment."""
    if line.lstrip().startswith("*"):
        return ""
    return re.split(r";|\s\$\s", line)[0].strip()


def _check(line: str, where: str) -> None:
    """Raise FileError for a line that is neither a part nor one of the directives that only describe."""
    word = line.split(maxsplit=1)[0]
    if word.startswith("."):
        if word.lower() not in DIRECTIVES:
            raise FileError("a netlist gives no commands", where=where, value=word,
                            allowed=", ".join(sorted(DIRECTIVES)),
                            do="leave it out: the driver says what is analysed, and nothing else may be run")
    elif word[0].upper() not in PARTS:
        raise FileError("not a part", where=where, value=word, allowed=f"a part named {', '.join(PARTS)}...")
    elif word[0].upper() != "X" and len(line.split()) < 2 + NODES[word[0].upper()]:
        raise FileError("a part with too few words", where=where, value=line, allowed="name, nodes, value")
    if FILED.search(line):
        raise FileError("a netlist names no files", where=where, value=line)


def _node_count(words: list[str]) -> int:
    """Return how many nodes the part in ``words`` has."""
    letter = words[0][0].upper()
    if letter != "X":
        return NODES[letter]
    values = [at for at, word in enumerate(words) if "=" in word or word.lower() == "params:"]
    return (values[0] if values else len(words)) - 2
