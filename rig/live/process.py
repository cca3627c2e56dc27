"""How does the page live beside a run: in a process of its own, that neither disturbs the run nor ends with it?

    python -m rig.live.process        (an Order as JSON on stdin; the page's URL, or why there is none, on stdout)

It only reads the recording. It yields the processor to whoever needs it (``nice``), ends by itself once the run has
ended and nobody looked for a while, and at once when the program that asked for it ends without having recorded.
"""

import json
import logging
import os
import select
import sys
import time
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import final

from tornado.ioloop import IOLoop, PeriodicCallback

from rig.errors import FileError, RigError
from rig.live.following import Following, follow
from rig.live.launching import Order
from rig.live.page import PERIOD_MS, Page
from rig.live.serving import LOOPBACK, serve
from rig.retry import MOST, path_of
from rig.writing import being_written

BUDGET_S = 0.05  # of every period, for what was recorded: the rest is for the browsers
BEAT_S = 1.0  # of a page of which nothing changes any more
NICE = 10


@final
class Live:
    """A page, its server, and the recording that it shows or waits for."""

    def __init__(self, order: Order, following: Following | None = None, address: str = LOOPBACK, port: int = 0,
                 ) -> None:
        """Begin to listen; raise UsageError where that cannot be. Without a recording the order's is waited for."""
        self._order, self._page, self._segment = order, Page(), 0
        self._alone = following is not None
        self._opener = ThreadPoolExecutor(1)
        self._opened: Future[Following] | None = None
        self._last_looked_s = self._last_drawn_s = time.monotonic()
        if following is not None:
            self._page.begin(following)
        self.server, self.url = serve(self._page, address, port)

    def run(self) -> None:
        """Serve until there is nothing to serve any more, or KeyboardInterrupt."""
        turns = PeriodicCallback(self._turn, PERIOD_MS)
        turns.start()
        try:
            IOLoop.current().start()
        finally:
            turns.stop()
            self.close()

    def close(self) -> None:
        """Listen no more."""
        self.server.stop()
        self._opener.shutdown()

    def _turn(self) -> None:
        """Look at the recording, ten times a second."""
        if self._page.watch is None:
            begins = self._begin(Path(self._order.path), self._order.before) or self._opened is not None
            if not begins and _left_alone():
                IOLoop.current().stop()
            return
        if self._moves() or time.monotonic() - self._last_drawn_s > BEAT_S:
            self._page.catch_up(BUDGET_S)
            self._last_drawn_s = time.monotonic()
        self._go_on()
        self._end()

    def _moves(self) -> bool:
        watch = self._page.watch
        return watch is not None and (watch.stands.going_on or watch.behind > 0)

    def _begin(self, path: Path, before: tuple[int, int] | None = None) -> bool:
        """Show the recording at ``path`` once there is one that is not ``before``; return whether it is shown now.

        A long one is looked at for a while before it is trusted, by another thread: the page answers meanwhile.
        """
        if self._opened is None and _is_another(path, before):
            self._opened = self._opener.submit(follow, path)
        if self._opened is None or not self._opened.done():
            return False
        opened, self._opened = self._opened, None
        if isinstance(opened.exception(), (OSError, FileError)):
            return False  # replaced at this moment: looked for again
        self._page.begin(opened.result())
        return True

    def _go_on(self) -> None:
        """Show the retry of a run that lost samples, when one is recorded."""
        if self._alone or self._moves() or self._segment == MOST:
            return
        path = path_of(Path(self._order.path), self._segment + 1)
        if being_written(path) and self._begin(path):
            self._segment += 1

    def _end(self) -> None:
        """Stop serving once the run has ended and nobody looked for long; one who asked for a page alone ends it."""
        now_s = time.monotonic()
        if self._page.looking or self._moves():
            self._last_looked_s = now_s
        if not self._alone and now_s - self._last_looked_s > self._order.idle_s:
            IOLoop.current().stop()


def _is_another(path: Path, before: tuple[int, int] | None) -> bool:
    """Return whether there is a file that is not the one told by device and inode."""
    try:
        there = path.stat()
    except OSError:
        return False
    return before is None or [there.st_dev, there.st_ino] != list(before)


def quieten() -> None:
    """Keep what libraries log of their work off the terminal."""
    for name in ("bokeh", "tornado"):
        logging.getLogger(name).setLevel(logging.CRITICAL)


def _left_alone() -> bool:
    """Return whether the program that asked for the page has closed its end."""
    return bool(select.select([sys.stdin], [], [], 0.0)[0]) and not os.read(sys.stdin.fileno(), 1)


def main() -> int:
    """Be the page of a run; return its exit code."""
    quieten()
    order = Order(**json.loads(os.read(sys.stdin.fileno(), 1 << 16)))
    try:
        live = Live(order)
    except RigError as error:
        _say({"error": str(error)})
        return error.exit_code
    _say({"url": live.url})
    os.nice(NICE)  # from here on: before, somebody waits for it
    live.run()
    return 0


def _say(told: dict[str, str]) -> None:
    """Tell the program that asked, and let go of its pipe."""
    sys.stdout.write(json.dumps(told) + "\n")
    sys.stdout.flush()
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


if __name__ == "__main__":
    sys.exit(main())
