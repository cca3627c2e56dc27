"""How does a question about a rig become a protocol of one's own, proven before it is written?"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from identify.natural_units import shown
from rig import protocolfile, registry, session
from rig.asking import KINDS, Bench, usual_hz
from rig.design import usable
from rig.device import Device
from rig.errors import FileError, RefusedError, UsageError
from rig.outputs import check_destination, write_text
from rig.protocol import parse_protocol
from rig.protocolfile import exact
from rig.references import ALLOWED, is_beside, name_seen_from
from rig.rigfile import RigFile, read_rig
from rig.schemas import with_modeline

if TYPE_CHECKING:
    from identify.model import Model

SCHEMA = "rig.new/1"
USUAL_RIG = "rigs/opamp_backlash.yaml"


@dataclass(frozen=True)
class Wish:
    """What the operator wants to know, and within which bounds; None: as is usual for the rig and the device."""

    about: str
    rig: str = USUAL_RIG
    level_v: float | None = None
    rate_hz: float | None = None
    frequency_hz: float | None = None
    title: str | None = None
    device: str | None = None


@dataclass(frozen=True)
class New:
    """A protocol that was written, as it was proven."""

    path: Path
    checked: session.Checked

    def to_dict(self) -> dict[str, object]:
        """Return the JSON of ``rig new``."""
        plan = self.checked.plan
        return {
            "schema": SCHEMA, "protocol": str(self.path), "title": plan.title, "question": plan.question,
            "device": self.checked.address, "rate_hz": plan.rate_hz, "duration_s": plan.duration_s,
            "peak_V": plan.peak_v, "steps": list(dict.fromkeys(step.label for step in plan.steps)),
        }  # fmt: skip


def settled(wish: Wish) -> Wish:
    """Return the wish with what is usual for the rig and the device in place of what was not said.

    Raises FileError, UsageError, DeviceError, and RefusedError for a rig without values.
    """
    rigfile = usable(read_rig(session.shipped(wish.rig)))
    with registry.connect(_address(wish, rigfile)) as device:
        return _settled(wish, rigfile, device)


def write_new(out: str | Path, wish: Wish, overwrite: bool = False) -> New:
    """Write the protocol that asks what is wished, proven on the device; raise what ``settled`` raises."""
    out, path = Path(out), session.shipped(wish.rig)
    check_destination(out)
    if out.exists() and not overwrite:
        raise FileError("there is a file of this name already", where=str(out), do="choose another name or --overwrite")
    rigfile, folder = usable(read_rig(path)), out.resolve().parent
    if not is_beside(path, folder):
        raise UsageError("the protocol could not name its rig file", where=str(path), allowed=ALLOWED,
                         do="write the protocol beside the rig file, or above it")
    with registry.connect(_address(wish, rigfile)) as device:
        whole = _settled(wish, rigfile, device)
        text = with_modeline(_text(whole, rigfile.model, name_seen_from(path, folder)), "protocol", folder)
        checked = session.proven(parse_protocol(text, str(out)), _address(wish, rigfile), device)
    write_text(out, text)
    return New(out, checked)


def _address(wish: Wish, rigfile: RigFile) -> str:
    return session.at_rig(wish.device or f"loopback:{session.shipped(wish.rig)}", rigfile)


def _settled(wish: Wish, rigfile: RigFile, device: Device) -> Wish:
    from identify.planning.sampling import usual_rate_hz

    can, limits = device.capabilities(), rigfile.limits
    most_v = min(-can.output_low_v, can.output_high_v)
    if limits is not None:
        most_v = min(most_v, -limits.low_v, limits.high_v)
    if not 0.0 < (wish.level_v or most_v) <= most_v:
        raise RefusedError("the level is beyond the device or the rig", where="--level",
                           value=f"{wish.level_v or most_v:g} V", allowed=f"above 0 V, up to {most_v:g} V",
                           do="give a smaller one; a range on one side of 0 V is for a protocol written by hand")
    rate_hz = wish.rate_hz or usual_rate_hz(rigfile.model, can.max_rate_hz)
    title = wish.title or f"{wish.about} of {rigfile.model.title}"
    return replace(wish, level_v=wish.level_v or most_v, rate_hz=rate_hz, title=title,
                   frequency_hz=wish.frequency_hz or usual_hz(rigfile.model))


def _text(wish: Wish, model: "Model", rig: str) -> str:
    """Return the protocol; raise RefusedError where the level moves nothing."""
    assert wish.level_v
    assert wish.rate_hz
    assert wish.frequency_hz
    kind, bench = KINDS[wish.about], Bench(model, wish.level_v, wish.frequency_hz)
    steps = kind.steps(bench)
    if not steps or not bench.moves(0.0):
        least = 1.3 * bench.half_gap_v / bench.gain(0.0)
        raise RefusedError("the gap does not move at this level", where="--level", value=shown(wish.level_v, "V"),
                           allowed=f"{shown(least, 'V', 2)} or more at low frequencies",
                           do="give a larger --level, or a lower --frequency")
    heading = protocolfile.Heading(str(wish.title), kind.question, rig, {"level": exact(wish.level_v, "V")},
                                   exact(wish.rate_hz, "Hz"), wish.device)
    remark = (f"Written by `rig new` for {model.title}. {kind.because} Half the gap is "
              f"{shown(bench.half_gap_v, 'V', 3)} at v. Change what you like: `rig check` says what it will tell.")
    return protocolfile.written(heading, [], [remark]) + "\n".join(steps) + "\n"
