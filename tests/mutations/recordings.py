"""Which recordings are damaged, and which are made to harm whoever opens them?

Of the second kind every checksum is made anew, or taken away as by a tool that rewrites HDF5: nothing but looking can
tell. ``without_seal`` is what such a tool leaves.
"""

import io
import zlib
from collections.abc import Callable, Iterator
from itertools import islice
from random import Random
from typing import Any

import h5py
import numpy as np

from tests.mutations import damage
from tests.mutations.case import SECRET, Case
from tests.mutations.originals import PROTOCOL, RIG, TABLE, Originals

SIMULATE = ("simulate", "run.h5")
LINES = (
    SIMULATE,
    ("export", "run.h5", "--to", "npz", "--out", "out.npz"),
    ("export", "run.h5", "--to", "csv", "--out", "out.csv"),
    ("verify", "run.h5"),
    ("check", "p.yaml", "--device", "replay:run.h5"),
)
HUGE = 10**12
Change = Callable[[h5py.File], None]


def without_seal(held: bytes) -> bytes:
    """Return a recording as a tool that rewrites HDF5 leaves it: no user block, the same datasets and attributes."""
    return changed(held, lambda file: None)


def changed(held: bytes, change: Change) -> bytes:
    """Return a recording that was rewritten with a change in it; its checksums are those of what it holds now."""
    made = io.BytesIO()
    with h5py.File(io.BytesIO(held)) as source, h5py.File(made, "w") as file:
        for name in source:
            source.copy(name, file)
        file.attrs.update(source.attrs)
        change(file)
        _checksums(file, source)
    return made.getvalue()


def _checksums(file: h5py.File, source: h5py.File) -> None:
    """Make every checksum anew that can be made; what is shown from elsewhere has that of the same values here."""
    from rig.recordingfile import CHECKSUM, attributes_digest, digest

    for name in file:
        try:
            if not isinstance(file[name], h5py.Dataset):
                continue
            if file[name].is_virtual or file[name].external:
                file[name].attrs[CHECKSUM] = source[name].attrs[CHECKSUM]
            elif file[name].nbytes < 10**8:
                file[name].attrs[CHECKSUM] = digest(file[name])
        except (KeyError, OSError, TypeError, ValueError, AttributeError, RuntimeError):
            continue
    try:
        file.attrs[CHECKSUM] = attributes_digest(file)
    except (KeyError, OSError, TypeError, ValueError, AttributeError, RuntimeError):
        file.attrs[CHECKSUM] = "0" * 64


def _put(name: str, make: Callable[[h5py.File], Any]) -> Change:
    """Return a change that has something else stand under ``name``."""

    def change(file: h5py.File) -> None:
        old, values = dict(file[name].attrs) if name in file else {}, make(file)
        if name in file:
            del file[name]
        if values is not None:
            file[name] = values
        if not isinstance(values, h5py.ExternalLink | h5py.SoftLink | type(None)):
            file[name].attrs.update(old)

    return change


def _declared(name: str, shape: Any, dtype: Any = np.float64, **how: Any) -> Change:
    """Return a change that has a dataset of another shape under ``name``, nothing written into it."""

    def change(file: h5py.File) -> None:
        if name in file:
            del file[name]
        file.create_dataset(name, shape, dtype, **how)

    return change


def _all_declared(shape: tuple[int, ...], **how: Any) -> Change:
    """Return a change that has u, y and the ledger in another size, nothing written into them."""

    def change(file: h5py.File) -> None:
        for name, kind in (("u", np.float64), ("y", np.float64), ("ledger", np.uint8)):
            _declared(name, shape, kind, **how)(file)

    return change


def _filled(name: str, pieces: int) -> Change:
    """Return a change that has zeros under ``name``: one packed piece of 8 MB, so many times."""
    piece = zlib.compress(bytes(8 << 20))

    def change(file: h5py.File) -> None:
        del file[name]
        made = file.create_dataset(name, (pieces << 20,), np.float64, chunks=(1 << 20,), compression="gzip")
        for number in range(pieces):
            made.id.write_direct_chunk((number << 20,), piece)

    return change


