"""What stands on a page, in which order: read from its HTML, so that paper says what the screen says.

Only what the templates write is read: headings, paragraphs, lists, tables, and pictures whose address is the number of
a panel.
"""

from dataclasses import dataclass, field
from html.parser import HTMLParser
from typing import Literal, final

Kind = Literal["kicker", "h1", "h2", "h3", "p", "soft", "incomplete", "equation", "li", "pre", "caption"]

BY_TAG: dict[str, Kind] = {
    "h1": "h1", "h2": "h2", "h3": "h3", "p": "p", "li": "li", "pre": "pre", "figcaption": "caption",
}  # fmt: skip
BY_CLASS: dict[str, Kind] = {"kicker": "kicker", "soft": "soft", "incomplete": "incomplete", "equation": "equation"}
MARKS = {"here": "[{}]", "maybe": "({}?)"}  # of stages on the signal path, where no border can be drawn
UNSEEN = frozenset({"style", "title"})


@dataclass(frozen=True)
class Words:
    """A heading or a paragraph."""

    kind: Kind
    text: str


@dataclass(frozen=True)
class Grid:
    """A table: its headings, if any, its rows, and which of them is set in bold."""

    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    strong: int | None = None


@dataclass(frozen=True)
class Panels:
    """The panels of one picture, by number."""

    numbers: tuple[int, ...]


Block = Words | Grid | Panels


def blocks_of(html: str) -> list[Block]:
    """Return what a page shows from its top to its end."""
    reader = _Reader()
    reader.feed(html)
    reader.close()
    return reader.found


@dataclass
class _Table:
    """A table that is being read."""

    headings: list[str] = field(default_factory=list)
    rows: list[list[str]] = field(default_factory=list)
    strong: int | None = None


@final
class _Reader(HTMLParser):
    """Collects blocks while tags open and close."""

    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.found: list[Block] = []
        self._text: list[str] = []
        self._kind: Kind | None = None
        self._table: _Table | None = None
        self._panels: list[int] | None = None
        self._path: list[str] | None = None
        self._item: int | None = None
        self._mark = "{}"
        self._unseen = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Begin what a tag begins."""
        told = {name: value or "" for name, value in attrs}
        self._unseen = self._unseen or tag in UNSEEN
        if tag == "img" and self._panels is not None:
            self._panels.append(int(told["src"]))
        elif tag == "figure":
            self._panels = []
        elif tag == "ol" and told.get("class") == "chain":
            self._path = []
        elif tag in ("ol", "ul"):
            self._item = 0 if tag == "ol" else None
        elif tag == "table":
            self._table = _Table()
        elif self._table is not None:
            self._begin_in_table(self._table, tag, told)
        elif tag in BY_TAG:
            self._kind, self._text = BY_CLASS.get(told.get("class", ""), BY_TAG[tag]), []
            self._mark = MARKS.get(told.get("class", ""), "{}")

    def _begin_in_table(self, table: _Table, tag: str, told: dict[str, str]) -> None:
        if tag == "tr":
            table.strong = len(table.rows) if told.get("class") == "strong" else table.strong
            table.rows.append([])
        elif tag in ("td", "th"):
            self._text = []

    def handle_data(self, data: str) -> None:
        """Keep text that is seen."""
        if not self._unseen:
            self._text.append(data)

    def handle_endtag(self, tag: str) -> None:
        """End what a tag ends."""
        if tag in UNSEEN:
            self._unseen = False
        elif tag == "div" and self._panels:
            self.found.append(Panels(tuple(self._panels)))
            self._panels = None
        elif self._table is not None:
            self._end_in_table(self._table, tag)
        elif tag == "ol" and self._path is not None:
            self.found.append(Words("p", " → ".join(self._path)))
            self._path = None
        elif tag == "b" and self._path is not None:
            self._path.append(self._mark.format(self._taken()))
        elif tag in BY_TAG and self._kind is not None:
            self._end_words(self._kind)

    def _end_words(self, kind: Kind) -> None:
        text = "".join(self._text).strip("\n") if kind == "pre" else self._taken()
        if kind == "li":
            text = f"{self._next()} {text}"
        if text and self._path is None:
            self.found.append(Words(kind, text))
        self._kind = None

    def _next(self) -> str:
        """Return what stands in front of the next item of the list."""
        if self._item is None:
            return "\N{BULLET}"
        self._item += 1
        return f"{self._item}."

    def _end_in_table(self, table: _Table, tag: str) -> None:
        if tag == "th":
            table.headings.append(self._taken())
        elif tag == "td":
            table.rows[-1].append(self._taken())
        elif tag == "thead":
            table.rows.clear()
            table.strong = None
        elif tag == "table":
            self.found.append(Grid(tuple(table.headings), tuple(map(tuple, table.rows)), table.strong))
            self._table = None

    def _taken(self) -> str:
        """Return the text since it was last begun, its white space as single blanks."""
        text = " ".join("".join(self._text).split())
        self._text = []
        return text
