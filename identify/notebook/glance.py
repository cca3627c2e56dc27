"""What is shown of a recording or an answer before anybody asks for more: a headline and a few lines, text or HTML?"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from html import escape

MOST_ROWS = 24


@dataclass(frozen=True)
class Glance:
    """What a thing is, in one sentence, and what is to be known of it: names and values."""

    what: str
    headline: str
    rows: tuple[tuple[str, str], ...] = ()

    def text(self) -> str:
        """Return the lines a terminal shows; what a file says of itself moves no cursor there."""
        width = max((len(name) for name, _ in self._shown()), default=0)
        rows = [f"  {name:<{width}}  {value}" for name, value in self._shown()]
        return "\n".join(_visible(line) for line in (f"{self.what}: {self.headline}", *rows))

    def html(self) -> str:
        """Return a table a notebook shows; whatever stands in a file is text there."""
        cells = "".join(
            f'<tr><th scope="row" style="text-align:left">{escape(name)}</th>'
            f'<td style="text-align:left">{escape(value)}</td></tr>'
            for name, value in self._shown()
        )
        head = f'<caption style="text-align:left"><b>{escape(self.what)}</b>: {escape(self.headline)}</caption>'
        return f"<table>{head}<tbody>{cells}</tbody></table>"

    def _shown(self) -> tuple[tuple[str, str], ...]:
        """Return the rows there is room for."""
        left_out = len(self.rows) - MOST_ROWS
        return self.rows if left_out <= 0 else (*self.rows[:MOST_ROWS], ("...", f"{left_out} more"))


class Seen(ABC):
    """What tells of itself at a glance; its dataclass leaves ``repr`` to this."""

    @abstractmethod
    def glance(self) -> Glance:
        """Return what is to be known first."""

    def __repr__(self) -> str:
        """Return the glance as lines of text."""
        return self.glance().text()

    def _repr_html_(self) -> str:
        """Return the glance as a table: what a notebook asks for."""
        return self.glance().html()


def _visible(line: str) -> str:
    """Return a line with what is no character to be seen written out."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in line)