def _virtual(file: h5py.File) -> None:
    size = file["y"].shape[0]
    layout = h5py.VirtualLayout((size,), np.float64)
    layout[:] = h5py.VirtualSource("other.h5", "y", (size,))
    del file["y"]
    file.create_virtual_dataset("y", layout)


def _virtual_of_itself(file: h5py.File) -> None:
    size = file["y"].shape[0]
    layout = h5py.VirtualLayout((size,), np.float64)
    layout[:] = h5py.VirtualSource(".", "y", (size,))
    del file["y"]
    file.create_virtual_dataset("y", layout)


def _raw(path: str) -> Change:
    def change(file: h5py.File) -> None:
        size = file["y"].shape[0]
        del file["y"]
        file.create_dataset("y", (size,), np.float64, external=[(path, 0, 8 * size)])

    return change


def _attribute(group: str, name: str, value: Any) -> Change:
    """Return a change of one attribute; None removes it."""

    def change(file: h5py.File) -> None:
        del file[group].attrs[name]
        if value is not None:
            file[group].attrs[name] = value

    return change


def _table(name: str, rows: list[tuple[Any, ...]]) -> Change:
    def change(file: h5py.File) -> None:
        kind = file[name].dtype
        del file[name]
        file[name] = np.array(rows, dtype=kind)

    return change


def _many(file: h5py.File) -> None:
    for number in range(20_000):
        file.create_group(f"g{number}")


def _deep(file: h5py.File) -> None:
    group = file
    for _ in range(2000):
        group = group.create_group("g")


def _through(file: h5py.File) -> h5py.SoftLink:
    file["beyond"] = h5py.ExternalLink("other.h5", "/")
    return h5py.SoftLink("/beyond/y")


LINKS: dict[str, Change] = {
    "y in another file": _put("y", lambda file: h5py.ExternalLink("other.h5", "y")),
    "y in a file above": _put("y", lambda file: h5py.ExternalLink("../outside", "y")),
    "y in its own file from outside": _put("y", lambda file: h5py.ExternalLink("run.h5", "u")),
    "u in another file": _put("u", lambda file: h5py.ExternalLink("other.h5", "u")),
    "the device in another file": _put("device", lambda file: h5py.ExternalLink("other.h5", "device")),
    "a further input in another file": _put("inputs/w", lambda file: h5py.ExternalLink("other.h5", "y")),
    "the rig in another file": _put("rig", lambda file: h5py.ExternalLink("other.h5", "rig")),
    "y nowhere": _put("y", lambda file: h5py.SoftLink("/nowhere")),
    "y itself": _put("y", lambda file: h5py.SoftLink("/y")),
    "y through another file": _put("y", _through),
    "y a group": _put("y", lambda file: file["device"]),
    "y virtual": _virtual,
    "y virtual, of itself": _virtual_of_itself,
    "y raw in another file": _raw("other.h5"),
    "y raw in a file above": _raw("../outside"),
    "y raw in a file of the system": _raw("/etc/hostname"),
    "y raw nowhere": _raw("nowhere"),
    "a reference for y": _put("y", lambda file: np.array([file["u"].ref] * 9, dtype=h5py.ref_dtype)),
}


