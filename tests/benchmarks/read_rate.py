"""How fast does a recording become arrays, beside a bare h5py read of the same bytes?

    python -m tests.benchmarks.read_rate 1e7 9         # samples, rounds

`rig.recording.read` compares the checksum of every byte and that every sample is a number before it hands anything out;
a recording longer than a million samples stays in its file, and is asked for all of its signals here. Bare h5py
reads the same datasets and looks at nothing. Then the parts: the checksum of all bytes alone, and `rig verify`, which
computes the SHA-256 of every dataset besides. The file is in the system's memory: no disk is
measured. The clock is the processor's, as other programs may be at work.
"""

import sys
import tempfile
import time
from pathlib import Path

import h5py
import numpy as np

from identify.trace import Step
from rig.recorded import Equipment, Origin, Recording, complete_ledger
from rig.recording import read, write
from rig.seal import Seal, inspect
from rig.verifying import verify
from tests.benchmarks.timing import Timed, ratio_of_rounds, side_by_side

DATASETS = ("u", "y", "ledger")


def make(path: Path, samples: int) -> Path:
    """Write a recording of noise."""
    u, y = np.random.default_rng(0).standard_normal((2, samples))
    origin = Origin(Equipment("x"), started="2026-01-01T00:00:00+00:00", finished="2026-01-02T00:00:00+00:00")
    write(path, Recording("r", 1e4, u, y, complete_ledger(samples), origin, steps=(Step("all", "sine", 0, samples),)))
    return path


def read_all(path: Path) -> tuple[np.ndarray, ...]:
    """Return the signals and the ledger, through the product."""
    found = read(path)
    return found.u[:], found.y[:], found.ledger


def read_bare(path: Path) -> tuple[np.ndarray, ...]:
    """Return the same by h5py alone."""
    with h5py.File(path, "r") as file:
        return tuple(file[name][:] for name in DATASETS)


def read_everything(path: Path) -> dict[str, object]:
    """Return all that the file holds, texts, tables and attributes as well, by h5py alone."""
    with h5py.File(path, "r") as file:
        held: dict[str, object] = {"/": dict(file.attrs)}
        file.visititems(lambda name, item: held.update({name: (item[()] if isinstance(item, h5py.Dataset) else None,
                                                               dict(item.attrs))}))
        return held


def measured(path: Path, rounds: int) -> list[Timed]:
    """Return how long each way of reading took."""
    for one, other in zip(read_all(path), read_bare(path), strict=True):
        assert np.array_equal(one, other)
    assert inspect(path) is Seal.INTACT
    works = [("bare h5py, signals alone", lambda: read_bare(path)), ("rig.recording.read", lambda: read_all(path)),
             ("bare h5py, all that is in the file", lambda: read_everything(path)),
             ("checksum of all bytes", lambda: inspect(path)), ("rig verify", lambda: verify(path))]
    return side_by_side(works, rounds, clock=time.process_time)


def table(timed: list[Timed], size: int) -> str:
    """Return rates, and their ratios to that of bare h5py reading the signals."""
    lines = [f"{size / 1e6:.0f} MB", "", "| | GB/s (best) | over bare h5py's (median of rounds) |", "|---|---|---|"]
    lines += [f"| {one.name} | {size / one.least / 1e9:.2f} | {ratio_of_rounds(timed[0], one):.2f} |" for one in timed]
    return "\n".join(lines)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        made = make(Path(folder) / "r.h5", int(float(sys.argv[1])) if len(sys.argv) > 1 else 10_000_000)
        print(table(measured(made, int(sys.argv[2]) if len(sys.argv) > 2 else 9), made.stat().st_size))
