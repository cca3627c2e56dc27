"""How is a recording written for MATLAB: as version 5, which everything reads, or where it is long as 7.3?

Signals are columns. Version 7.3 is HDF5 with a block of text before it and the class of every variable as an attribute
(``MATLAB_class``; text is 16-bit numbers); arrays stand in it with their dimensions reversed.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identify.trace import Samples, blocks
from rig.exported import note_of, signals_of
from rig.progress import Show, told
from rig.readers.table import NOTE
from rig.recorded import Ledger, Recording

LONGEST_5 = 1 << 24
"""Samples of a signal in version 5, which is held in memory whole; MATLAB takes 2 GB a variable."""
USER_BLOCK = 512
TEXT = b"MATLAB 7.3 MAT-file, written by rig export. Signals in V, one sample at start_s + k / rate_hz."
VERSION = b"\x00\x02IM"  # at byte 124, after 8 bytes that are not used


def put(path: Path, recording: Recording, show: Show) -> None:
    """Write the recording; raise OSError."""
    signals: dict[str, Samples | Ledger] = {**signals_of(recording), "ledger": recording.ledger}
    note = note_of(recording)
    beside: dict[str, float | str] = {"rate_hz": recording.rate_hz, "start_s": recording.start_s, NOTE: note}
    if recording.u.size <= LONGEST_5:
        _put_5(path, signals, beside)
    else:
        _put_73(path, signals, beside, show)


def _put_5(path: Path, signals: Mapping[str, Samples | Ledger], beside: Mapping[str, float | str]) -> None:
    """Write version 5."""
    from scipy.io import savemat

    whole: dict[str, Any] = {name: np.asarray(held[:]).reshape(-1, 1) for name, held in signals.items()}
    savemat(str(path), {**whole, **beside}, format="5", appendmat=False)


def _put_73(
    path: Path, signals: Mapping[str, Samples | Ledger], beside: Mapping[str, float | str], show: Show
) -> None:
    """Write version 7.3, by stretches."""
    import h5py

    with h5py.File(path, "w", userblock_size=USER_BLOCK) as file:
        for name, held in signals.items():
            dataset = file.create_dataset(name, (1, held.size), held[:1].dtype)
            dataset.attrs["MATLAB_class"] = np.bytes_("uint8" if held[:1].dtype == np.uint8 else "double")
            for start, stop in told(blocks(0, held.size), held.size, name, show):
                dataset[0, start:stop] = held[start:stop]
        for name, value in beside.items():
            _put_value(file, name, value)
    with path.open("r+b") as raw:
        raw.write(TEXT.ljust(116) + bytes(8) + VERSION)


def _put_value(file: Any, name: str, value: float | str) -> None:
    """Write a number or a text as MATLAB has them."""
    if isinstance(value, str):
        held: NDArray[Any] = np.frombuffer(value.encode("utf-16-le"), np.uint16).reshape(-1, 1)
        dataset = file.create_dataset(name, data=held)
        dataset.attrs["MATLAB_int_decode"] = np.int32(2)
        dataset.attrs["MATLAB_class"] = np.bytes_("char")
    else:
        file.create_dataset(name, data=np.array([[value]])).attrs["MATLAB_class"] = np.bytes_("double")
