"""What is known of the devices that made the recordings, and was it used?"""

from collections.abc import Iterator, Sequence

from identify.natural_units import shown_interval
from identify.trace import KnownDevice, Trace


def devices_dict(traces: Sequence[Trace]) -> list[dict[str, object]]:
    """Return what is known of each recording's device, for JSON answers; recordings of unknown ones are left out."""
    return [
        {
            "run": trace.name, "from": known.origin, "delay": known.late.to_dict("s"), "used": not known.unused,
            "because": known.unused or None, **{name: value.to_dict(unit) for name, value, unit in known.facts},
        }
        for trace in traces if (known := trace.device) is not None
    ]  # fmt: skip


def device_lines(traces: Sequence[Trace]) -> Iterator[str]:
    """Tell what is known of the devices, each once."""
    for known in dict.fromkeys(trace.device for trace in traces):
        if known is not None:
            yield _line(known)


def _line(known: KnownDevice) -> str:
    facts = ", ".join(f"{name} {shown_interval(value, unit)}" for name, value, unit in known.facts)
    late = shown_interval(known.late, "s")
    told = f"not used: {known.unused}" if known.unused else "known, and no delay of the rig"
    return f"delay of the device {late}, {told} ({known.origin})" + (f"; as told: {facts}" if facts else "")
