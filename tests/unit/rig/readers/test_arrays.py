"""Do the array files of other programs hand out the numbers that these wrote, and refuse what is no column?"""

import io
import wave
import zipfile
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
from nptdms import ChannelObject, RootObject, TdmsWriter
from numpy.typing import NDArray
from scipy.io import savemat, wavfile

from rig.errors import FileError, UsageError
from rig.importers import Asked, read_table
from rig.readers import Table, open_table
from rig.recording import Entry

SIZE = 300
U = np.linspace(-3.0, 3.0, SIZE)
Y = np.sin(np.arange(SIZE) / 9.0)
BOTH = np.stack([U, Y], axis=1)


def npz(path: Path) -> None:
    np.savez(path, u=U, y=Y, row=U[None, :], both=BOTH, fortran=np.asfortranarray(BOTH), wide=BOTH.T,
             small=Y.astype(">f4"), whole=np.arange(SIZE, dtype="i2"), records=np.rec.fromarrays([U, Y], names="a,b"),
             one=1.0)


def npz_packed(path: Path) -> None:
    np.savez_compressed(path, u=U, y=Y, both=BOTH, fortran=np.asfortranarray(BOTH), wide=BOTH.T)


def mat5(path: Path) -> None:
    savemat(path, {"u": U, "y": Y[:, None], "both": BOTH, "wide": BOTH.T, "whole": np.arange(SIZE, dtype=np.int16),
                   "words": "text", "one": 1.0}, do_compression=True)


