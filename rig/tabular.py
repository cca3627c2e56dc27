"""How do rows of text stand under each other on a terminal?"""

from collections.abc import Iterator, Sequence


def columns(rows: Sequence[tuple[str, ...]]) -> Iterator[str]:
    """Yield every row as a line, its cells as wide as the widest of their column."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))] if rows else []
    yield from ("  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)).rstrip() for row in rows)
