"""Does a name inside a file mean only what lies beside that file, or comes with the program?"""

import os
from pathlib import Path

import pytest

from rig.errors import FileError, MisfitError, RefusedError
from rig.plan import plan
from rig.protocol import parse_protocol, read_protocol
from rig.references import file_meant, is_beside, packaged, stays_inside
from rig.registry import address_in
from rig.session import usual_address

RIG = "spec: 1\nrig: mine\nG1: {num: [1], den: [1]}\nF: linear\nG2: {num: [1], den: [1]}\n"
HEAD = "spec: 1\ntitle: t\nquestion: q\nlimits: {level: 10 V}\nacquisition: {rate: 1 kHz}\n"
STEPS = "steps:\n  - hold: {level: 1 V, time: 10 ms}\n"
OUT = ["/etc/passwd", "../rig.yaml", "below/../../rig.yaml", "..", "", "a\0b", "a\nb"]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder with a rig file in it, below it, and in the folder above, to which two links lead."""
    here = tmp_path / "here"
    (here / "below").mkdir(parents=True)
    for place in (tmp_path, here, here / "below"):
        (place / "rig.yaml").write_text(RIG)
    (tmp_path / "table.csv").write_text("0,1\n1,1\n")
    (here / "link.yaml").symlink_to("../rig.yaml")
    (here / "up").symlink_to("..")
    (here / "circle.yaml").symlink_to("circle.yaml")
    return here


@pytest.mark.parametrize("name", ["rig.yaml", "below/rig.yaml", "below/./rig.yaml"])
def test_what_lies_beside_or_below_is_meant(folder: Path, name: str) -> None:
    assert file_meant(name, folder) == folder / name


def test_what_comes_with_the_program_is_meant_where_nothing_lies_beside(folder: Path) -> None:
    assert file_meant("rigs/opamp_backlash.yaml", folder) == packaged() / "rigs" / "opamp_backlash.yaml"
    (folder / "rigs").mkdir()
    (folder / "rigs" / "opamp_backlash.yaml").write_text(RIG)
    assert file_meant("rigs/opamp_backlash.yaml", folder) == folder / "rigs" / "opamp_backlash.yaml"


@pytest.mark.parametrize("name", OUT)
def test_text_that_leads_out_is_refused(folder: Path, name: str) -> None:
    with pytest.raises(MisfitError):
        stays_inside(name)
    with pytest.raises(MisfitError):
        file_meant(name, folder)


@pytest.mark.parametrize("name", ["link.yaml", "up/rig.yaml", "up/here/../rig.yaml"])
def test_a_link_that_leads_out_is_refused(folder: Path, name: str) -> None:
    with pytest.raises(MisfitError, match="stay beside"):
        file_meant(name, folder)
    assert not is_beside(folder / name, folder)


@pytest.mark.parametrize("name", ["nothing.yaml", "circle.yaml", "below", "a" * 5000])
def test_where_there_is_no_file_nothing_is_meant(folder: Path, name: str) -> None:
    assert file_meant(name, folder) is None


def test_a_pipe_is_no_file_and_nobody_waits_for_it(folder: Path) -> None:
    os.mkfifo(folder / "pipe.yaml")
    assert file_meant("pipe.yaml", folder) is None


@pytest.mark.parametrize("name", ["../rig.yaml", "link.yaml", "/etc/hostname"])
def test_a_protocol_does_not_reach_a_rig_elsewhere(folder: Path, name: str) -> None:
    (folder / "p.yaml").write_text(f"{HEAD}rig: {name}\n{STEPS}")
    with pytest.raises(FileError, match=r"p.yaml:6: rig: a file's references stay beside it: .*command line"):
        read_protocol(folder / "p.yaml")


def test_who_types_the_command_may_name_a_rig_elsewhere(folder: Path) -> None:
    (folder / "p.yaml").write_text(f"{HEAD}rig: nowhere.yaml\n{STEPS}")
    assert read_protocol(folder / "p.yaml", folder.parent / "rig.yaml").rig_path == str(folder.parent / "rig.yaml")


@pytest.mark.parametrize("name", ["../table.csv", "up/table.csv", "/etc/hostname"])
def test_a_protocol_does_not_reach_a_table_elsewhere(folder: Path, name: str) -> None:
    text = f"{HEAD}steps:\n  - table: {{file: {{path: {name}}}}}\n"
    with pytest.raises(FileError, match=r"a file's references stay beside it"):
        plan(parse_protocol(text, str(folder / "p.yaml")))


def test_a_table_that_is_not_there_is_a_bad_file_and_no_refused_level(folder: Path) -> None:
    text = f"{HEAD}steps:\n  - table: {{file: {{path: nothing.csv}}}}\n"
    with pytest.raises(FileError, match=r"nothing.csv: no such file"):
        plan(parse_protocol(text, str(folder / "p.yaml")))


def test_a_simulated_device_is_seen_from_its_protocol(folder: Path) -> None:
    assert address_in(folder, "loopback:below/rig.yaml?seed=3") == f"loopback:{folder}/below/rig.yaml?seed=3"
    assert address_in(folder, "loopback:rig.yaml#amplifier=10,10") == f"loopback:{folder}/rig.yaml#amplifier=10.0,10.0"
    assert address_in(folder, "loopback:") == "loopback:"
    assert address_in(folder, "serial:/dev/ttyACM0") == "serial:/dev/ttyACM0"


@pytest.mark.parametrize("address", ["loopback:../rig.yaml", "replay:/etc/hostname", "loopback:link.yaml",
                                     "loopback:nothing.yaml", "os:Path", "tests.unit.rig.devices:ScriptedDevice:x"])
def test_a_protocol_names_no_code_and_no_simulated_device_elsewhere(folder: Path, address: str) -> None:
    protocol = parse_protocol(f"{HEAD}device: {address!r}\n{STEPS}", str(folder / "p.yaml"))
    with pytest.raises(FileError, match=r"p.yaml:6: device: "):
        usual_address(protocol)


def test_a_level_over_the_limit_is_still_a_negative_answer(folder: Path) -> None:
    text = f"{HEAD}steps:\n  - hold: {{level: 11 V, time: 1 s}}\n"
    with pytest.raises(RefusedError):
        plan(parse_protocol(text, str(folder / "p.yaml")))