def hdf5(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file["u"], file["y"], file["data/both"], file["wide"] = U, Y, BOTH, BOTH.T
        file["records"] = np.rec.fromarrays([U, Y], names="a,b")
        file.create_dataset("packed", data=Y, chunks=(7,), compression="gzip", shuffle=True)
        file["millivolts"] = 1e3 * U
        file["millivolts"].attrs["unit"] = "mV"


COLUMNS = [
    (npz, "r.npz", {"u": U, "y": Y, "1": U, "row": U, "both:1": U, "both:2": Y, "fortran:2": Y, "wide:2": Y,
                    "small": Y.astype("f4"), "whole": np.arange(SIZE), "records.b": Y}),
    (npz_packed, "r.npz", {"u": U, "both:1": U, "both:2": Y, "fortran:2": Y, "wide:2": Y}),
    (lambda path: np.save(path, BOTH), "r.npy", {":2": Y, "1": U, "2": Y}),
    (mat5, "r.mat", {"u": U, "y": Y, "both:2": Y, "wide:2": Y, "whole": np.arange(SIZE)}),
    (hdf5, "r.h5", {"u": U, "y": Y, "data/both:2": Y, "wide:2": Y, "records.b": Y, "packed": Y, "millivolts": U}),
    (hdf5, "named_otherwise.csv", {"u": U}),
]


@pytest.mark.parametrize(("write", "name", "columns"), COLUMNS)
def test_every_column_is_read_by_stretches(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, write: Callable[[Path], None], name: str,
    columns: dict[str, NDArray[np.float64]],
) -> None:
    write(tmp_path / name)
    if not (tmp_path / name).exists():
        (tmp_path / f"{name}.npz").rename(tmp_path / name)
    monkeypatch.setattr("identify.trace.blocks.__defaults__", (64,))
    found = open_table(tmp_path / name)
    for which, values in columns.items():
        assert np.allclose(found.column(which, "V"), values, rtol=1e-15, atol=0.0), which
        assert np.allclose(found.column(which, "V", 70, 210), values[70:210], rtol=1e-15, atol=0.0), which
        assert found.column(which, "V", SIZE + 5).size == 0


def test_arrays_become_a_recording(tmp_path: Path) -> None:
    npz(tmp_path / "r.npz")
    made = read_table(tmp_path / "r.npz", Asked(input="u", output="y", rate_hz=100.0))
    assert np.array_equal(made.u, U)
    assert np.array_equal(made.y, Y)
    assert made.count(Entry.RECORDED) == SIZE


def message(path: Path, which: str = "1") -> str:
    with pytest.raises(FileError) as caught:
        open_table(path).column(which, "V")
    assert "\n" not in str(caught.value)
    return str(caught.value).replace(f"{path.parent}/", "")


def test_objects_are_never_loaded(tmp_path: Path) -> None:
    np.savez(tmp_path / "r.npz", u=np.array([{}, 1], dtype=object))
    assert "r.npz: u: an array of Python objects, which is never loaded" in message(tmp_path / "r.npz")


@pytest.mark.parametrize("values", [Y.astype(complex), np.array(["a", "b"]), np.arange(9).astype("datetime64[s]")])
def test_what_is_no_number_is_refused(tmp_path: Path, values: NDArray[np.generic]) -> None:
    np.savez(tmp_path / "r.npz", u=values)
    assert "not a column of numbers" in message(tmp_path / "r.npz")


def test_integers_that_no_float_holds_are_refused(tmp_path: Path) -> None:
    np.savez(tmp_path / "r.npz", u=np.array([0, 2**53 + 1]))
    assert "integers too large to be kept exactly" in message(tmp_path / "r.npz")


def test_lengths_must_be_equal(tmp_path: Path) -> None:
    np.savez(tmp_path / "r.npz", u=U, y=Y[:-1])
    with pytest.raises(FileError, match=r"column 2 \(y\): columns of unequal length: 299 rows; allowed: 300"):
        read_table(tmp_path / "r.npz", Asked(input="u", output="y", rate_hz=1.0))


def test_a_number_that_is_none_is_named_by_its_row(tmp_path: Path) -> None:
    np.savez(tmp_path / "r.npz", u=np.where(np.arange(SIZE) == 77, np.nan, U))
    assert message(tmp_path / "r.npz").startswith("r.npz: row 77 (from 0): column 1 (u): not a number: 'nan'")


def test_an_archive_of_something_else(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "r.xlsx", "w") as archive:
        archive.writestr("xl/worksheets/sheet1.xml", "<worksheet/>")
    assert "r.xlsx: an archive without NumPy arrays; allowed: .npz; save" in message(tmp_path / "r.xlsx")
    (tmp_path / "r.npz").write_bytes(b"PK\x03\x04\x00\x00")
    assert "r.npz: cannot be read, or damaged: File is not a zip file" in message(tmp_path / "r.npz")


def test_an_array_that_claims_more_than_its_file_holds(tmp_path: Path) -> None:
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(head, {"descr": "<f8", "fortran_order": False, "shape": (10**12,)})
    with zipfile.ZipFile(tmp_path / "r.npz", "w") as archive:
        archive.writestr("u.npy", head.getvalue() + bytes(800))
    assert "r.npz: u: an array larger than its file can hold: 8e+12 bytes" in message(tmp_path / "r.npz")


def test_links_out_of_an_hdf5_file_are_not_followed(tmp_path: Path) -> None:
    hdf5(tmp_path / "other.h5")
    with h5py.File(tmp_path / "link.h5", "w") as file:
        file["linked"] = h5py.ExternalLink("other.h5", "u")
    assert "unknown column 'linked'" in message(tmp_path / "link.h5", "linked")
    with h5py.File(tmp_path / "virtual.h5", "w") as file:
        layout = h5py.VirtualLayout((SIZE,), "f8")
        layout[:] = h5py.VirtualSource("other.h5", "u", (SIZE,))
        file.create_virtual_dataset("virtual", layout)
    assert "virtual.h5: virtual: its values stand in another file" in message(tmp_path / "virtual.h5", "virtual")
    with h5py.File(tmp_path / "raw.h5", "w") as file:
        file.create_dataset("elsewhere", (SIZE,), "f8", external=[("raw.bin", 0, 8 * SIZE)])
    assert "raw.h5: cannot be read, or damaged" in message(tmp_path / "raw.h5", "elsewhere")


def test_hdf5_that_claims_much_and_holds_nothing(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "r.h5", "w") as file:
        file.create_dataset("v", (10**5,), "f8", chunks=(1 << 27,), maxshape=(None,))
    assert "chunks too large to be read one by one" in message(tmp_path / "r.h5", "v")
    with h5py.File(tmp_path / "huge.h5", "w") as file:
        file.create_dataset("u", (10**12,), "f8", chunks=(1 << 20,))
    assert "huge.h5: cannot be read, or damaged" in message(tmp_path / "huge.h5", "u")


@pytest.mark.parametrize("unit", ["mV", np.bytes_(b"mV"), np.array([b"mV"]), np.array(["millivolt"], dtype=object)])
def test_units_of_hdf5_count_however_they_are_written(tmp_path: Path, unit: object) -> None:
    with h5py.File(tmp_path / "r.h5", "w") as file:
        file["u"] = 1e3 * U
        file["u"].attrs["Units"] = unit
        file["y"] = Y
        file["y"].attrs["unit"] = "counts"
    found = open_table(tmp_path / "r.h5")
    assert np.allclose(found.column("u", "V"), U, rtol=1e-15, atol=0.0)
    assert "column 2 (y): wrong unit 'counts'" in message(tmp_path / "r.h5", "y")


# TDMS


def tdms(path: Path, **properties: object) -> None:
    with TdmsWriter(path) as writer:
        for at in range(0, SIZE, 50):
            writer.write_segment([RootObject({}), *(
                ChannelObject("Untitled", name, values[at : at + 50], properties)
                for name, values in (("ao0", 1e3 * U), ("ai0", Y)))])


def test_tdms_has_its_own_clock_and_units(tmp_path: Path) -> None:
    tdms(tmp_path / "r.tdms", wf_increment=0.5e-3, wf_start_offset=0.25, unit_string="mV")
    made = read_table(tmp_path / "r.tdms", Asked(input="Untitled/ao0", output="Untitled/ai0", first_row=2))
    assert (made.rate_hz, made.start_s, made.u.size) == (2000.0, 0.251, SIZE - 2)
    assert np.allclose(made.u, U[2:], rtol=1e-15)
    assert np.allclose(made.y, Y[2:] / 1e3, rtol=1e-15)
    assert "Untitled/ao0 in mV, of which one is 0.001 V" in made.origin.equipment.settings["understood"]


def test_tdms_without_a_clock_needs_a_rate(tmp_path: Path) -> None:
    tdms(tmp_path / "r.tdms")
    with pytest.raises(UsageError, match="the time base is unknown"):
        read_table(tmp_path / "r.tdms", Asked(input="1", output="2"))
    assert read_table(tmp_path / "r.tdms", Asked(input="1", output="2", rate_hz=5.0)).rate_hz == 5.0


def test_a_file_and_a_rate_that_disagree(tmp_path: Path) -> None:
    tdms(tmp_path / "r.tdms", wf_increment=0.5e-3)
    with pytest.raises(FileError, match="file and rate disagree: 2000 Hz in the file; allowed: 1000 Hz"):
        read_table(tmp_path / "r.tdms", Asked(input="1", output="2", rate_hz=1000.0))


def test_tdms_cut_off_says_so(tmp_path: Path) -> None:
    tdms(tmp_path / "r.tdms")
    whole = (tmp_path / "r.tdms").read_bytes()
    (tmp_path / "r.tdms").write_bytes(whole[:-100])
    found = open_table(tmp_path / "r.tdms")
    assert found.remarks == ("the last segment was not finished: what is whole of it is read",)
    there = found.column("2", "V")
    assert there.size < SIZE
    assert np.array_equal(there, Y[: there.size])
    with pytest.raises(FileError, match="columns of unequal length"):
        read_table(tmp_path / "r.tdms", Asked(input="1", output="2", rate_hz=1.0))
    assert read_table(tmp_path / "r.tdms", Asked(input="1", output="2", rate_hz=1.0, stop_row=250)).u.size == 250


# WAV

TONES = np.stack([np.sin(np.arange(SIZE) / 7.0), np.cos(np.arange(SIZE) / 5.0)], axis=1)


@pytest.mark.parametrize(("kind", "full"), [
    (np.int16, 2**15), (np.int32, 2**31), (np.float32, 1), (np.float64, 1), (np.uint8, 2**7),
])
def test_wav_of_every_width(tmp_path: Path, kind: type[np.generic], full: float) -> None:
    whole = TONES * (1.0 if full == 1 else 0.9 * full) + (128.0 if kind is np.uint8 else 0.0)
    wavfile.write(tmp_path / "r.wav", 48_000, whole.astype(kind))
    _, kept = wavfile.read(tmp_path / "r.wav")
    made = read_table(tmp_path / "r.wav", Asked(input="1", output="2", full_scale_v=10.0))
    held = kept.astype(float) - (128.0 if kind is np.uint8 else 0.0)
    assert np.array_equal(made.u, held[:, 0] * (10.0 / full))
    assert np.array_equal(made.y, held[:, 1] * (10.0 / full))
    assert made.rate_hz == 48_000.0
    assert made.origin.equipment.settings["understood"] == f"full scale, {full:g} in the file, is 10 V"


def test_wav_of_24_bits_and_a_scale_nobody_gave(tmp_path: Path) -> None:
    counts = np.array([[-(2**23), 2**23 - 1], [1, -1], [0, 4_000_000]], dtype="<i4")
    with wave.open(str(tmp_path / "r.wav"), "wb") as file:
        file.setnchannels(2)
        file.setsampwidth(3)
        file.setframerate(96_000)
        file.writeframes(counts.view(np.uint8).reshape(-1, 4)[:, :3].tobytes())
    made = read_table(tmp_path / "r.wav", Asked(input="1", output="2"))
    assert np.array_equal(np.stack([made.u, made.y], 1), counts / 2.0**23)
    assert "is 1 V as nothing else was said" in made.origin.equipment.settings["understood"]


def test_wav_cut_off_or_of_a_kind_not_known(tmp_path: Path) -> None:
    wavfile.write(tmp_path / "r.wav", 48_000, (1000 * TONES).astype(np.int16))
    whole = (tmp_path / "r.wav").read_bytes()
    (tmp_path / "r.wav").write_bytes(whole[:-8])
    assert "r.wav: cut off: 1192 bytes of samples; allowed: 1200 as its head says" in message(tmp_path / "r.wav")
    (tmp_path / "r.wav").write_bytes(whole[:20] + b"\x02\x00" + whole[22:])
    assert "a kind of WAV that is not known: format 2, 16 bits" in message(tmp_path / "r.wav")


def test_full_scale_is_of_wav_files(tmp_path: Path) -> None:
    npz(tmp_path / "r.npz")
    with pytest.raises(UsageError, match="full scale is of WAV files"):
        open_table(tmp_path / "r.npz", 5.0)


# damage


@pytest.mark.uncounted
@pytest.mark.parametrize(("write", "name"), [(npz, "r.npz"), (npz_packed, "r.npz"), (mat5, "r.mat"), (hdf5, "r.h5"),
                                             (tdms, "r.tdms")])
def test_a_file_cut_anywhere_ends_in_one_message(tmp_path: Path, write: Callable[[Path], None], name: str) -> None:
    write(tmp_path / name)
    whole = (tmp_path / name).read_bytes()
    for length in np.linspace(0, len(whole) - 1, 40).astype(int):
        (tmp_path / name).write_bytes(whole[:length])
        try:
            found: Table = open_table(tmp_path / name)
            for which in range(len(found.headings)):
                found.column(str(which + 1), "V")
        except FileError as error:
            assert "\n" not in str(error)  # noqa: PT017
