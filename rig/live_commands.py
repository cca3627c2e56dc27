"""What can be typed about watching: live.

Only click is imported here, as in ``rig.commands``.
"""

from collections.abc import Iterator
from contextlib import contextmanager, suppress

import click

from rig.typed import command, say


@command("live", "rig live run.h5", "rig live run.h5 --address 192.168.1.20 --port 8080")
@click.argument("run_file", metavar="RUN.h5")
@click.option("--address", metavar="IP", default="127.0.0.1", show_default=True, help="Of this machine, to listen on.")
@click.option("--port", type=click.IntRange(0, 65535), default=0, help="Else one that is free.")
def live(run_file: str, address: str, port: int) -> None:
    """Watch a run in a browser.

    Shows the recording in RUN.h5 while it grows, or as it is: u and y, the loop, settled dwells, what the plain model
    leaves. The page only reads; its abort button ramps the output down and ends the run, as Ctrl-C there does. Ctrl-C
    here ends the page alone. Only who has its URL sees it; it listens on this machine unless --address names another.
    """
    from pathlib import Path

    from rig.live.launching import Order, check_installed

    check_installed()
    from rig.live.following import follow
    from rig.live.process import Live, quieten

    quieten()
    page = Live(Order(run_file), follow(Path(run_file)), address, port)
    say([f"live page: {page.url}", "  Ctrl-C ends the page, and only the page"])
    with suppress(KeyboardInterrupt):
        page.run()


@contextmanager
def shown(out: str, live: bool) -> Iterator[None]:
    """Have a page show what is recorded at ``out`` while inside, and for as long as somebody looks."""
    if not live:
        yield
        return
    from pathlib import Path

    from rig.live.launching import beside

    with beside(Path(out)) as url:
        click.echo(f"live page: {url}", err=True)
        yield
