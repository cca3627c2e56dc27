"""How is it told in plain words what a recording on the disk is worth, or an answer?"""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from rig.recorded import Entry
from rig.units import show

if TYPE_CHECKING:
    from rig.reproduced import Reproduced
    from rig.verifying import Verified

LISTED = 10  # differences told one by one


def checked(found: "Verified | Reproduced") -> Iterator[str]:
    """Tell what became of a recording or of an answer."""
    from rig.verifying import Verified

    return verified(found) if isinstance(found, Verified) else reproduced(found)


def reproduced(found: "Reproduced") -> Iterator[str]:
    """Tell whether an answer came out again, how exactly, and of what other program it is."""
    yield f"{found.path}: {'reproduced' if found.intact else 'COMES OUT OTHERWISE'}"
    yield from (f"  different {sentence}" for sentence in found.findings[:LISTED])
    if len(found.findings) > LISTED:
        yield f"  different and {len(found.findings) - LISTED} more"
    exact = "to the last bit" if not found.differences else f"{len(found.differences)} of them not to the last bit"
    yield f"  compared  {found.numbers} numbers and words, {exact}; allowed {found.allowed or 'no difference'}"
    yield from (f"  program   {key} was {then}, is {now}" for key, (then, now) in found.changes.items())


def verified(found: "Verified") -> Iterator[str]:
    """Tell what became of a recording, and what it is."""
    run = found.recording
    yield f"{found.path}: {'intact' if found.intact else 'DAMAGED'}{', still being written' * found.being_written}"
    yield from (f"  damage    {sentence}" for sentence in found.findings)
    yield from (f"  remark    {sentence}" for sentence in found.remarks)
    if run is None:
        return
    counts = ", ".join(f"{run.count(entry)} {entry.name.lower().replace('_', ' ')}" for entry in Entry)
    yield f"  checked   {', '.join(found.checked)}"
    yield f"  samples   {run.u.size} at {show(run.rate_hz, 'Hz')}: {counts}"
    yield f"  {'complete ' if run.complete else 'incomplete'} {run.reason}"
    version = run.origin.software.get("backlash-rig", "an unknown version")
    yield f"  made      {run.origin.started} by backlash-rig {version}{_at_commit(run.origin.git_commit)}"
    yield f"  device    {run.origin.equipment.address}"


def _at_commit(commit: str) -> str:
    return f" at {commit[:12]}{'-dirty' * commit.endswith('-dirty')}" if commit else ""
