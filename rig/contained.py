"""Does an HDF5 file hold all that it shows, in itself, in the size that it says?

HDF5 can show what stands in other files (external links, virtual and raw data) and more than there is (a declared size
of which nothing was written, zeros compressed a thousandfold), in circles and without end. The library follows all of
it, some of it until it crashes. Here nothing is followed and no value is read: structure alone is looked at.
"""

import h5py

OBJECTS, LEVELS = 1000, 8
"""More than any recording has, and than is worth looking through."""
FOLD = 200
"""Bytes declared for each one stored: no reading with noise in it compresses so far."""
ANY_SIZE = 1 << 24
"""Bytes that are harmless however they are stored."""


class ElsewhereError(ValueError):
    """A file shows what it does not hold; the message says what."""


def check_contained(file: h5py.File) -> None:
    """Raise ElsewhereError unless all that can be reached from the root is held by the file itself."""
    seen: set[int] = set()
    level: list[h5py.Group] = [file]
    for _ in range(LEVELS):
        below: list[h5py.Group] = []
        for inside in (_own(group, name) for group in level for name in group):
            address = h5py.h5o.get_info(inside.id).addr
            below += _looked_at(inside) if address not in seen else []
            seen.add(address)
            if len(seen) > OBJECTS:
                raise ElsewhereError(f"more than {OBJECTS} objects in one file")
        level = below
    if level:
        raise ElsewhereError(f"groups in groups, more than {LEVELS} deep")


def check_held(dataset: h5py.Dataset) -> None:
    """Raise ElsewhereError for values that stand in another file, or in a size of which next to nothing was stored."""
    how = dataset.id.get_create_plist()
    if how.get_layout() == h5py.h5d.VIRTUAL or how.get_external_count():
        raise ElsewhereError(f"the values of {dataset.name} stand in another file")
    declared, stored = _declared_bytes(dataset), dataset.id.get_storage_size()
    if declared > max(ANY_SIZE, FOLD * stored):
        raise ElsewhereError(f"{dataset.name} declares {declared} bytes, of which {stored} are stored")
    if how.get_layout() == h5py.h5d.CHUNKED and _bytes(how.get_chunk(), dataset) > max(ANY_SIZE, FOLD * stored):
        raise ElsewhereError(f"{dataset.name} is stored in pieces larger than all it holds")


def _looked_at(inside: h5py.HLObject) -> list[h5py.Group]:
    """Return what is still to be looked through in an object."""
    if isinstance(inside, h5py.Dataset):
        check_held(inside)
    return [inside] if isinstance(inside, h5py.Group) else []


def _own(group: h5py.Group, name: str) -> h5py.HLObject:
    """Return what is linked to under ``name``, in this file; raise KeyError, ElsewhereError."""
    link = group.get(name, getlink=True)
    if isinstance(link, h5py.ExternalLink):
        raise ElsewhereError(f"{group.name.rstrip('/')}/{name} stands in another file, {link.filename!r}")
    if isinstance(link, h5py.SoftLink):
        raise ElsewhereError(f"{group.name.rstrip('/')}/{name} is a link, to {link.path!r}")
    return group[name]


def _declared_bytes(dataset: h5py.Dataset) -> int:
    """Return what the values would take in memory; 0 for what has none."""
    return 0 if dataset.shape is None else _bytes(dataset.shape, dataset)


def _bytes(shape: tuple[int, ...], dataset: h5py.Dataset) -> int:
    count = 1
    for size in shape:
        count *= size
    return count * int(dataset.id.get_type().get_size())
