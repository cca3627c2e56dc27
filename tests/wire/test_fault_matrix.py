"""Does every fault of a link end in a correct recording or a clear error, the output safe, before a deadline?

A share of the matrix; all of it is ``python -m tests.benchmarks.fault_matrix``.
"""

from dataclasses import replace

import pytest

from drivers.emulators.faults import Fault, What
from tests.benchmarks.fault_matrix import matrix
from tests.wire.matrix.benches import BENCHES
from tests.wire.matrix.case import Case, End, script
from tests.wire.matrix.play import play


@pytest.mark.parametrize("kind", sorted(BENCHES))
def test_a_share_of_the_faults_ends_as_it_must(kind: str) -> None:
    bench = BENCHES[kind]
    share = replace(bench, cases=tuple(case for case in bench.cases if case.in_ci))
    wrong = {case.name: (*verdict.wrong, verdict.ended.reason) for case, verdict in matrix(share) if verdict.wrong}
    assert not wrong


@pytest.mark.parametrize("kind", sorted(BENCHES))
def test_the_matrix_has_the_faults_it_must(kind: str) -> None:
    cases = BENCHES[kind].cases
    assert len({case.name for case in cases}) == len(cases) >= 25
    assert all(case.says for case in cases if case.end is not End.WHOLE), "a failure is told in words"


def test_the_matrix_tells_wrong_samples_from_right_ones() -> None:
    """A device that lies under a good checksum is beyond any driver; whoever judges the drivers must still see it."""
    lie = script(Fault(What.REPLACED, to="INPUT", skip=2, new=b"\x00" * 300))
    verdict = play(BENCHES["serial"], Case("samples that were never read", lie, End.WHOLE))
    assert [word for word in verdict.wrong if word.endswith("wrong samples")]
