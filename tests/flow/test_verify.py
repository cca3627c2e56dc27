"""Does `rig verify` tell an intact recording from a damaged one, and one that still grows from both?"""

import json
from pathlib import Path

from rig import narration, workflow
from rig.plan import Limits, Plan
from rig.recorded import Entry
from rig.recording import Writer, read
from tests.flow.console import here, refused


def damaged(recording: Path, to: Path) -> Path:
    """Return a copy with one bit of its last byte changed."""
    content = bytearray(recording.read_bytes())
    content[-1] ^= 1
    to.write_bytes(content)
    return to


def test_intact_damaged_and_no_recordings(recording: Path, tmp_path: Path) -> None:
    bad = damaged(recording, tmp_path / "bad.h5")
    ended = here("verify", recording, bad, "--json", "told.json", cwd=tmp_path)
    assert ended.code == 1
    assert ended.err == (f"rig: {bad}: damaged: the bytes do not match their checksum; use a copy, or record again\n")
    assert f"{recording}: intact" in ended.out
    assert f"{bad}: DAMAGED" in ended.out
    told = json.loads((tmp_path / "told.json").read_text())
    assert (told["schema"], told["verdict"]) == ("rig.verify/1", "damaged")
    assert [file["verdict"] for file in told["files"]] == ["intact", "damaged"]
    (tmp_path / "t.csv").write_text("t,u,y\n0,1,2\n")
    refused(here("verify", "t.csv", cwd=tmp_path), 2, "t.csv")


def test_a_recording_that_grows_is_verified_and_read_as_far_as_it_is(recording: Path, tmp_path: Path) -> None:
    done, path = read(recording), tmp_path / "grows.h5"
    plan = Plan(done.title, done.u[:], done.rate_hz, done.steps, Limits(-10.0, 10.0), rig_text=done.rig_text)
    with Writer(path, plan, done.origin.equipment) as writer:
        writer.append(0, done.y[:-100])
        verified = here("verify", path, cwd=tmp_path)
        assert verified.code == 0, verified
        assert f"{path}: intact, still being written" in verified.out
        assert f"{done.u.size - 100} recorded" in verified.out
        loaded = workflow.load([path])
        assert list(narration.incomplete(loaded)) == ["grows: incomplete, still being written"]
        assert loaded.beside() == {"incomplete": [{"run": "grows", "reason": "still being written"}]}
        assert loaded.traces[0].size == done.u.size - 100
        writer.append(done.u.size - 100, done.y[-100:])
        assert writer.finish(True, "all there").count(Entry.RECORDED) == done.u.size
