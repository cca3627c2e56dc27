"""Who may see the page, from where, and what can be asked of its server?

It listens on the loopback address unless another one is named. All it serves lies below a path that is a secret of this
one page, which only its URL tells: without it nothing is found. What the page shows and runs comes from this server
alone, and the browser is told so.
"""

import secrets
from collections.abc import Callable
from http import HTTPStatus
from typing import Any, Protocol, final

from bokeh.application import Application
from bokeh.application.handlers.function import FunctionHandler
from bokeh.document import Document
from bokeh.server.server import BaseServer
from bokeh.server.tornado import BokehTornado
from tornado.httpserver import HTTPServer
from tornado.httputil import HTTPHeaders, HTTPServerRequest
from tornado.ioloop import IOLoop
from tornado.netutil import bind_sockets
from tornado.web import OutputTransform, RequestHandler

from rig.errors import UsageError

LOOPBACK = "127.0.0.1"
EVERY = ("", "0.0.0.0", "::")
SECRET_BYTES = 24
FORGOTTEN_MS = 5_000
"""How long a page that was closed is kept: its memory is then free."""
HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self' 'unsafe-inline' 'unsafe-eval'; "
                               "style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; font-src 'self' data:; "
                               "connect-src 'self'; form-action 'self'; base-uri 'none'; frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer", "X-Content-Type-Options": "nosniff", "Cache-Control": "no-store",
}  # fmt: skip
Answer = tuple[HTTPStatus, str]


@final
class Guarded(OutputTransform):
    """Every answer forbids the browser what no page of this server needs."""

    def __init__(self, request: HTTPServerRequest) -> None:
        """Take part in the answer to a request."""

    def transform_first_chunk(self, status_code: int, headers: HTTPHeaders, chunk: bytes, finishing: bool,
                              ) -> tuple[int, HTTPHeaders, bytes]:
        """Add the headers."""
        for name, value in HEADERS.items():
            headers[name] = value
        return status_code, headers, chunk


@final
class Abort(RequestHandler):
    """The abort button: a plain form, which works also where the page's script does not."""

    def initialize(self, ask: Callable[[], Answer], origins: set[str]) -> None:
        """Take what a press of the button does, and the hosts a page of which may press it."""
        self._ask, self._origins = ask, origins

    def post(self) -> None:
        """Ask the run to stop, and say what came of it."""
        origin = self.request.headers.get("Origin", "")
        if origin and origin.partition("://")[2] not in self._origins:
            self.set_status(HTTPStatus.FORBIDDEN)
            return
        status, words = self._ask()
        self.set_status(status)
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.write(words)


@final
class State(RequestHandler):
    """What the page says, as JSON, for programs: no picture is drawn for it."""

    def initialize(self, told: Callable[[], dict[str, Any]]) -> None:
        """Take what says it."""
        self._told = told

    def get(self) -> None:
        """Say it."""
        self.write(self._told())


class Shown(Protocol):
    """What is served: a page for browsers, what it says, and its abort button."""

    def document(self, document: Document) -> None:
        """Make the page that a browser asks for."""

    def state(self) -> dict[str, Any]:
        """Return what the page says now."""

    def abort(self) -> Answer:
        """Do what a press of the button does."""


def serve(shown: Shown, address: str = LOOPBACK, port: int = 0) -> tuple[BaseServer, str]:
    """Return a server of a page, listening, and the page's URL; raise UsageError where it cannot listen."""
    if address in EVERY:
        raise UsageError("a page is not served on every address of the machine", value=address,
                         do="name one, that of the network from which it is to be seen")
    try:
        sockets = bind_sockets(port, address)
    except OSError as error:
        raise UsageError("the page cannot be served there", value=f"{address}, port {port}: {error.strerror}",
                         allowed="an address of this machine and a free port", do="leave --address and --port out",
                         ) from error
    host = f"[{address}]" if ":" in address else address
    bound = sockets[0].getsockname()[1]
    origins = {f"{host}:{bound}"} | ({f"localhost:{bound}"} if address == LOOPBACK else set())
    secret = secrets.token_urlsafe(SECRET_BYTES)
    served = BokehTornado(
        {"/": Application(FunctionHandler(shown.document))}, prefix=secret, use_index=False, ico_path="none",
        extra_websocket_origins=sorted(origins),
        extra_patterns=[("/abort", Abort, {"ask": shown.abort, "origins": origins}),
                        ("/state", State, {"told": shown.state})],
        unused_session_lifetime_milliseconds=FORGOTTEN_MS, check_unused_sessions_milliseconds=FORGOTTEN_MS,
        transforms=[Guarded],
    )  # fmt: skip
    http = HTTPServer(served)
    http.add_sockets(sockets)
    server = BaseServer(IOLoop.current(), served, http)
    server.start()
    return server, f"http://{host}:{bound}/{secret}/"