SIZES: dict[str, Change] = {
    "y of 8 TB": _declared("y", (HUGE,), chunks=(1 << 20,)),
    "y of 8 TB in one piece": _declared("y", (HUGE,)),
    "u of 8 EB": _declared("u", (2**60,), chunks=(1 << 20,)),
    "a ledger of 1 TB": _declared("ledger", (HUGE,), np.uint8),
    "all of 3 GB, none written": _all_declared((2 * 10**8,), chunks=(1 << 16,)),
    "y of 1.6 GB in 2 MB": _filled("y", 200),
    "steps of 1 TB": _declared("steps", (10**10,), np.dtype([("label", "S90"), ("n", np.int64)]), chunks=(1 << 10,)),
    "a text of 8 GB": _declared("rig", (), h5py.string_dtype("utf-8", 2 * 10**9)),
    "texts of texts": _declared("protocol", (10**9,), h5py.string_dtype(), chunks=(1 << 10,)),
    "a chunk of 4 GB": _declared("y", (2**29 - 1,), chunks=(2**29 - 1,), compression="gzip"),
    "y of nothing": _declared("y", (0,)),
    "y of no space": _put("y", lambda file: h5py.Empty("f8")),
    "y one more": _put("y", lambda file: np.append(file["y"][:], 0.0)),
    "y in two rows": _put("y", lambda file: file["y"][:].reshape(2, -1)),
    "y one number": _put("y", lambda file: 1.0),
    "a ledger of one": _put("ledger", lambda file: np.ones(1, np.uint8)),
    "no sample": _all_declared((0,)),
    "twenty thousand groups": _many,
    "groups in groups": _deep,
}
TYPES: dict[str, Change] = {
    f"{name} of {kind}": _put(name, lambda file, name=name, kind=kind: np.zeros(file[name].shape, dtype=kind))
    for name in ("y", "u", "ledger")
    for kind in ("S5", "c16", "V9", "f8,f8", "u8")
} | {
    "y of text": _put("y", lambda file: np.array(["1"] * file["y"].size, dtype=h5py.string_dtype())),
    "y of lists": _put("y", lambda file: np.array([np.ones(1)] * 9 + [np.ones(2)], dtype=h5py.vlen_dtype(float))),
    "NaN in u": _put("u", lambda file: np.full(file["u"].shape, np.nan)),
    "infinity in y": _put("y", lambda file: np.full(file["y"].shape, np.inf)),
    "an entry of 7": _put("ledger", lambda file: np.full(file["y"].shape, 7, np.uint8)),
    "entries below 0": _put("ledger", lambda file: np.full(file["y"].shape, -1, np.int8)),
    "nothing received": _put("ledger", lambda file: np.zeros(file["y"].shape, np.uint8)),
    "steps of numbers": _put("steps", lambda file: np.zeros(5)),
    "steps of text": _put("steps", lambda file: "steps"),
    "a step backwards": _table("steps", [(b"a", b"hold", 100, 10, 0)]),
    "a step beyond": _table("steps", [(b"a", b"hold", 0, 10**15, 0)]),
    "a step before": _table("steps", [(b"a", b"hold", -5, 10, 0)]),
    "a step in no UTF-8": _table("steps", [(b"\xff\xfe", b"hold", 0, 10, 0)]),
    "a rig of bytes": _put("rig", lambda file: np.void(b"\xff\x00\xfe")),
    "a rig of numbers": _put("rig", lambda file: np.arange(5)),
    "rigs": _put("rig", lambda file: np.array(["a", "b"], dtype=h5py.string_dtype())),
    "a rig in no UTF-8": _put("rig", lambda file: np.bytes_(b"\xff\xfe\xff")),
    "a rig of aliases": _put("rig", lambda file: "a: &a [x]\nb: [*a, *a]\n"),
    "a rig too large": _put("rig", lambda file: "a: 1\n" * 2**20),
    "a calibration of nothing": _put("calibration", lambda file: "{"),
    "no y": _put("y", lambda file: None),
    "no u": _put("u", lambda file: None),
    "no ledger": _put("ledger", lambda file: None),
    "no rig": _put("rig", lambda file: None),
    "no steps": _put("steps", lambda file: None),
    "no device": _put("device", lambda file: None),
    "no software": _put("software", lambda file: None),
    "inputs of numbers": _put("inputs", lambda file: np.arange(5)),
    "inputs in inputs": lambda file: file.create_group("inputs/w") and None,
    "a device of numbers": _put("device", lambda file: np.arange(5)),
}
WORDS: dict[str, Change] = {
    f"{name} {str(value)[:12]!r}": _attribute("/", name, value)
    for name, values in {
        "rate_hz": (0.0, -1.0, np.nan, np.inf, "fast", 1e308, [1.0, 2.0], None),
        "start_s": (np.nan, np.inf, "now", None),
        "intersample": ("cubic", 3, None), "initial": ("flying", 1, None), "complete": ("perhaps", None),
        "title": (np.arange(3), None), "schema": ("rig.recording/99", "rig.recording/", "x", 7, None),
        "started": ("yesterday", 5, None), "finished": (7, None), "reason": (None,),
        "git_commit": (h5py.Empty("S1"), None),
    }.items() for value in values
} | {
    "no serial": _attribute("device", "serial", None),
    "a model of numbers": _attribute("device", "model", np.arange(4)),
    "volts of words": _attribute("device/settings", "output_low", "low"),
    "a range upside down": _attribute("device/settings", "output_low", "99 V"),
}
HARMLESS = {"started 'yesterday'", "y of u8", "u of u8", "ledger of u8"}
"""What may be answered as well as refused."""


