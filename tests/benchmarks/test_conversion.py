"""Does the command that measures conversions run, and does it compare what came back?"""

from pathlib import Path

import h5py
import pytest

from tests.benchmarks import conversion
from tests.benchmarks.large_recording import Taken

TAKEN = Taken(1.0, 1.0, 1)


def test_what_came_back_is_compared(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def pretended(command: str, *arguments: object) -> Taken:
        run, out = (tmp_path / "run.h5", tmp_path / "out.npz")
        target, data = (out, b"") if command == "export" else (tmp_path / "back.h5", run.read_bytes()[:-1] + b"?")
        target.write_bytes(data)
        return TAKEN

    monkeypatch.setattr(conversion, "taken", pretended)
    with pytest.raises(AssertionError, match="npz: not what it was"):
        list(conversion.there_and_back(tmp_path, 3000, "npz"))


def test_a_kind_of_file_of_others_is_measured(tmp_path: Path) -> None:
    (line, took, size), = conversion.brought_in(tmp_path, 3000, "wav")
    assert line == "import wav"
    assert took.peak_bytes > size > 0
    assert not [path for path in tmp_path.iterdir() if h5py.is_hdf5(path)]
