"""Which of the things beside the rig may have made a change: what was played, the device, its calibration?"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from identify.natural_units import shown, shown_interval
from rig.calibration import Calibration
from rig.differences import Aspect, Difference, calibration_of
from rig.recorded import Recording

if TYPE_CHECKING:
    from identify.compared.comparison import Comparison

Suspect = Literal["ruled out", "cannot tell"]
NOISE = "noise"  # as identify calls the noise of a reading among what changed
DEVICE_STAGES = ("source", "sense")
MOVED = ("appeared", "disappeared", "changed")


@dataclass(frozen=True)
class Cause:
    """Whether something beside the rig may have made a change, and why that is said."""

    aspect: Aspect
    state: Suspect
    sentence: str

    def to_dict(self) -> dict[str, object]:
        """Return the form of ``rig compare --json``."""
        return {"aspect": self.aspect, "state": self.state, "sentence": self.sentence}


def causes(
    found: "Comparison", differ: Sequence[Difference], recordings: tuple[Recording, Recording]
) -> tuple[Cause, ...]:
    """Return for everything beside the rig whether it may have made the change that was found."""
    calibrations = calibration_of(recordings[0]), calibration_of(recordings[1])
    return (
        _protocol(found, _words(differ, "protocol")), _device(found, _words(differ, "device"), calibrations),
        _calibration(found, calibrations),
    )  # fmt: skip


def _words(differ: Sequence[Difference], aspect: Aspect) -> str:
    return ", ".join(d.what for d in differ if d.aspect == aspect)


def _protocol(found: "Comparison", differ: str) -> Cause:
    """Return whether what was played may have made the change: only a model that lacks something depends on it."""
    if not differ:
        return Cause("protocol", "ruled out", "both played the same, sample by sample")
    if found.unproven:
        return Cause("protocol", "cannot tell", f"it differs ({differ}), and {found.unproven}; play the same again")
    return Cause("protocol", "ruled out", f"it differs ({differ}), but the model follows both recordings to the noise: "
                 "its values do not hang on what was played")  # fmt: skip


def _device(found: "Comparison", differ: str, calibrations: tuple[Calibration | None, Calibration | None]) -> Cause:
    """Return whether the device may have made the change: its gains and its delay move certain values only."""
    same = f"it differs ({differ})" if differ else "the same one, set the same"
    seen = [piece for piece in found.physics if piece.stage in DEVICE_STAGES and piece.state in MOVED]
    if seen:
        return Cause("device", "cannot tell", f"{same}; {seen[0].id} is at {seen[0].stage}, where the device itself is")
    if [change.name for change in found.changes if change.state == "changed"] == [NOISE]:
        return Cause("device", "cannot tell", f"{same}; the noise of a reading is the device's as well; "
                     f"{_over_cable(calibrations)}")  # fmt: skip
    if found.device is None and not differ:
        return Cause("device", "ruled out", f"{same}; no value moved, as its gains or its delay would move them")
    if found.device is not None and not found.device.is_possible:
        return Cause("device", "ruled out", f"{same}; whatever its gains and its delay did, they leave more of the "
                     "change than chance")  # fmt: skip
    return Cause("device", "cannot tell", f"{same}; other gains or another delay of it would do the same; "
                 f"{_over_cable(calibrations)}")  # fmt: skip


def _over_cable(calibrations: tuple[Calibration | None, Calibration | None]) -> str:
    """Return what is known of the device on both days."""
    before, after = calibrations
    if before is None or after is None:
        return "`rig calibrate` tells what it does now"
    if before.made == after.made:
        return "both rest on one calibration, which says nothing of what came after it"
    gains = [f"{shown_interval(kept.gain, 'V/V')} on {kept.made[:10]}" for kept in (before, after)]
    return f"over a cable its gain was {gains[0]} and {gains[1]}"


def _calibration(found: "Comparison", calibrations: tuple[Calibration | None, Calibration | None]) -> Cause:
    """Return whether the delays left out of the rig's may have made the change."""
    late_s = [next(o.trace.late_s for o in side.observations) for side in (found.before, found.after)]
    if late_s[0] == late_s[1]:
        used = f"the same delay, {shown(late_s[0], 's')}, is left out of the rig's in both"
        return Cause("calibration", "ruled out", used if late_s[0] else "none is used in either recording")
    delays = " and ".join(shown(each, "s") for each in late_s)
    moved = next((c for c in found.changes if c.name == "G2.dead_time"), None)
    if moved is None or moved.state == "changed":
        return Cause("calibration", "cannot tell", f"delays of {delays} of the device are left out: a dead time may "
                     "have changed by the difference alone; name one with --calibration")  # fmt: skip
    return Cause("calibration", "ruled out", f"delays of {delays} of the device are left out, and the dead time "
                 "did not change")  # fmt: skip
