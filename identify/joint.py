"""Which rig made these recordings? Staircase first, then all runs together (paper sections 4 and 5)."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import isclose

import numpy as np
from threadpoolctl import threadpool_limits

from identify.bent.bend import straight_values
from identify.bent.curved import CurvedPlay
from identify.bent.curves import Bend, Form, bend_of, bending, in_form
from identify.bent.reach import within_reach
from identify.blocks import LinearBlock
from identify.colour import WHITE, Grain, grains_of
from identify.delay import device_doubt_s, total_delay
from identify.effects import chain_of
from identify.fit import Fit, fit
from identify.harmonic.nonparametric import Evidence, nonparametric
from identify.heard import check_heard
from identify.held import told_held
from identify.holdout import counted, settling_s
from identify.identifiability.findings import unidentifiable
from identify.identification import Identification, OwnPoints, StairPoint
from identify.interval import Interval
from identify.model import Model
from identify.noise import Noise, noise_of
from identify.observe import Observation, pooled_rms
from identify.planning.advice import advice, bench_of, misfit, unsettled
from identify.planning.information import information
from identify.staircase import staircase
from identify.starts.early import sought
from identify.starts.orders import valued
from identify.starts.search import Judge, shortfall
from identify.starts.start import stabilised, started
from identify.stepping import settled
from identify.trace import Trace, intersample_of
from identify.uncertainty.certainty import Certainty, certainty, fitted_model, with_profiles
from identify.uncertainty.inflation import inflation
from identify.uncertainty.normalised import peak_interval, scale_of, scaled_borders
from identify.uncertainty.profile import Fitted
from identify.uncertainty.response import harmonics_hz, played_hz, points

BETTER = 9.0  # fall of chi-squared below which chance alone prefers another minimum to the one nearest the rig file


def identify(
    model: Model, traces: Sequence[Trace], progress: Callable[[str, float], None] | None = None,
    borders: Form | None = None, knots: int | None = None,
) -> Identification:  # fmt: skip
    """Return the model refitted to all recordings at once, with intervals and what they cannot tell.

    ``borders`` says of which form those of the backlash are to be, None: as the rig file has them; curved ones have
    ``knots`` points each, None: as many as the data pay for. Raises ValueError with one sentence when the recordings
    cannot be used.
    """
    with threadpool_limits(1, "blas"):
        note = progress or (lambda sentence, share: None)
        if model.unknown:
            note("looking for values to start from", 0.02)
        model, mirrored = stabilised(in_form(valued(model, traces), borders))
        answer = _identified(model, traces, note, borders == "curved", knots)
    held = told_held(traces, model, answer.noise.rms_v)
    return replace(answer, warnings=(*mirrored, *answer.warnings, *held))


def _identified(
    model: Model, traces: Sequence[Trace], note: Callable[[str, float], None], to_bend: bool, knots: int | None
) -> Identification:
    """Read the staircase, fit, and write the answer."""
    note("reading the staircase", 0.05)
    observations, noise = observed(model, traces)
    stairs = tuple(p for o in observations for p in staircase(o, settling_s(model), model.g1.dc_gain))
    note("fitting all runs together", 0.2)
    bend = None
    if to_bend:
        observations, found, bend = _bent(model, observations, stairs, noise, knots)
    else:
        observations, found = fitted(model, observations, stairs, noise.freedom)
    note("writing the answer", 0.9)
    return _answer(model, observations, found, stairs, noise, bend)


def _bent(
    model: Model, observations: tuple[Observation, ...], stairs: Sequence[StairPoint], noise: Noise, knots: int | None
) -> tuple[tuple[Observation, ...], Fit, Bend]:
    """Fit with borders bent where that pays.

    A straight fit that leaves more than noise is no reason to look for another start before its borders were bent.
    """
    finer, straight = fitted(model, observations, stairs, None)
    first = bending(model, straight, finer, noise, knots)
    if Judge(first[0], noise.freedom).at_noise(first[1]):
        return first
    finer, straight = fitted(model, observations, stairs, noise.freedom)
    return min(first, bending(model, straight, finer, noise, knots), key=lambda found: found[1].cost)


def observed(model: Model, traces: Sequence[Trace]) -> tuple[tuple[Observation, ...], Noise]:
    """Return every recording with its usable samples, and the noise they share; ValueError when none is usable."""
    if not traces:
        raise ValueError("no recording was given")
    noise = noise_of(traces, settling_s(model), model.noise_v)
    check_heard(model, traces, noise.rms_v)
    white, grains = Grain(noise.rms_v, WHITE), grains_of(traces, settling_s(model))
    each = [(trace, grains.get(trace.rate_hz, white)) for trace in traces]
    found = tuple(Observation(t, counted(t, model, grain.rms_v), grain.rms_v, colour=grain.colour) for t, grain in each)
    if not any(o.count for o in found):
        raise ValueError("no sample is left to look at: the recordings are shorter than the rig takes to settle")
    return tuple(o for o in found if o.count), _pooled(noise, found)


def _pooled(noise: Noise, observations: Sequence[Observation]) -> Noise:
    """Return the noise with the rms of a reading over all observations."""
    count = sum(o.count for o in observations)
    return replace(noise, rms_v=float(np.sqrt(sum(o.count * o.noise_v**2 for o in observations) / count)))


def fitted(
    model: Model, observations: tuple[Observation, ...], stairs: Sequence[StairPoint],
    freedom: float | None = float("inf"),
) -> tuple[tuple[Observation, ...], Fit]:  # fmt: skip
    """Fit all runs together; return the observations with what their grid leaves out, and the fit.

    Other starts are tried where the first ends above the noise, known as well as ``freedom`` readings tell it; None:
    the first has to do.
    """
    chain = chain_of(model, intersample_of([o.trace for o in observations]))
    start = started(model, chain, observations, stairs)
    first = within_reach(fit(start, observations, chain.values, model.fixed), observations, model.fixed)
    seen, found = settled(first, observations, model.fixed)
    better = found if freedom is None else sought(model, Judge(seen, freedom), found, start)
    if found.converged and found.cost - better.cost < BETTER:
        return seen, found
    return settled(within_reach(better, seen, model.fixed), seen, model.fixed)


def _answer(
    model: Model, observations: tuple[Observation, ...], found: Fit, stairs: tuple[StairPoint, ...], noise: Noise,
    bend: Bend | None,
) -> Identification:  # fmt: skip
    """Write the identification."""
    wider = inflation(found.chain, observations, noise.freedom)
    scale = scale_of(found, wider)
    if bend is None and found.chain.stage_of(CurvedPlay) is not None:
        bend = bend_of(found, wider)
    own, normalised = scaled_borders(found, scale, wider)
    rms_v = pooled_rms(piece for o in observations for piece in o.misfits(found.chain))
    spread_v = pooled_rms(piece for o in observations for piece in o.deviations())
    blocks = {s.name: s for s in found.chain.stages if isinstance(s, LinearBlock)}
    frequencies = played_hz(observations, _corner_hz(model))
    harmonics = harmonics_hz(frequencies, observations)
    sure = _certain(model, observations, found, wider)
    refitted = replace(fitted_model(found.chain, model), noise_v=noise.rms_v)
    told = information(found.chain, found.coordinates, observations)
    advised = advice(bench_of(refitted, straight_values(found.chain)), [o.trace for o in observations], told, stairs)
    return Identification(
        model=refitted, fit=found, observations=observations, noise=noise, rms_v=rms_v,
        fit_percent=100.0 * (1.0 - rms_v / spread_v) if spread_v > 0.0 else 0.0, borders=normalised, own_scale=own,
        g1=points(found, blocks["G1"], frequencies, wider, scale.v_p),
        g2=points(found, blocks["G2"], harmonics, wider, lambda chain: scale.g2_gain),
        delay=_delay(found, sure, wider, observations), bend=bend,
        staircase=stairs, not_identifiable=unidentifiable(model, refitted, found, observations, stairs, wider),
        own_points=_own_points(found, frequencies, harmonics, wider), certainty=sure,
        measured=nonparametric(Evidence(refitted, found, told, wider), observations, scale),
        warnings=(*_shortcomings(found, observations, noise, rms_v), *(a.sentence for a in advised if not a.remark)),
        advice=advised, steps=told.steps(),
    )  # fmt: skip


def _certain(model: Model, observations: tuple[Observation, ...], found: Fit, wider: float) -> Certainty:
    """Return how sure every number of the model is; by profile where its curvature does not say it."""
    centre = chain_of(model, intersample_of([o.trace for o in observations])).values
    fitted = Fitted(found, observations, centre, model.fixed, wider)
    return with_profiles(certainty(model, found, wider), model, fitted)


def _delay(found: Fit, sure: Certainty, wider: float, observations: Sequence[Observation]) -> Interval:
    """Return the sum of all dead times; by profile where that is G2's alone and was taken.

    What is not sure of a device's own delay is not sure of the rig's.
    """
    total, own = total_delay(found, wider), sure.profiled.get("G2.dead_time")
    told = own if own is not None and isclose(own.value, total.value) else total
    doubt_s = device_doubt_s([o.trace for o in observations]) if told.high > told.low else 0.0
    return replace(told, low=max(told.low - doubt_s, 0.0) if told.low >= 0.0 else told.low, high=told.high + doubt_s)


def _own_points(
    found: Fit, frequencies: Sequence[float], harmonics: Sequence[float], wider: float
) -> OwnPoints:
    """Return V_p, and both blocks in the scale of the rig file."""
    blocks = {s.name: s for s in found.chain.stages if isinstance(s, LinearBlock)}
    return OwnPoints(
        peak_interval(found, scale_of(found, wider), wider), points(found, blocks["G1"], frequencies, wider),
        points(found, blocks["G2"], harmonics, wider),
    )  # fmt: skip


def _shortcomings(
    found: Fit, observations: tuple[Observation, ...], noise: Noise, rms_v: float
) -> tuple[str, ...]:
    """Return in words in what the fit fell short."""
    return (*misfit(rms_v, noise), *shortfall(found, observations, noise.freedom), *unsettled(found))


def _corner_hz(model: Model) -> float:
    """Return the slowest corner of G1 and G2, Hz."""
    poles = np.concatenate([np.roots(model.g1.den), np.roots(model.g2.den)])
    return float(np.min(np.abs(poles))) / (2.0 * np.pi) if poles.size else 1.0
