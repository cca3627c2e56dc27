"""May the HDF5 library be let loose on a file for whose bytes no checksum vouches?

Damage to the structure of such a file can crash the library, or send it round in circles for ever. So another process,
short of time and memory, reads all of it first: whatever becomes of that process, this one can say so.
"""

import os
import resource
import signal
import subprocess
import sys
from pathlib import Path

import h5py

from identify.trace import blocks
from rig.contained import ElsewhereError, check_contained

PATIENCE_S, BYTES_PER_S = 3.0, 50e6
"""Processor time that reading may take, and for how many bytes more."""
ASLEEP_S = 600.0
"""How long it may take by the clock, on a machine that does other things."""
MEMORY_BYTES = 3 << 30
"""Of addresses, of which the libraries themselves take the most."""
REFUSED = 1
UNREADABLE = (OSError, RuntimeError, KeyError, ValueError, TypeError, AttributeError, IndexError, MemoryError,
              OverflowError, NotImplementedError)


def check_readable(path: Path, *, contained: bool = True) -> None:
    """Raise ValueError where reading all of the HDF5 file at ``path`` fails, saying how.

    ``contained`` also asks that it shows nothing but what it holds, as a recording does.
    """
    patience_s = PATIENCE_S + path.stat().st_size / BYTES_PER_S
    line = [sys.executable, "-P", "-m", __name__, str(path.absolute()), str(int(contained)), str(round(patience_s))]
    try:
        done = subprocess.run(line, capture_output=True, text=True, errors="replace", check=False,
                              timeout=ASLEEP_S + patience_s, env=_environment())
    except subprocess.TimeoutExpired as error:
        raise ValueError(f"it could not be read in {error.timeout:.0f} s") from error
    if done.returncode == REFUSED:
        raise ValueError(done.stdout.strip() or "the HDF5 library cannot read it")
    if done.returncode:
        raise ValueError(_ENDLESS if -done.returncode == signal.SIGXCPU else "the HDF5 library dies of it")


_ENDLESS = "the HDF5 library does not come to an end with it"


def _environment() -> dict[str, str]:
    """Return the environment in which the other process finds this package, its libraries with one thread."""
    home = str(Path(__file__).parents[1])
    path = os.pathsep.join(filter(None, (home, os.environ.get("PYTHONPATH"))))
    return {**os.environ, "PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1"}


def main(path: str, contained: str, seconds: str) -> int:
    """Read all of a file; tell on stdout, in one line, what is wrong with it."""
    resource.setrlimit(resource.RLIMIT_CPU, (int(seconds), int(seconds) + 1))
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    try:
        with h5py.File(path, "r") as file:
            if int(contained):
                check_contained(file)
            _read_all(file)
    except UNREADABLE as error:
        sys.stdout.write(_reason(error))
        return REFUSED
    return 0


def _read_all(file: h5py.File) -> None:
    """Read every attribute and, by stretches, all values that the library has to put together."""
    found: list[h5py.HLObject] = [file]
    file.visititems(lambda name, item: found.append(item))
    for item in found:
        for name in item.attrs:
            item.attrs[name]
        if isinstance(item, h5py.Dataset) and item.shape and item.id.get_offset() is None:
            for start, stop in blocks(0, item.shape[0]):
                item[start:stop]


def _reason(error: BaseException) -> str:
    said = error.args[0] if isinstance(error, ElsewhereError) and error.args else error
    return (str(said) or type(error).__name__).splitlines()[0]


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
