"""Which channels are in a WAV file, at which rate, and what does full scale stand for?

PCM of 8 to 32 bits and floats, also of more than 4 GB (RF64). Numbers are shares of full scale, which is 1 V unless it
is said otherwise; either way that is told. Layout: Microsoft's and the EBU's (Tech 3306) descriptions of the format.
"""

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from identify.trace import Array, blocks
from rig.errors import FileError
from rig.readers.heading import Heading
from rig.readers.table import Table
from rig.timebase import TimeBase
from rig.units import show

SIGNATURES = (b"RIFF", b"RF64")
PCM, FLOAT, EXTENSIBLE = 1, 3, 0xFFFE
IN_DS64 = 0xFFFFFFFF
MOST_CHANNELS = 1024


@dataclass(frozen=True)
class Format:
    """How samples stand in a file: floats or integers, channels, frames a second, bytes of one sample."""

    floats: bool
    channels: int
    rate_hz: int
    width: int

    @property
    def full_scale(self) -> float:
        """Return the number that stands for full scale."""
        return 1.0 if self.floats else float(1 << (8 * self.width - 1))

    def values(self, data: bytes) -> Array:
        """Return samples as numbers, (frames, channels)."""
        if self.floats:
            read: NDArray[np.float64] = np.frombuffer(data, f"<f{self.width}").astype(np.float64)
        elif self.width == 1:
            read = np.frombuffer(data, np.uint8).astype(np.float64) - 128.0
        else:
            read = self._integers(data)
        return read.reshape(-1, self.channels)

    def _integers(self, data: bytes) -> Array:
        """Return integers of 16, 24 or 32 bits; each is put into the upper bytes of one of 32."""
        padded = np.zeros((len(data) // self.width, 4), np.uint8)
        padded[:, 4 - self.width :] = np.frombuffer(data, np.uint8).reshape(-1, self.width)
        return np.asarray(padded.view("<i4")[:, 0] / float(1 << (8 * (4 - self.width))))


@dataclass(frozen=True, kw_only=True)
class WavTable(Table):
    """A WAV file; ``at`` is where its samples begin, ``rows`` how many frames there are."""

    path: Path
    format: Format
    at: int
    rows: int
    full_scale_v: float

    def pieces(self, at: Sequence[int], first: int, stop: int | None) -> Iterator[Array]:
        """Yield the rows [first, stop) of the channels ``at``, V."""
        wide, end = self.format.channels * self.format.width, self.rows if stop is None else min(stop, self.rows)
        with self.path.open("rb") as file:
            file.seek(self.at + first * wide)
            for a, b in blocks(first, end, 1 << 18):
                data = file.read((b - a) * wide)
                if len(data) < (b - a) * wide:
                    raise EOFError("the file became shorter while it was read")
                yield self.format.values(data)[:, list(at)].T * (self.full_scale_v / self.format.full_scale)

    def place(self, row: int) -> str:
        """Return the file and the row."""
        return f"{self.where}: row {row} (from 0)"

    def cell(self, row: int, at: int) -> str:
        """Return the value as text."""
        return str(next(self.pieces([at], row, row + 1))[0, 0])


def read_wav(path: Path, full_scale_v: float | None = None) -> WavTable:
    """Return the table; raise FileError for a kind of WAV that is not known, or one that was cut off."""
    with path.open("rb") as file:
        found, at, size = _chunks(file, path)
    wide = found.channels * found.width
    scale_v = 1.0 if full_scale_v is None else full_scale_v
    stands = f"full scale, {found.full_scale:g} in the file, is {show(scale_v, 'V')}"
    return WavTable(
        where=str(path), path=path, headings=(Heading(""),) * found.channels, clock=TimeBase(0.0, float(found.rate_hz)),
        remarks=(stands if full_scale_v else f"{stands} as nothing else was said",), format=found, at=at,
        rows=size // wide, full_scale_v=scale_v,
    )  # fmt: skip


def _chunks(file: BinaryIO, path: Path) -> tuple[Format, int, int]:
    """Return the format, where the samples begin, and how many bytes they are; raise FileError."""
    end, position = path.stat().st_size, 12
    long_size, found = 0, None
    while position + 8 <= end:
        file.seek(position)
        name, size = struct.unpack("<4sI", file.read(8))
        if name == b"ds64":
            long_size = struct.unpack("<8xQ", file.read(16))[0]
        elif name == b"fmt ":
            found = _format(file.read(min(size, 40)), path)
        elif name == b"data" and found is not None:
            size = long_size if size == IN_DS64 and long_size else size
            if position + 8 + size > end:
                raise FileError("cut off", where=str(path), value=f"{end - position - 8} bytes of samples",
                                allowed=f"{size} as its head says", do="use a whole copy of it")
            return found, position + 8, size
        position += 8 + size + size % 2
    raise FileError("a WAV file without samples", where=str(path), do="use a whole copy of it")


def _format(data: bytes, path: Path) -> Format:
    """Return the format a chunk describes; raise FileError for one that is not known."""
    kind, channels, rate_hz, _, frame, bits = struct.unpack("<HHIIHH", data[:16])
    if kind == EXTENSIBLE and len(data) >= 26:
        kind = struct.unpack("<H", data[24:26])[0]
    width = bits // 8
    known = (kind == PCM and bits in (8, 16, 24, 32)) or (kind == FLOAT and bits in (32, 64))
    if not known or not 1 <= channels <= MOST_CHANNELS or frame != channels * width or not rate_hz:
        value = f"format {kind}, {bits} bits, {channels} channels at {rate_hz} Hz, {frame} bytes a frame"
        raise FileError("a kind of WAV that is not known", where=str(path), value=value,
                        allowed="PCM of 8, 16, 24 or 32 bits, floats of 32 or 64", do="save it as one of these")
    return Format(kind == FLOAT, channels, rate_hz, width)
