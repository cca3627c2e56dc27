"""What memory and time do `rig export` and `rig import` take for a recording of N samples, and does the same come back?

    python -m tests.benchmarks.conversion 1e6 1e8
    python -m tests.benchmarks.conversion 1e8 npz wav        # some kinds of files only

Every export is imported again and compared with the recording byte for byte; TDMS, WAV and HDF5 files are written by
the libraries of others and compared number for number. Every command runs in a process of its own.
"""

import filecmp
import os
import sys
import tempfile
import wave
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
from nptdms import ChannelObject, TdmsWriter
from numpy.typing import NDArray

from identify.trace import Stored, blocks
from rig.recorded import Entry, Equipment, Origin, Recording
from rig.recording import write
from tests.benchmarks.large_recording import Taken, taken

RATE_HZ = 50_000
FULL_SCALE = 1 << 23
OURS = ("npz", "mat", "csv")


@dataclass(frozen=True)
class Drawn(Stored):
    """A signal of numbers with all their digits, the same whenever it is read; V."""

    step: float

    def read(self, start: int, stop: int) -> NDArray[np.float64]:
        return 3.0 * np.sin(self.step * np.arange(start, stop))


def signals(samples: int) -> tuple[Drawn, Drawn]:
    return Drawn(samples, 1e-3), Drawn(samples, 0.7)


def record(path: Path, samples: int) -> None:
    """Write a recording with some lost samples."""
    ledger = np.full(samples, Entry.RECORDED, np.uint8)
    ledger[samples // 3 : samples // 3 + 5] = Entry.LOST
    u, y = signals(samples)
    origin = Origin(Equipment("drawn:"), started="2026-11-22", finished="2026-11-22")
    write(path, Recording("long", float(RATE_HZ), u, y, ledger, origin))


def there_and_back(folder: Path, samples: int, kind: str) -> Iterator[tuple[str, Taken, int]]:
    """Yield the export and the import of one kind, with the size of the file."""
    run, out, back = folder / "run.h5", folder / f"out.{kind}", folder / "back.h5"
    if not run.exists():
        record(run, samples)
    yield f"export {kind}", taken("export", run, "--to", kind, "--out", out), out.stat().st_size
    yield f"import {kind}", taken("import", out, "--out", back, "--overwrite"), out.stat().st_size
    if not filecmp.cmp(run, back, shallow=False):
        raise AssertionError(f"{kind}: not what it was")
    out.unlink()
    back.unlink()


def put_hdf5(path: Path, samples: int) -> None:
    with h5py.File(path, "w") as file:
        for name, signal in zip("uy", signals(samples), strict=True):
            dataset = file.create_dataset(name, (samples,), "f8", chunks=True, compression="gzip", compression_opts=1)
            for a, b in blocks(0, samples):
                dataset[a:b] = signal[a:b]


def put_tdms(path: Path, samples: int) -> None:
    properties = {"wf_increment": 1.0 / RATE_HZ}
    with TdmsWriter(path) as writer:
        for a, b in blocks(0, samples):
            writer.write_segment([ChannelObject("daq", name, signal[a:b], properties)
                                  for name, signal in zip("uy", signals(samples), strict=True)])


def put_wav(path: Path, samples: int) -> None:
    """Write 24 bits a sample; full scale is FULL_SCALE counts, and stands for as many V."""
    with wave.open(str(path), "wb") as file:
        file.setnchannels(2)
        file.setsampwidth(3)
        file.setframerate(RATE_HZ)
        for a, b in blocks(0, samples):
            both = np.stack([counts(signal[a:b]) for signal in signals(samples)], axis=1).astype("<i4")
            file.writeframes(both.view(np.uint8).reshape(-1, 4)[:, :3].tobytes())


def counts(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.rint(1e6 * values)


FOREIGN: dict[str, tuple[Callable[[Path, int], None], list[str], Callable[..., NDArray[np.float64]]]] = {
    "h5": (put_hdf5, ["--input", "u", "--output", "y", "--rate", str(RATE_HZ)], np.asarray),
    "tdms": (put_tdms, ["--input", "daq/u", "--output", "daq/y"], np.asarray),
    "wav": (put_wav, ["--input", "1", "--output", "2", "--full-scale", f"{FULL_SCALE} V"], counts),
}


def brought_in(folder: Path, samples: int, kind: str) -> Iterator[tuple[str, Taken, int]]:
    """Yield the import of a file of others."""
    put, options, expected = FOREIGN[kind]
    source, out = folder / f"in.{kind}", folder / "out.h5"
    put(source, samples)
    yield f"import {kind}", taken("import", source, *options, "--out", out, "--overwrite"), source.stat().st_size
    with h5py.File(out, "r") as file:
        for name, signal in zip("uy", signals(samples), strict=True):
            for a, b in blocks(0, samples):
                if not np.array_equal(file[name][a:b], expected(signal[a:b])):
                    raise AssertionError(f"{kind}: {name} is not what was written")
    source.unlink()
    out.unlink()


def main(arguments: list[str]) -> None:
    kinds = [word for word in arguments if word in (*OURS, *FOREIGN)] or [*OURS, *FOREIGN]
    print(f"{'samples':>10} {'command':<12} {'time s':>8} {'CPU s':>8} {'peak MB':>8} {'file MB':>8}")
    for samples in (int(float(word)) for word in arguments if word[0].isdigit()):
        with tempfile.TemporaryDirectory(dir=os.environ.get("LARGE_RECORDING_FOLDER")) as name:
            for kind in kinds:
                trial = there_and_back if kind in OURS else brought_in
                for command, took, size in trial(Path(name), samples, kind):
                    print(f"{samples:10d} {command:<12} {took.seconds:8.1f} {took.cpu_seconds:8.1f} "
                          f"{took.peak_bytes / 1e6:8.0f} {size / 1e6:8.0f}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
