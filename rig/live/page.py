"""What does one browser that looks at a run get, ten times a second, and no faster than it can draw?"""

import json
from http import HTTPStatus
from pathlib import Path
from typing import Any, final

import jinja2
from bokeh.document import Document
from bokeh.events import DocumentReady
from bokeh.models import ColumnDataSource, CustomJS

from rig.live.columns import Columns, columns
from rig.live.facts import facts
from rig.live.figures import figures
from rig.live.following import Following
from rig.live.serving import Answer
from rig.live.watching import Watch
from rig.stopping import ring

PERIOD_MS = 80
"""Of looks at the recording: ten a second are held where one now and then comes late."""
NEWS_MS = 10
"""After which it is seen that there was a look: a browser does not wait for the next one."""
AHEAD = 3
"""Pictures that may be under way to a browser: one that draws slower gets fewer, and the server keeps none for it."""
SHOW = "window.rigShow(JSON.parse(cb_obj.data.told[0])); drawn.data = {tick: cb_obj.data.tick};"
READY = "drawn.data = {tick: told.data.tick};"
WHO = "the abort button of the live page"
_templates = jinja2.Environment(loader=jinja2.FileSystemLoader(Path(__file__).parent / "templates"), autoescape=True)


@final
class Page:
    """The page of one run, for as many browsers as look at it."""

    def __init__(self) -> None:
        """Begin with no run."""
        self.watch: Watch | None = None
        self.looking = 0
        self._tick = 0
        self._columns: dict[str, Columns] = {}
        self._told: dict[str, Any] = {}

    def begin(self, following: Following) -> None:
        """Show a run from now on."""
        watch = Watch(following)
        watch.catch_up(0.0)
        self._look(watch)
        self.watch = watch

    def catch_up(self, for_s: float) -> None:
        """Look at what was recorded meanwhile, for about so long."""
        if self.watch is not None:
            self.watch.catch_up(for_s)
            self._look(self.watch)

    def document(self, document: Document) -> None:
        """Make the page that a browser asks for."""
        document.title = "live: no run yet" if self.watch is None else f"live: {self._told['title']}"
        if self.watch is None:
            document.template = _templates.get_template("waiting.html")
            return
        document.template = _templates.get_template("page.html")
        document.template_variables["told"] = self._told
        shown = figures(self.watch, self._columns)
        told, drawn = _answered(document, self._told)
        for picture in shown.pictures.values():
            picture.tags = [told, drawn]
            document.add_root(picture)
        sent = 0

        def push() -> None:
            nonlocal sent
            if self.watch is None or sent == self._tick or told.data["tick"][0] - drawn.data["tick"][0] >= AHEAD:
                return
            sent = self._tick
            document.hold("combine")
            number = told.data["tick"][0] + 1
            shown.show(self.watch, self._columns, number)
            told.data = {"told": [json.dumps(self._told)], "tick": [number]}
            document.unhold()

        document.add_periodic_callback(push, NEWS_MS)
        document.on_session_destroyed(self._left)
        self.looking += 1

    def state(self) -> dict[str, Any]:
        """Return what the page says now; nothing before a run has begun."""
        return self._told

    def abort(self) -> Answer:
        """Ask the run to ramp its output down and end, as Ctrl-C does."""
        if self.watch is None:
            return HTTPStatus.CONFLICT, "No run has begun yet: press Ctrl-C where it was started."
        if not self.watch.stands.going_on:
            return HTTPStatus.CONFLICT, "The run has ended already."
        if ring(self.watch.following.file, WHO):
            return HTTPStatus.ACCEPTED, "Asked: the run ramps its output down and ends."
        return HTTPStatus.SERVICE_UNAVAILABLE, "The run cannot be reached: press Ctrl-C where it was started."

    def _left(self, session: object) -> None:
        self.looking -= 1

    def _look(self, watch: Watch) -> None:
        """Draw what is known now, once for all browsers."""
        self._tick += 1
        self._columns, self._told = columns(watch), facts(watch)


def _answered(document: Document, told_now: dict[str, Any]) -> tuple[ColumnDataSource, ColumnDataSource]:
    """Return what is told to a browser, and the number of the picture it says it has drawn last."""
    told = ColumnDataSource(name="told", data={"told": [json.dumps(told_now)], "tick": [0]})
    drawn = ColumnDataSource(name="drawn", data={"tick": [-AHEAD]})  # nothing is sent before the browser is ready
    told.js_on_change("data", CustomJS(args={"drawn": drawn}, code=SHOW))
    document.js_on_event(DocumentReady, CustomJS(args={"told": told, "drawn": drawn}, code=READY))
    return told, drawn
