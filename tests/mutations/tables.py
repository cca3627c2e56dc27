"""Which tables of other programs are damaged, and which are made to harm whoever imports them?"""

import gzip
import io
import struct
import wave
import zipfile
import zlib
from collections.abc import Iterator
from random import Random

import h5py
import numpy as np
import scipy.io

from tests.mutations import damage
from tests.mutations.case import Case

ROWS = 400
LINE = ("--time", "t", "--input", "u", "--output", "y", "--out", "out.h5")
CHANNELS = ("--input", "1", "--output", "2", "--full-scale", "1V", "--out", "out.h5")
COUNT = 10**9


def signals() -> dict[str, np.ndarray[tuple[int], np.dtype[np.float64]]]:
    """Return times, u and y."""
    time_s = np.arange(ROWS) / 1000.0
    return {"t": time_s, "u": np.round(np.sin(20.0 * time_s), 6), "y": np.round(np.cos(20.0 * time_s), 6)}


def intact_tables() -> dict[str, tuple[bytes, tuple[str, ...]]]:
    """Return one table of every kind, and how it is imported."""
    held = signals()
    text = "# a scope\nt,u,y\n" + "".join(f"{t:.3f},{u},{y}\n" for t, u, y in zip(*held.values(), strict=True))
    return {
        "t.csv": (text.encode(), LINE),
        "t.csv.gz": (gzip.compress(text.encode(), mtime=0), LINE),
        "t.tsv": (text.replace(",", "\t").replace(".", ",").encode(), LINE),
        "t.npz": (_npz(held), LINE),
        "t.mat": (_mat5(held), LINE),
        "t.h5": (_hdf5(held), ("--time", "t", *LINE[2:])),
        "t.wav": (_wav(held), CHANNELS),
        "t.tdms": (_tdms(held), ("--time", "g/t", "--input", "g/u", "--output", "g/y", "--out", "out.h5")),
    }


def damaged_tables(chance: Random) -> Iterator[Case]:
    """Yield tables with damage, of one kind after the other, without end."""
    tables = intact_tables()
    while True:
        for name, (held, line) in tables.items():
            harm = chance.choice(damage.OF_TEXT if name in {"t.csv", "t.tsv"} else damage.OF_BYTES)
            yield Case(f"{name}: {harm.__name__}", {name: harm(held, chance)}, ("import", name, *line))


def hostile_tables() -> Iterator[Case]:
    """Yield tables that must be refused."""
    for name, held in {**_texts(), **_packed(), **_arrays(), **_waves(), **_trees()}.items():
        line = CHANNELS if name.endswith(".wav") else LINE
        file = f"t.{name.partition('.')[2]}" if "." in name else "t.csv"
        other = {"other.h5": _hdf5(signals())}
        yield Case(f"table: {name}", {file: held, **other}, ("import", file, *line), hostile=True)


def _texts() -> dict[str, bytes]:
    head = b"t,u,y\n"
    return {
        "nothing.csv": b"",
        "a head alone.csv": head,
        "a NUL.csv": head + b"0,1,2\n\0,1,2\n",
        "no numbers.csv": head + b"a,b,c\n" * 9,
        "one long line.csv": head + b"1" * 20_000_000,
        "wide.csv": b",".join(b"c%d" % k for k in range(300_000)) + b"\n1\n2\n",
        "NaN.csv": head + b"0,nan,1\n0.001,1,1\n",
        "infinity.csv": head + b"0,1e999,1\n0.001,1,1\n",
        "an endless time.csv": head + b"0,1,1\n1e308,1,1\n",
        "still.csv": head + b"0,1,1\n0,1,1\n0,1,1\n",
        "back.csv": head + b"2,1,1\n1,1,1\n0,1,1\n",
        "arabic.csv": head + "\u0660,1,1\n\u0661,1,1\n".encode(),
        "a formula.csv": head + b"0,=cmd|' /C calc'!A0,1\n1,1,1\n",
        "quotes.csv": head + b'0,"1,1\n1,1,1\n',
        "uneven.csv": head + b"0,1\n1,1,1\n",
        "two of a name.csv": b"t,u,u,y\n0,1,1,1\n1,1,1,1\n",
        "one row.csv": head + b"0,1,1\n",
        "UTF-32.csv": "t,u,y\n0,1,1\n1,1,1\n".encode("utf-32"),
        "a unit.csv": b"t [V],u,y\n0,1,1\n1,1,1\n",
        "many units.csv": b"t,u [" + b"/".join([b"V"] * 5000) + b"],y\n0,1,1\n1,1,1\n",
    }


