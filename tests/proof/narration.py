"""How is one answered trial told in one line, while the study runs?"""

import json
from typing import Any


def shown(entry: dict[str, Any]) -> str:
    """Return an answered trial in one line."""
    truth, reply = json.loads(entry["truth"]), entry["reply"]
    laws = zip(truth["laws"], truth["z"], strict=True)
    values = "; ".join(f"{c['name']} {_short(c['values'])} z {z:.0f}" for c, z in laws)
    if not reply["said"]:
        return f"{entry['trial']} [{values}] FAILED {reply['failure'].splitlines()[-1]}"
    said = reply["said"]
    found = "; ".join(_told(effect) for effect in said["effects"])
    held = said["fit"]["held_out"]
    return (
        f"{entry['trial']} [{values}] {said['verdict']} [{found}] held {held['before'] / held['noise']:.3f} -> "
        f"{held['after'] / held['noise']:.3f} x noise, {reply['seconds']:.0f} s"
    )


def _told(effect: dict[str, Any]) -> str:
    intervals = ((name, i["value"], *i["ci95"]) for name, i in effect["parameters"].items())
    values = ", ".join(f"{name} {_number(at)} ({_number(low)}..{_number(high)})" for name, at, low, high in intervals)
    others = "".join(f" | {o['id']}@{o['stage']} {o['probability']:.2f}" for o in effect["could_also_be"])
    return f"{effect['id']}@{effect['stage']} {effect['probability']:.2f} {values}{others}"


def _short(values: dict[str, float]) -> str:
    return ", ".join(f"{name} {value:.4g}" for name, value in values.items())


def _number(value: float | None) -> str:
    """Return a number in four digits; JSON has none for what has no bound."""
    return "-" if value is None else f"{value:.4g}"
