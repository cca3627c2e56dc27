"""How do rows of text stand under each other: as a table on a terminal, as plain lines in a file or a pipe?

Rich draws the table and wraps what is too wide for the terminal. Away from one, every row is one line, whole: it can be
searched, cut and compared. No text is read as markup, whoever wrote it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TextIO

from rig.errors import visible

Row = tuple[str, ...]


@dataclass(frozen=True)
class Table:
    """Rows under their headings, ``indent`` characters from the left."""

    headings: Row
    rows: tuple[Row, ...]
    indent: int = 0

    def lines(self) -> Iterator[str]:
        """Yield the headings and every row as a line."""
        headings = [self.headings] if any(self.headings) else []
        cells = [*headings, *(tuple(visible(text).replace("\n", " ") for text in row) for row in self.rows)]
        yield from (f"{' ' * self.indent}{line}".rstrip() for line in columns(cells))

    def __str__(self) -> str:
        """Return the lines as one text."""
        return "\n".join(self.lines())

    def draw(self, stream: TextIO) -> None:
        """Draw the table on a terminal."""
        from rich import box
        from rich.console import Console
        from rich.padding import Padding
        from rich.table import Table as Drawn
        from rich.text import Text

        drawn = Drawn(box=box.SIMPLE_HEAD, pad_edge=False, header_style="bold", show_header=any(self.headings))
        for at, heading in enumerate(self.headings):
            drawn.add_column(Text(heading), overflow="fold", no_wrap=at == 0)
        for row in self.rows:
            drawn.add_row(*(Text(visible(text)) for text in row))
        Console(file=stream, highlight=False).print(Padding(drawn, (0, 0, 0, self.indent)))


Line = str | Table
"""What a command tells, one after the other."""


def columns(rows: Sequence[Row]) -> Iterator[str]:
    """Yield every row as a line, its cells as wide as the widest of their column."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))] if rows else []
    yield from ("  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)).rstrip() for row in rows)