def hostile_recordings(originals: Originals, every: int = 1) -> Iterator[Case]:
    """Yield one in ``every`` of the recordings made to harm, beside an intact one under another name."""
    beside = {"other.h5": originals.run}
    for name, change in islice((LINKS | SIZES | TYPES | WORDS).items(), 0, None, every):
        held = changed(originals.run, change)
        yield Case(f"recording: {name}", {"run.h5": held, **beside}, SIMULATE, hostile=name not in HARMLESS)
    for name, held in {
        "secret": SECRET.encode(),
        "text": b"time,u,y\n0,1,2\n",
        "only a signature": b"\x89HDF\r\n\x1a\n",
        "a signature late": bytes(512) + b"\x89HDF\r\n\x1a\n" + bytes(9),
        "nothing": b"",
    }.items():
        yield Case(f"recording: {name}", {"run.h5": held}, SIMULATE, hostile=True)


def damaged_recordings(originals: Originals, chance: Random) -> Iterator[Case]:
    """Yield sealed recordings with damage anywhere, without end: every one of them is to be refused."""
    while True:
        harm = chance.choice(damage.OF_BYTES)
        held = harm(originals.run, chance)
        if held != originals.run:
            yield Case(f"recording: {harm.__name__}", _played(held), chance.choice(LINES), hostile=True)


def damaged_structures(originals: Originals, chance: Random) -> Iterator[Case]:
    """Yield recordings without a seal whose HDF5 structure is damaged, without end: the library has to read them."""
    plain = without_seal(originals.run)
    while True:
        harm = chance.choice(damage.OF_BYTES)
        held = of_structure(plain, harm, chance)
        yield Case(f"structure: {harm.__name__}", _played(held), chance.choice(LINES))


def _played(held: bytes) -> dict[str, bytes]:
    """Return a recording beside the protocol that it answers."""
    return {"run.h5": held, "p.yaml": PROTOCOL.encode(), "rig.yaml": RIG.encode(), "t.csv": TABLE.encode()}


def of_structure(held: bytes, harm: damage.Damage, chance: Random) -> bytes:
    """Return HDF5 with damage to what is not samples: at its beginning or end, or around a signature."""
    marks = [at for word in (b"TREE", b"HEAP", b"SNOD", b"OHDR", b"OCHK", b"GCOL", b"FRHP") for at in _all(held, word)]
    start = max(0, chance.choice([0, len(held) - 2048, *marks]) - 64)
    stop = min(len(held), start + 1024)
    return held[:start] + harm(held[start:stop], chance) + held[stop:]


def _all(held: bytes, word: bytes) -> Iterator[int]:
    at = held.find(word)
    while at >= 0:
        yield at
        at = held.find(word, at + 1)
