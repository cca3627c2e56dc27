"""Which sines were played, and what do they leave untold of G1 and G2, in words?

The rational form of a rig file holds what sines alone leave open; a reader who doubts that form, or whose blocks have
none, must know which points rest on it. The same question can be asked of a plan, before anything is played.
"""

from collections.abc import Sequence
from math import isfinite

from identify.harmonic.harmonics import threshold_v
from identify.harmonic.separability import Separability, Tone, at, freed_above_v, second_amplitude, separability
from identify.identification import Unidentifiable
from identify.model import Backlash, Model
from identify.natural_units import shown
from identify.planning.excitation import Wave, excitations, named_steps
from identify.trace import Trace

MOST = 6  # frequencies written out
ROOM = 1.3  # a proposed sine has this much more than frees the gap


def tones_of(trace: Trace, noise_v: float) -> tuple[Tone, ...]:
    """Return the sines of a recording or a plan, the repeats of one step together."""
    found = []
    for wave in excitations(trace):
        if isinstance(wave, Wave) and wave.is_sine:
            samples = sum(step.stop - step.start for step in named_steps(trace) if step.label == wave.label)
            hz = float(f"{float(wave.lines_hz[0]):.9g}")  # of a whole number of periods and samples
            found.append(Tone(hz, float(abs(wave.amplitudes[0])), samples, trace.rate_hz, noise_v, wave.offset_v))
    return tuple(found)


def untold_by_sines(model: Model, tones: Sequence[Tone], largest_v: float | None = None) -> tuple[Unidentifiable, ...]:
    """Return what ``tones`` leave open on a rig near ``model``: nothing where there is no sine or no straight backlash.

    ``largest_v`` is the largest amplitude to propose; without it the largest of ``tones``.
    """
    if not tones or not isinstance(model.f, Backlash):
        return ()
    largest_v = largest_v or max(tone.amplitude_v for tone in tones)
    try:
        found = separability(model, tones)
        return (*_still(model, found, largest_v), *_gains(model, tones, found, largest_v),
                *_phases(model, found, largest_v))  # fmt: skip
    except ValueError:  # borders that cross within reach have no closed form, and nothing is claimed of them
        return ()


def _still(model: Model, found: Separability, largest_v: float) -> list[Unidentifiable]:
    """Return the frequencies at which F never moves."""
    assert isinstance(model.f, Backlash)
    moved, told = {p.frequency_hz for p in found.points if p.block == "G1"}, []
    for tone in found.stuck:
        if tone.frequency_hz in moved:
            continue
        reached_v = tone.amplitude_v * float(abs(at(model.g1, tone.frequency_hz)))
        least_v = freed_above_v(model, tone.frequency_hz)
        beyond = "" if least_v <= largest_v else f", beyond the {shown(largest_v, 'V', 3)} used so far"
        told.append(Unidentifiable(
            f"G1 and G2 at {shown(tone.frequency_hz, 'Hz')}",
            f"F never moves: v swings by {shown(reached_v, 'V', 3)} at U = {shown(tone.amplitude_v, 'V', 3)}, and the "
            f"gap takes {shown(threshold_v(model.f), 'V', 3)}",
            f"an amplitude above {shown(least_v, 'V', 3)} at this frequency{beyond}",
        ))  # fmt: skip
    return told


def _gains(model: Model, tones: Sequence[Tone], found: Separability, largest_v: float) -> list[Unidentifiable]:
    """Return the frequencies at which |G1| cannot be told from |G2|."""
    untold = found.untold("G1", "gain")
    if not untold:
        return []
    free = [hz for hz in untold if not isfinite(found.sd_of("G1", hz, "gain"))]
    why = ("a larger |G1| with a smaller |G2| gives the same lines: each of these sines has one amplitude and shares "
           "too few harmonics with the others") if free else (
           "what would separate them drowns in the noise: |G1| is told to "
           f"{_percent(min(found.sd_of('G1', hz, 'gain') for hz in untold))} at best")  # fmt: skip
    return [Unidentifiable(
        f"|G1| against |G2| at {_listed(untold)}", why,
        "the orders of G1 and G2 in the rig file; without them " + _second(model, tones, untold, largest_v),
    )]  # fmt: skip


def _second(model: Model, tones: Sequence[Tone], untold: Sequence[float], largest_v: float) -> str:
    """Return the second amplitudes that would tell, with what they would tell."""
    proposed = []
    for hz in untold[:MOST]:
        found = second_amplitude(model, tones, hz, largest_v)
        if found is not None:
            more, sd = found
            proposed.append(f"{shown(hz, 'Hz')} also at {shown(more.amplitude_v, 'V', 3)} (|G1| to {_percent(sd)}"
                            " with the borders known)")
    if not proposed:
        return f"more periods or a larger amplitude than {shown(largest_v, 'V', 3)}"
    return f"a second amplitude, as in protocols/sine_ladder.yaml: {', '.join(proposed)}"


def _phases(model: Model, found: Separability, largest_v: float) -> list[Unidentifiable]:
    """Return the frequencies whose phases stand in no relation to that of the lowest."""
    untold = found.untold("G1", "phase")
    if not untold:
        return []
    lowest = min(p.frequency_hz for p in found.points if p.block == "G1")
    third_v = ROOM * freed_above_v(model, 3.0 * lowest)
    meeting = f"sines whose odd harmonics meet, as {shown(lowest, 'Hz')} and {shown(3.0 * lowest, 'Hz')}"
    within = f"{meeting} at {shown(third_v, 'V', 3)}" if third_v <= largest_v else meeting
    return [Unidentifiable(
        f"phase of G1 at {_listed(untold)} against that at {shown(lowest, 'Hz')}",
        "they share no harmonic, so a delay of its own in each goes unnoticed",
        f"the orders of G1 and G2 in the rig file; without them {within}",
    )]  # fmt: skip


def _percent(share: float) -> str:
    """Return a share in per cent."""
    return f"{float(f'{100.0 * share:.2g}'):g} %"


def _listed(frequencies_hz: Sequence[float]) -> str:
    """Return frequencies in words, the first few written out."""
    words = [shown(hz, "Hz") for hz in frequencies_hz[:MOST]]
    if len(frequencies_hz) > MOST:
        return f"{', '.join(words)} and {len(frequencies_hz) - MOST} more"
    return " and ".join(filter(None, (", ".join(words[:-1]), words[-1])))
