"""Which assumption holds what no recording of u and y can tell, and how is it said?

Each finding is there because a probe's effect on these recordings is that of something else (``directions``): with
values held in the rig file, or a start from rest, some of them are told and then not listed.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import inf

from identify.bent.curved import SIDES, CurvedPlay
from identify.blocks import Gain, LinearBlock, Play
from identify.delay import delay_s
from identify.fit import Fit
from identify.identifiability.directions import Mimic, likeness, mimics
from identify.identifiability.probes import DELAYS, GAINS, OFFSETS
from identify.identification import Unidentifiable
from identify.model import CurvedBacklash, Model
from identify.natural_units import shown, shown_interval
from identify.observe import Observation
from identify.uncertainty.normalised import rational_of

SHARE = 0.1  # of the half gap: an offset known better than that is told


def assumed(model: Model, fit: Fit, observations: Sequence[Observation]) -> list[Unidentifiable]:
    """Return what ``model``, as the rig file has it, holds by assumption in a fit to these recordings."""
    found = {m.probe: m for m in mimics(likeness(fit, observations), _needed_v(fit))}
    told = []
    if DELAYS[0] in found:
        told += _delay(model, fit, observations)
    if any(name in found for name in GAINS):
        told.append(_with_facts(_gain(model), observations, "gain"))
    if OFFSETS[0] in found or fit.chain.stage_of(CurvedPlay) is not None:
        told.append(_with_facts(_offset_of_u(fit), observations, "offset"))
    if OFFSETS[1] in found or fit.chain.stage_of(Gain) is not None:
        told.append(_offset_of_y(fit, found.get(OFFSETS[1])))
    return told + _of_shape(model, fit) + _exchange(fit)


def _needed_v(fit: Fit) -> dict[str, float]:
    """Return how well an offset of u and of y must be told, V: against the gap, where there is one."""
    if fit.chain.stage_of(Play) is None:
        return dict.fromkeys(OFFSETS, inf)
    values = fit.chain.values
    half_v = SHARE * 0.5 * abs(values["F.D_L"] - values["F.D_U"])
    before, behind = (abs(rational_of(fit.chain, name).dc_gain) for name in ("G1", "G2"))
    slope = 0.5 * (values["F.S_L"] + values["F.S_U"])
    return {OFFSETS[0]: half_v / before, OFFSETS[1]: half_v * slope * behind}


def _delay(model: Model, fit: Fit, observations: Sequence[Observation]) -> list[Unidentifiable]:
    """Return that only the sum of all delays is told, where it is put, and where the rig file puts it.

    Nothing where the device's own is known and no other was looked for: there is none to be shared.
    """
    devices = {o.trace.device if o.trace.device and not o.trace.device.unused else None for o in observations}
    if None not in devices and delay_s(fit.chain) == 0.0 and model.g1.dead_time_s == 0.0:
        return []
    kept = "G1 assumed without dead time, all of it given to G2"
    first_s, second_s = model.g1.dead_time_s, model.g2.dead_time_s
    if first_s:
        there = f"{shown(first_s, 's')} to G1" + (f" and {shown(second_s, 's')} to G2" if second_s else "")
        kept = f"{kept}; the rig file gives {there}"
    elif delay_s(fit.chain) == 0.0:
        kept = f"{kept}; the rig file gives none, so 0 s in all"
    for device in devices - {None}:
        kept += f"; the device's own {shown_interval(device.late, 's')} is left out: {device.origin}" if device else ""
    return [Unidentifiable(
        "delay shared between G1 and G2",
        "F does not care how fast it is driven, so a delay before it gives the same output as one behind it", kept,
    )]  # fmt: skip


def _with_facts(told: Unidentifiable, observations: Sequence[Observation], name: str) -> Unidentifiable:
    """Return the same with what is known of the devices: output and input together, so not which of them it is."""
    known = dict.fromkeys(o.trace.device for o in observations if o.trace.device is not None)
    facts = [(value, unit, device) for device in known for fact, value, unit in device.facts if fact == name]
    whose = f"; of the device, output and input together, {name}"
    beside = "".join(f"{whose} {shown_interval(value, unit)}: {device.origin}" for value, unit, device in facts)
    return replace(told, fixed_by=told.fixed_by + beside)


def _gain(model: Model) -> Unidentifiable:
    """Return that only products of gains are told."""
    return Unidentifiable(
        "gain shared between G1, F and G2",
        "a gain before F stretches its gap, one behind it its slopes: only the products reach the reading",
        f"G1(0) = {model.g1.dc_gain:.4g} and G2(0) = {model.g2.dc_gain:.4g} as in the rig file; normalised values take "
        "V_p = 1 and G2(0) = 1",
    )  # fmt: skip


def _offset_of_u(fit: Fit) -> Unidentifiable:
    """Return that a constant at u is a shift of F along v."""
    if fit.chain.stage_of(Gain) is not None:
        return Unidentifiable(
            "offset of u against that of F", "a constant added to u ends as a constant added to y",
            "the source assumed to put out 0 V where u is 0 V; a voltmeter at the source",
        )  # fmt: skip
    borders = "D_L and D_U" if fit.chain.stage_of(Play) is not None else "both borders"
    return Unidentifiable(
        f"offset of u against {borders}", f"a constant added to u shifts {borders} equally; only the gap is free of it",
        "the source assumed to put out 0 V where u is 0 V; a voltmeter or a loopback cable at the source",
    )  # fmt: skip


def _offset_of_y(fit: Fit, found: Mimic | None) -> Unidentifiable:
    """Return that a constant at y is taken for something of F; for an offset of F, which has stood there for ever."""
    if found is None or fit.chain.stage_of(Play) is None:
        return Unidentifiable(
            "offset of y against that of F", "a constant added to y gives the same readings",
            "the reading assumed without offset; a reading with its input shorted",
        )  # fmt: skip
    return Unidentifiable(
        f"offset of y against {_words(found.by)}",
        "a constant added to y gives the same readings as borders raised by it: F is never seen at rest at 0 V",
        "the reading assumed without offset; a run that starts at rest at 0 V and first stays inside the gap, or a "
        "reading with its input shorted",
    )  # fmt: skip


def _words(names: Sequence[str]) -> str:
    """Return parameter names as the report writes them: borders without their owner."""
    short = [name.removeprefix("F.") if name[:3] in ("F.S", "F.D") else name for name in sorted(names)]
    return ", ".join(short) if short else "everything else"


def _of_shape(model: Model, fit: Fit) -> list[Unidentifiable]:
    """Return what the shape of bent borders leaves open."""
    stage = fit.chain.stage_of(CurvedPlay)
    if stage is None:
        return []
    borders = zip(SIDES.values(), (stage.start.loading, stage.start.unloading), strict=True)
    ends = [f"the {name} border outside {points[0][0]:.4g} to {points[-1][0]:.4g} V" for name, points in borders]
    given = (*model.f.loading, *model.f.unloading) if isinstance(model.f, CurvedBacklash) else ()
    kept = {v for v, _ in (*stage.start.loading, *stage.start.unloading)}
    dropped = ", ".join(f"{v:.4g}" for v, _ in given if v not in kept)
    because = f"no run rides a border at the rig file's points at v = {dropped} V" if dropped else "no knot lies there"
    return [
        Unidentifiable(
            "bent borders against a rising law right behind F", "such a law after F is F with bent borders, exactly",
            "all of the bend given to the borders",
        ),
        Unidentifiable(" and ".join(ends), because, "each goes on straight"),
    ]


def _exchange(fit: Fit) -> list[Unidentifiable]:
    """Return, where F is a straight line, that blocks may change places."""
    blocks = [s for s in fit.chain.stages if isinstance(s, LinearBlock)]
    if fit.chain.stage_of(Gain) is None or any(len(block.start.den) < 2 for block in blocks):
        return []
    return [Unidentifiable(
        "which poles are G1's and which G2's", "F is a straight line, so the blocks may change places without a trace",
        "their orders and starting values in the rig file",
    )]  # fmt: skip
