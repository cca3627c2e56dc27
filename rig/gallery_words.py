"""How is the gallery of protocols told on a terminal?"""

from collections.abc import Iterator

from rig.gallery import Piece
from rig.narration import span
from rig.tabular import Line, Table

HEADINGS = ("protocol", "time", "the question it answers")


def listed(found: tuple[Piece, ...]) -> Iterator[Line]:
    """Tell every protocol in a line."""
    yield Table(HEADINGS, tuple((piece.name, span(piece.time_s), piece.question) for piece in found))
    yield "play one:  rig run protocols/NAME.yaml        show one:  rig protocols NAME"
    yield "copy one:  rig protocols NAME --out F.yaml    write your own:  rig new F.yaml"
