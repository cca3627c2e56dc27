"""Does a netlist take other parts, and is one refused that could do more than be a circuit?"""

import pytest

from drivers.netlist import parse_netlist
from drivers.spice import DEFAULT, shipped, stock
from rig.errors import FileError, UsageError

FILTER = """* a filter
R1 u y 20k ; the resistor
* R2 u y 1k
C1 y 0
+ 1u
X1 y 0 out MYAMP
.subckt MYAMP a b c
R1 a c 1k
.ends
.end
Rlate u y 1
"""


def test_lines_are_whole_without_comments_and_end_at_the_end() -> None:
    circuit = parse_netlist(FILTER, "filter.cir")
    assert circuit.title == "a filter"
    assert circuit.lines[:2] == ("R1 u y 20k", "C1 y 0 1u")
    assert set(circuit.top) == {"R1", "C1", "X1"}
    assert circuit.nodes == {"u", "y", "0", "out"}


def test_a_part_takes_another_value_or_model_by_its_name_in_either_case() -> None:
    changed = parse_netlist(FILTER, "filter.cir").with_parts({"c1": "4.7n", "X1": "LM358"}, stock().models)
    assert changed.lines[:3] == ("R1 u y 20k", "C1 y 0 4.7n", "X1 y 0 out LM358")
    assert "R1 a c 1k" in changed.lines, "the R1 of a subcircuit is another part"


@pytest.mark.parametrize(("parts", "message"), [
    ({"R9": "1k"}, "unknown part 'R9'.*allowed: C1, R1, X1.*did you mean 'R1'"),
    ({"R1": "1k; .control"}, "R1: not the value of a part"),
    ({"R1": "k"}, "not the value of a part"),
    ({"X1": "LM385"}, "X1: unknown model 'LM385'.*did you mean 'LM358'"),
])
def test_what_is_no_part_or_no_value_is_refused(parts: dict[str, str], message: str) -> None:
    with pytest.raises(UsageError, match=message):
        parse_netlist(FILTER, "filter.cir").with_parts(parts, stock().models)


@pytest.mark.parametrize("line", [
    ".control", ".include /etc/passwd", ".lib x", ".csparam a=1", ".exec rm", ".tran 1u 1", ".save all", "*+ R1 a b",
    "A1 %v([u]) fs", "V1 u 0 PWL file=secret.txt", "shell rm -rf .", "R1 u", "V1 u 0 PWL\n+ file=x",
])
def test_what_could_run_or_read_anything_is_refused_or_ignored(line: str) -> None:
    text = f"title\nR1 u y 1k\n{line}\n"
    if line.startswith("*"):
        assert parse_netlist(text, "x.cir").lines == ("R1 u y 1k",)
        return
    with pytest.raises(FileError, match=r"x\.cir, line 3"):
        parse_netlist(text, "x.cir")


def test_a_comment_that_ngspice_would_run_does_not_reach_it() -> None:
    assert parse_netlist("*ng_script\n*# shell rm\nR1 u y 1k\n", "x.cir").lines == ("R1 u y 1k",)


def test_the_netlists_that_come_with_the_program_are_circuits() -> None:
    circuit = parse_netlist(shipped(DEFAULT), DEFAULT)
    assert {"u", "v", "w", "y"} <= circuit.nodes
    parts = {line.split()[-1].upper() for at, line in enumerate(circuit.lines) if line.startswith(("X", "D"))}
    assert parts <= stock().models
    assert {"TL081", "LM358", "UA741"} <= stock().models
