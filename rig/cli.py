"""How does a typed line end: with which exit code, and with which one message?

Exit codes: 0 done, 1 the answer is negative, 2 bad usage or input, 3 device failure, 4 run incomplete; 70 a fault in
the program itself, 130 stopped by Ctrl-C while nothing was being played.
"""

import atexit
import os
import signal
import sys
import warnings
from threading import Event, Timer
from time import monotonic
from types import FrameType
from typing import TYPE_CHECKING, Never

if TYPE_CHECKING:
    from sys import UnraisableHookArgs

STOPPED = 130
ONCE_S = 0.2
"""For so long after Ctrl-C another is the same one: it must not interrupt how the first is told."""
_pressed = Event()


class Stopped(KeyboardInterrupt):
    """Ctrl-C was pressed.

    A class of its own, because CPython ends itself by SIGINT, whatever exit code is asked for, once a plain
    KeyboardInterrupt has passed through code compiled from a string, as that of dataclasses is.
    """


class _Key:
    """What Ctrl-C does: it interrupts what is going on, and again where that was swallowed."""

    def __init__(self) -> None:
        self._last_s = -1.0

    def press(self, number: int, frame: FrameType | None) -> None:
        """Interrupt what is going on."""
        if monotonic() - self._last_s >= ONCE_S:
            self._last_s = monotonic()
            _pressed.set()
            raise Stopped

    def swallowed(self, what: "UnraisableHookArgs") -> None:
        """Press again soon where a callback of a library could not be interrupted; tell what else is lost there."""
        if what.exc_type is None or not issubclass(what.exc_type, Stopped):
            sys.__unraisablehook__(what)
            return
        again = Timer(1.5 * ONCE_S, lambda: os.kill(os.getpid(), signal.SIGINT))
        again.daemon = True
        again.start()


def main() -> None:
    """Run the command line and exit with its code."""
    key = _Key()
    try:
        sys.unraisablehook = key.swallowed
        signal.signal(signal.SIGINT, key.press)
        code = run_line(sys.argv[1:])
    except KeyboardInterrupt:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        sys.stderr.write("rig: stopped\n")
        _leave(STOPPED)
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    sys.exit(code)


def _leave(code: int) -> Never:
    """End here: what a compiler was interrupted in must not be taken apart object by object, which may crash it."""
    atexit._run_exitfuncs()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


def run_line(arguments: list[str]) -> int:
    """Run one command line and return its exit code; errors are told on stderr, in one message each.

    Raises KeyboardInterrupt when it is interrupted. What is imported here may take a moment, and be interrupted too.
    """
    debug = "--debug" in arguments
    with warnings.catch_warnings():
        if not debug:  # what a library warns of is for who repairs the program
            warnings.simplefilter("ignore")
        return _run(arguments, debug)


def _run(arguments: list[str], debug: bool) -> int:
    """Run one command line and return its exit code."""
    import click

    from rig import terminal
    from rig.commands import commands
    from rig.errors import RigError

    terminal.set_up_log(debug)
    try:
        return int(commands.main(arguments, prog_name="rig", standalone_mode=False) or 0)
    except RigError as error:
        return terminal.failed(error, debug)
    except click.ClickException as error:
        error.show()
        return error.exit_code
    except click.Abort as abort:
        raise Stopped from abort
    except BrokenPipeError:
        sys.stderr.close()
        return 0
    except Exception as error:
        if _pressed.is_set():
            raise Stopped from error  # some libraries turn Ctrl-C into an error of their own
        return terminal.broken(error, debug)


if __name__ == "__main__":
    main()
