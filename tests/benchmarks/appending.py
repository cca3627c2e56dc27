"""What does it cost to acknowledge a block of samples, beside HDF5's own single writer, multiple readers?

    python -m tests.benchmarks.appending 500           # samples a block

A million samples of four inputs go into a file, block by block. Ours has each block in the file, its entries in the
ledger and its checksums in the journal when the call returns. HDF5's has it in chunked datasets, flushed after every
block, without ledger and checksums; not flushed, a killed process takes what was not with it. The clock is the
processor's.
"""

import sys
import tempfile
import time
from itertools import pairwise
from pathlib import Path

import h5py
import numpy as np

from rig.plan import Limits, Plan
from rig.recorded import Equipment
from rig.recording import Writer
from tests.benchmarks.timing import side_by_side

SIZE, INPUTS = 1_000_000, ("y", "u_measured", "v", "w")
READINGS = np.random.default_rng(0).standard_normal((len(INPUTS), SIZE))


def ours(path: Path, block: int) -> float:
    """Append all blocks; return the processor's time, s, that the appending took."""
    plan = Plan("r", np.zeros(SIZE), 1e4, (), Limits(-1, 1), inputs=INPUTS)
    with Writer(path, plan, Equipment("x"), overwrite=True) as writer:
        begun = time.process_time()
        for start, stop in pairwise([*range(0, SIZE, block), SIZE]):
            writer.append(start, READINGS[0, start:stop], READINGS[1:, start:stop])
        return time.process_time() - begun


def swmr(path: Path, block: int) -> float:
    """Do the same in HDF5's own mode, every block flushed."""
    with h5py.File(path, "w", libver="latest") as file:
        datasets = [file.create_dataset(name, (0,), "f8", maxshape=(None,), chunks=(1 << 13,)) for name in INPUTS]
        file.swmr_mode = True
        begun = time.process_time()
        for start, stop in pairwise([*range(0, SIZE, block), SIZE]):
            for dataset, values in zip(datasets, READINGS, strict=True):
                dataset.resize((stop,))
                dataset[start:stop] = values[start:stop]
                dataset.flush()
        return time.process_time() - begun


if __name__ == "__main__":
    size = int(sys.argv[1]) if len(sys.argv) > 1 else 500
    spent: dict[str, list[float]] = {"ours": [], "SWMR, flushed": []}
    with tempfile.TemporaryDirectory() as folder:
        side_by_side([("ours", lambda: spent["ours"].append(ours(Path(folder) / "o.h5", size))),
                      ("SWMR, flushed", lambda: spent["SWMR, flushed"].append(swmr(Path(folder) / "s.h5", size)))], 5)
    for name, seconds in spent.items():
        least = min(seconds[1:])
        print(f"{name:14} {1e6 * least * size / SIZE:7.1f} us a block of {len(INPUTS)} x {size} samples, "
              f"{READINGS.nbytes / 1e6 / least:6.0f} MB a second of the processor")