def _packed() -> dict[str, bytes]:
    bomb = gzip.compress(b"t,u,y\n", mtime=0) + 200 * gzip.compress(b"0,0,0\n" * 500_000, mtime=0)
    return {
        "a gzip bomb.csv.gz": bomb,
        "a gzip in a gzip.csv.gz": gzip.compress(bomb, mtime=0),
        "half a gzip.csv.gz": bomb[:5000],
        "a gzip of nothing.csv.gz": gzip.compress(b"", mtime=0),
        "a gzip of bytes.csv.gz": gzip.compress(bytes(range(256)), mtime=0),
    }


def _packed_zeros(head: bytes, megabytes: int) -> bytes:
    """Return a zip file in which an array of zeros follows ``head``, made of one packed megabyte again and again."""
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    start = packer.compress(head) + packer.flush(zlib.Z_FULL_FLUSH)
    piece = packer.compress(bytes(1 << 20)) + packer.flush(zlib.Z_FULL_FLUSH)
    held = start + megabytes * piece + packer.flush(zlib.Z_FINISH)
    name, size = b"y.npy", len(head) + megabytes * (1 << 20)
    told = struct.pack("<HHHHHIIIHH", 20, 0, 8, 0, 33, 0, len(held), size, len(name), 0)
    local = b"PK\x03\x04" + told + name + held
    listed = b"PK\x01\x02" + struct.pack("<H", 20) + told + struct.pack("<HHHII", 0, 0, 0, 0, 0) + name
    return local + listed + b"PK\x05\x06" + struct.pack("<HHHHIIH", 0, 0, 1, 1, len(listed), len(local), 0)


def _arrays() -> dict[str, bytes]:
    held = signals()
    huge = _header("'<f8'", f"({COUNT * 1000},)")
    return {
        "objects.npz": _npz({**held, "y": np.array([{}] * ROWS, dtype=object)}),
        "a bomb.npz": _packed_zeros(_header("'<f8'", f"({1 << 28},)"), 2048),
        "a huge shape.npz": _zipped({"t.npy": huge, "u.npy": huge, "y.npy": huge}),
        "no shape.npz": _zipped({"y.npy": _header("'<f8'", "None")}),
        "a shape below 0.npz": _zipped({"y.npy": _header("'<f8'", "(-5,)")}),
        "code for a shape.npz": _zipped({"y.npy": _header("'<f8'", "(__import__('os').system('touch pwned'),)")}),
        "brackets.npz": _zipped({"y.npy": _header("'<f8'", "(" * 9000)}),
        "a type of types.npz": _zipped({"y.npy": _header("[('a', '<f8'), ('a', '<f8')]", "(5,)")}),
        "an escape.npz": _zipped({"../../escaped.npy": _npy(held["y"]), "/etc/x.npy": _npy(held["u"])}),
        "no arrays.npz": _zipped({}),
        "text.npz": _zipped({"readme.txt": b"hello"}),
        "complex.npz": _npz({**held, "y": held["y"] + 1j}),
        "empty.npz": _npz({**held, "y": np.empty(0)}),
        "cells.mat": _mat5({**held, "y": np.array([held["y"], held["u"][:5]], dtype=object)}),
        "sparse.mat": _mat5({**held, "y": scipy.sparse.eye(ROWS).tocsc()}),
        "text.mat": _mat5({**held, "y": np.array(["x"] * ROWS)}),
        "a head.mat": _mat5(held)[:128],
        "a huge matrix.mat": _huge_mat(),
    }


