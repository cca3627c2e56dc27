"""How is a recording written as a NumPy archive, without pickles and without holding it in memory?"""

from collections.abc import Iterator
from pathlib import Path
from typing import IO
from zipfile import ZIP_STORED, ZipFile

import numpy as np
from numpy.typing import NDArray

from identify.trace import Samples, blocks
from rig.exported import note_of, signals_of
from rig.progress import Show, told
from rig.readers.table import NOTE
from rig.recorded import Ledger, Recording


def put(path: Path, recording: Recording, show: Show) -> None:
    """Write the recording, every signal an array of its name; raise OSError."""
    with ZipFile(path, "w", ZIP_STORED, allowZip64=True) as archive:
        for name, held in {**signals_of(recording), "ledger": recording.ledger}.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                _put_signal(file, name, held, show)
        for name, value in _beside(recording):
            with archive.open(f"{name}.npy", "w") as file:
                np.lib.format.write_array(file, value, allow_pickle=False)


def _beside(recording: Recording) -> Iterator[tuple[str, NDArray[np.generic]]]:
    """Yield what is of use without the note, and the note."""
    yield "rate_hz", np.array(recording.rate_hz)
    yield "start_s", np.array(recording.start_s)
    yield NOTE, np.array(note_of(recording))


def _put_signal(file: IO[bytes], name: str, held: Samples | Ledger, show: Show) -> None:
    """Write one array by stretches."""
    kind = np.dtype("u1" if held[:1].dtype == np.uint8 else "<f8")
    head = {"descr": np.lib.format.dtype_to_descr(kind), "fortran_order": False, "shape": (held.size,)}
    np.lib.format.write_array_header_1_0(file, head)
    for start, stop in told(blocks(0, held.size), held.size, name, show):
        file.write(held[start:stop].astype(kind, copy=False).tobytes())
