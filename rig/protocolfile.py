"""How is a designed protocol written down, so that it reads back as meant and a bench operator can follow it?"""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from textwrap import wrap
from typing import TYPE_CHECKING, assert_never

from identify.natural_units import shown
from rig.units import exact as with_unit

if TYPE_CHECKING:
    from identify.planning.candidates import Candidate, Chord, Stairs, Tone

WIDTH = 116
WHOLE = re.compile(r"\.0(?= )")


@dataclass(frozen=True)
class Heading:
    """What stands at the top of a protocol: quantities as text with their units."""

    title: str
    question: str
    rig: str
    limits: Mapping[str, str]
    rate: str
    device: str | None = None
    ramp: str | None = None


def label(candidate: "Candidate") -> str:
    """Return the name of a step; only walks of one size and dwell may share it."""
    from identify.planning.candidates import Stairs, Tone

    if isinstance(candidate, Stairs):
        high, dwell = max(candidate.levels_v), shown(candidate.dwell_s, "s")
        return f"walk of {len(candidate.levels_v)} levels to {shown(high, 'V')}, {dwell}"
    if isinstance(candidate, Tone):
        kind = "triangle" if candidate.triangle else "sine"
        return f"{kind} {shown(candidate.frequency_hz, 'Hz')} {shown(candidate.amplitude_v, 'V')}"
    lines = len(candidate.frequencies_hz)
    return f"multisine {lines} lines to {shown(candidate.frequencies_hz[-1], 'Hz')} {shown(candidate.peak_v, 'V')}"


def written(
    heading: Heading, steps: Sequence[tuple["Candidate", int]], remarks: Sequence[str] = (),
    why: Mapping[str, str] | None = None,
) -> str:  # fmt: skip
    """Return the text of a protocol; ``remarks`` are paragraphs at its top, ``why`` a comment on every label."""
    lines = [f"# Question: {heading.question}"]
    for remark in remarks:
        lines += ["#", *_comment(remark)]
    lines += [
        "spec: 1", f"title: {quoted(heading.title)}", f"question: {quoted(heading.question)}",
        f"rig: {quoted(heading.rig)}",
    ]  # fmt: skip
    lines += [f"device: {quoted(heading.device)}"] if heading.device else []
    lines.append(f"limits: {{{', '.join(f'{key}: {value}' for key, value in heading.limits.items())}}}")
    lines.append(f"acquisition: {{rate: {heading.rate}}}")
    lines += [f"ramp: {heading.ramp}"] if heading.ramp else []
    lines.append("steps:")
    seen: Counter[str] = Counter()
    for candidate, repeats in steps:
        name = label(candidate)
        seen[name] += 1
        apart = name if seen[name] == 1 else f"{name}, another ({seen[name]})"
        lines += _comment((why or {}).get(name, ""), "  ")
        lines += [f"  - label: {quoted(apart)}", f"    repeats: {repeats}", *_stimulus(candidate)]
    return "\n".join(lines) + "\n"


def exact(value: float, unit: str) -> str:
    """Return a quantity that reads back as the same float, whole numbers without a point."""
    return WHOLE.sub("", with_unit(value, unit))


def quoted(text: str) -> str:
    """Return text as YAML takes it for text, whatever stands in it."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


def _comment(text: str, indent: str = "") -> list[str]:
    return [f"{indent}# {line}" for line in wrap(text, WIDTH - len(indent), break_long_words=False)]


def _stimulus(candidate: "Candidate") -> list[str]:
    """Return the lines of one stimulus."""
    from identify.planning.candidates import Chord, Stairs, Tone

    match candidate:
        case Stairs():
            return _stairs(candidate)
        case Tone():
            return _tone(candidate)
        case Chord():
            return _chord(candidate)
    assert_never(candidate)


def _stairs(walk: "Stairs") -> list[str]:
    levels = wrap(", ".join(exact(level, "V") for level in walk.levels_v), WIDTH - 16)
    inside = f"\n{'':16}".join(levels)
    return ["    staircase:", f"      levels: [{inside}]", f"      dwell: {exact(walk.dwell_s, 's')}"]


def _tone(tone: "Tone") -> list[str]:
    size = f"frequency: {exact(tone.frequency_hz, 'Hz')}, amplitude: {exact(tone.amplitude_v, 'V')}"
    rest = "" if tone.triangle else ", phase: -90 deg"
    rest += f", offset: {exact(tone.offset_v, 'V')}" if tone.offset_v else ""
    kind = "triangle" if tone.triangle else "sine"
    return [f"    {kind}: {{{size}, periods: {tone.periods}{rest}}}"]


def _chord(chord: "Chord") -> list[str]:
    lines = wrap(", ".join(exact(f, "Hz") for f in chord.frequencies_hz), WIDTH - 21)
    inside = f"\n{'':21}".join(lines)
    return [
        "    multisine:", f"      frequencies: [{inside}]", f"      peak: {exact(chord.peak_v, 'V')}",
        f"      time: {exact(chord.time_s, 's')}",
    ]  # fmt: skip