def _waves() -> dict[str, bytes]:
    good = _wav(signals())
    return {
        "a head.wav": good[:12],
        "no channels.wav": good[:22] + struct.pack("<H", 0) + good[24:],
        "no rate.wav": good[:24] + bytes(8) + good[32:],
        "no bits.wav": good[:34] + bytes(2) + good[36:],
        "65535 channels.wav": good[:22] + b"\xff\xff" + good[24:],
        "seven bits.wav": good[:34] + struct.pack("<H", 7) + good[36:],
        "a huge chunk.wav": good[:16] + b"\xff\xff\xff\x7f" + good[20:],
        "a codec.wav": good[:20] + struct.pack("<H", 85) + good[22:],
    }


def _trees() -> dict[str, bytes]:
    size = (ROWS,)
    return {
        "y elsewhere.h5": _hdf5(signals(), lambda file: file.__setitem__("y", h5py.ExternalLink("other.h5", "y"))),
        "y raw.h5": _hdf5(
            signals(), lambda file: file.create_dataset("y", size, "f8", external=[("other.h5", 0, 8 * ROWS)])
        ),
        "y virtual.h5": _hdf5(signals(), _virtual),
        "y itself.h5": _hdf5(signals(), lambda file: file.__setitem__("y", h5py.SoftLink("/y"))),
        "y of 8 TB.h5": _hdf5(signals(), lambda file: file.create_dataset("y", (10**12,), "f8", chunks=(1 << 20,))),
        "y a group.h5": _hdf5(signals(), lambda file: file.create_group("y")),
        "only a signature.h5": b"\x89HDF\r\n\x1a\n",
    }


def _virtual(file: h5py.File) -> None:
    layout = h5py.VirtualLayout((ROWS,), "f8")
    layout[:] = h5py.VirtualSource(".", "y", (ROWS,))
    file.create_virtual_dataset("y", layout)


def _npy(values: object) -> bytes:
    made = io.BytesIO()
    np.save(made, values, allow_pickle=True)
    return made.getvalue()


def _header(kind: str, shape: str) -> bytes:
    """Return the head of an array file that says anything."""
    told = f"{{'descr': {kind}, 'fortran_order': False, 'shape': {shape}, }}\n".encode()
    return b"\x93NUMPY\x02\x00" + struct.pack("<I", len(told)) + told


def _zipped(files: dict[str, bytes]) -> bytes:
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, held in files.items():
            archive.writestr(zipfile.ZipInfo(name), held, zipfile.ZIP_DEFLATED)
    return made.getvalue()


def _npz(held: dict[str, object]) -> bytes:
    return _zipped({f"{name}.npy": _npy(values) for name, values in held.items()})


def _mat5(held: dict[str, object]) -> bytes:
    made = io.BytesIO()
    scipy.io.savemat(made, held, do_compression=True)
    return made.getvalue()


def _huge_mat() -> bytes:
    """Return a MAT file with a matrix of 8 GB of which nothing follows."""
    made = io.BytesIO()
    scipy.io.savemat(made, {"y": np.arange(6.0)})
    return made.getvalue().replace(struct.pack("<ii", 1, 6), struct.pack("<ii", 1, COUNT))


def _hdf5(held: dict[str, object], change: object = None) -> bytes:
    made = io.BytesIO()
    with h5py.File(made, "w") as file:
        for name, values in held.items():
            if name != "y" or change is None:
                file[name] = values
        if callable(change):
            change(file)
    return made.getvalue()


def _wav(held: dict[str, np.ndarray[tuple[int], np.dtype[np.float64]]]) -> bytes:
    made = io.BytesIO()
    with wave.open(made, "wb") as file:
        file.setparams((2, 2, 1000, 0, "NONE", ""))
        file.writeframes(np.column_stack([held["u"], held["y"]]).__mul__(30_000).astype("<i2").tobytes())
    return made.getvalue()


def _tdms(held: dict[str, np.ndarray[tuple[int], np.dtype[np.float64]]]) -> bytes:
    from nptdms import ChannelObject, TdmsWriter

    made = io.BytesIO()
    with TdmsWriter(made) as file:
        file.write_segment([ChannelObject("g", name, values) for name, values in held.items()])
    return made.getvalue()
