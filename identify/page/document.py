"""What is a page: words and pictures in one order, as HTML that needs no other file, or on paper?"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, Any, final

from identify.page.drawing import Panel, embedded

if TYPE_CHECKING:
    from jinja2 import Environment


@dataclass(frozen=True)
class Imprint:
    """What stands on a page beside the answer: the model as the text of a rig file, and what made the page.

    ``incomplete`` are the recordings of which a part is missing, or still to come, and why.
    """

    model_text: str = ""
    versions: Mapping[str, str] = field(default_factory=dict)
    incomplete: Sequence[tuple[str, str]] = ()


NOTHING = Imprint()

@final
@dataclass(frozen=True)
class Page:
    """A template with what fills it; its pictures are drawn when it is asked for."""

    template: str
    imprint: Imprint
    content: Mapping[str, Any]

    def html(self) -> str:
        """Return the page as HTML with its pictures inside."""
        return self.html_with(embedded)

    def pdf(self) -> bytes:
        """Return the page as a PDF, A4 upright: the same words and pictures in the same order."""
        from identify.page.paper import printed

        panels: list[Panel] = []

        def numbered(panel: Panel) -> str:
            panels.append(panel)
            return str(len(panels) - 1)

        return printed(self.html_with(numbered), panels, self.content["title"])

    def html_with(self, embed: Callable[[Panel], str]) -> str:
        """Return the page's HTML, every panel under the address that ``embed`` gives it."""
        template = _templates().get_template(self.template)
        beside = {"model_text": self.imprint.model_text, "versions": self.imprint.versions,
                  "incomplete": self.imprint.incomplete, "embed": embed}  # fmt: skip
        return template.render(self.content, **beside)


def begun(sentence: str) -> str:
    """Return a sentence with a capital letter, as it stands alone."""
    return sentence[:1].upper() + sentence[1:]


@cache
def _templates() -> "Environment":
    from jinja2 import Environment, PackageLoader, StrictUndefined

    loader = PackageLoader("identify.page")
    return Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True)
