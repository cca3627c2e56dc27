"""How are the firmware and the board it runs on built, and what is missing when they cannot be?"""

import functools
import shutil
import subprocess
import tempfile
import threading
from dataclasses import dataclass
from pathlib import Path

import drivers

NEEDED = "apt-get install gcc-avr avr-libc gcc make libsimavr-dev libelf-dev"
HEADERS = Path("/usr/include/simavr")
FILES = {"simavr": HEADERS / "sim_avr.h", "libelf": Path("/usr/include/libelf.h"),
         "avr-libc": Path("/usr/lib/avr/include/avr/io.h")}
FIRMWARE = Path(drivers.__path__[0]) / "firmware"
BOARD = Path(__file__).with_name("board.c")
ONE_AT_A_TIME = threading.Lock()


@dataclass(frozen=True)
class Built:
    """The firmware, and the program that runs it."""

    firmware: Path
    board: Path


def missing() -> str:
    """Return what is to be installed before the firmware can be run here; empty when nothing is."""
    tools = [tool for tool in ("avr-gcc", "gcc", "make") if shutil.which(tool) is None]
    tools += [name for name, path in FILES.items() if not path.is_file()]
    return f"{', '.join(tools)} not found: {NEEDED}" if tools else ""


def built(**settings: str | int) -> Built:
    """Build both, once a process, whichever thread asks; ``settings`` are variables of the Makefile, as ``BAUD``."""
    with ONE_AT_A_TIME:
        return _built(**settings)


@functools.cache
def _built(**settings: str | int) -> Built:
    """Build both."""
    folder = Path(_folder().name) / ("-".join(map(str, settings.values())) or "plain")
    variables = [f"{name}={value}" for name, value in settings.items()]
    _run("make", "-C", str(FIRMWARE), f"BUILD={folder}", "STRICT=1", *variables)
    _run("gcc", "-O2", "-Wall", "-Werror", f"-I{HEADERS}", "-o", str(folder / "board"), str(BOARD), "-lsimavr", "-lelf")
    return Built(folder / "firmware.elf", folder / "board")


@functools.cache
def _folder() -> "tempfile.TemporaryDirectory[str]":
    """Return a folder that goes with the process."""
    return tempfile.TemporaryDirectory(prefix="rig-firmware-")


def _run(*command: str) -> None:
    """Run a program; fail with all it said."""
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{' '.join(command)}:\n{done.stdout}{done.stderr}"
