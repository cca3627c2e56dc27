"""Which share of a mismatch would a correction of free form at each stage explain, before anything is named?"""

from dataclasses import dataclass

from identify.explain.bench import Bench
from identify.explain.hypothesis import Hypothesis
from identify.interval import number
from identify.stage import Place


@dataclass(frozen=True)
class StageShare:
    """The best correction at a stage, to first order: its coordinate, what it is, and the share it would explain.

    ``p_value`` is that of so large a share from noise alone, all corrections of all stages together.
    """

    stage: str
    axis: str
    kind: str
    share: float
    p_value: float

    def to_dict(self) -> dict[str, object]:
        """Return plain values, for JSON."""
        return {
            "stage": self.stage, "axis": self.axis, "correction": self.kind, "share": number(self.share, 3),
            "p_value": number(self.p_value, 3),
        }  # fmt: skip


def surveyed(bench: Bench, plain: Hypothesis) -> tuple[StageShare, ...]:
    """Return what each stage could explain of the plain model's misfit, in the order of the signal."""
    ranked = bench.suspects(plain)
    beyond = max(plain.chi2 - plain.count, plain.noise_known * plain.count)
    found = {}
    for s in ranked:
        place, tried = s.correction.place, len(ranked)
        if place not in found:
            share, p_value = min(max(s.gain / beyond, 0.0), 1.0), min(tried * s.p_value, 1.0)
            found[place] = StageShare(place.label, s.correction.axis, s.correction.kind, share, p_value)
    return tuple(found[place] for place in Place if place in found)
