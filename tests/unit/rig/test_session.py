"""Is a protocol played on the rig it names, wherever no other was asked for?"""

import signal
from pathlib import Path

import pytest

from rig.recording import Writer
from rig.session import check, record
from rig.verifying import verify

RIG = "spec: 1\nrig: {name}\nG1: {{num: [1], den: [1]}}\nF: linear\nG2: {{num: [1], den: [1]}}\nnoise: 1 mV\n"
PROTOCOL = """\
spec: 1
title: one level
question: Whose rig is played?
rig: mine.yaml
limits: {{level: 1 V}}
acquisition: {{rate: 1 kHz}}
{device}steps: [{{staircase: {{levels: [0.5 V], dwell: 10 ms}}}}]
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("mine", "other"):
        (tmp_path / f"{name}.yaml").write_text(RIG.format(name=name))
    return tmp_path


def played(folder: Path, device: str = "", typed: str | None = None) -> str:
    """Return which rig is played by a protocol that names ``device``, with ``typed`` on the command line."""
    path = folder / "protocol.yaml"
    path.write_text(PROTOCOL.format(device=f"device: '{device}'\n" if device else ""))
    return check(path, typed).identity.serial


@pytest.mark.parametrize("device", ["", "loopback:", "loopback:?seed=3"])
@pytest.mark.parametrize("typed", [None, "loopback:", "loopback:?seed=4"])
def test_a_loopback_that_names_no_rig_plays_the_protocol_s(folder: Path, device: str, typed: str | None) -> None:
    assert played(folder, device, typed) == "mine"


def test_a_loopback_that_names_a_rig_plays_that(folder: Path) -> None:
    assert played(folder, "loopback:other.yaml") == "other"
    assert played(folder, "loopback:", f"loopback:{folder / 'other.yaml'}?seed=2") == "other"


def test_a_rig_that_comes_with_the_program_is_called_by_its_name_unless_another_has_it(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    shipped = check("quick_check.yaml")
    assert shipped.address == "loopback:rigs/opamp_backlash.yaml"
    (folder / "rigs").mkdir()
    (folder / "mine.yaml").rename(folder / "rigs" / "opamp_backlash.yaml")
    again = check("quick_check.yaml")
    assert again.identity == shipped.identity
    assert again.address != shipped.address


@pytest.mark.usefixtures("interruptible")
@pytest.mark.parametrize("moment", ["__enter__", "finish"])
def test_ctrl_c_while_a_recording_is_opened_or_closed_leaves_it_whole(
    folder: Path, monkeypatch: pytest.MonkeyPatch, moment: str
) -> None:
    path, then = folder / "protocol.yaml", getattr(Writer, moment)
    path.write_text(PROTOCOL.format(device=""))

    def pressed(self: Writer, *args: object) -> object:
        signal.raise_signal(signal.SIGINT)
        return then(self, *args)

    monkeypatch.setattr(Writer, moment, pressed)
    if moment == "finish":  # the run is over: what goes on behind it is interrupted
        with pytest.raises(KeyboardInterrupt):
            record(path, None, folder / "run.h5", lambda done, total: None)
    else:
        record(path, None, folder / "run.h5", lambda done, total: None)
    kept = verify(folder / "run.h5")
    assert kept.intact
    assert kept.recording is not None
    assert "safe" in [event.kind for event in kept.recording.events]
