"""How does a typed line end: with which exit code, and with which one message?

Exit codes: 0 done, 1 the answer is negative, 2 bad usage or input, 3 device failure, 4 run incomplete; 70 a fault in
the program itself, 130 stopped by Ctrl-C while nothing was being played.
"""

import sys

import click

from rig.commands import commands


def main() -> None:
    """Run the command line and exit with its code."""
    sys.exit(run_line(sys.argv[1:]))


def run_line(arguments: list[str]) -> int:
    """Run one command line and return its exit code; errors are told on stderr, in one message each."""
    from rig import terminal
    from rig.errors import RigError

    debug = "--debug" in arguments
    terminal.set_up_log(debug)
    try:
        return int(commands.main(arguments, prog_name="rig", standalone_mode=False) or 0)
    except RigError as error:
        return terminal.failed(error, debug)
    except click.ClickException as error:
        error.show()
        return error.exit_code
    except (click.Abort, KeyboardInterrupt):
        click.echo("rig: stopped", err=True)
        return terminal.INTERRUPTED
    except BrokenPipeError:
        sys.stderr.close()
        return 0
    except Exception as error:
        return terminal.broken(error, debug)


if __name__ == "__main__":
    main()
