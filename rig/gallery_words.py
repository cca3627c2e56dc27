"""How is the gallery of protocols told on a terminal?"""

from collections.abc import Iterator

from rig.gallery import Piece
from rig.narration import span
from rig.tabular import Table

HEADINGS = ("protocol", "the question it answers", "time", "rig")


def listed(found: tuple[Piece, ...]) -> Iterator[Table | str]:
    """Tell every protocol in a line."""
    yield Table(HEADINGS, tuple((piece.path, piece.question, span(piece.time_s), piece.rig) for piece in found))
    yield "show one: `rig protocols NAME`; copy it: `rig protocols NAME --out mine.yaml`; write your own: `rig new`"
