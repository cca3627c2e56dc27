"""What does a calibration say of the device that made a recording?"""

from dataclasses import replace

from identify.trace import KnownDevice, Trace
from rig.calibration import Calibration, parse_calibration
from rig.errors import FileError
from rig.recorded import Recording


def with_device(recording: Recording, given: Calibration | None) -> Trace:
    """Return what identification sees, and what is known of the device: ``given``, else as the recording keeps it.

    Raises FileError when the calibration given is not of this recording.
    """
    trace, kept = recording.trace(), recording.origin.equipment.calibration
    known = given if given is not None or not kept else parse_calibration(kept, f"{recording.name} (its calibration)")
    if known is None:
        return trace
    try:
        not_for = known.not_for(recording.origin.equipment, recording.rate_hz, recording.origin.started)
    except (ValueError, TypeError, OverflowError) as error:
        told = f"recording {recording.origin.started!r}, calibration {known.made!r}"
        raise FileError("recording and calibration do not both say when they were made", where=recording.name,
                        value=told, allowed="ISO 8601 with its offset to UTC", do="leave --calibration out") from error
    if not_for:
        raise FileError("the calibration is not true of this recording", where=recording.name, value=not_for,
                        do="calibrate that device at that rate, or leave --calibration out")
    facts = (("gain", known.gain, "V/V"), ("offset", known.offset, "V"), ("noise", known.noise, "V"))
    return replace(trace, device=KnownDevice(known.delay, known.origin, known.delay_not_used() or "", facts))
