"""Which rig made these recordings? Staircase first, then all runs together (paper sections 4 and 5)."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from identify.blocks import LinearBlock, Play
from identify.chain import Chain, model_of, signals
from identify.effects import chain_of, physics_in
from identify.explain.select import Bench, Hypothesis
from identify.fit import Fit, chi_squared
from identify.holdout import counted, settling_s
from identify.identification import Identification, StairPoint, Unidentifiable
from identify.inflation import inflation
from identify.interval import Interval
from identify.model import Model
from identify.natural_units import shown
from identify.noise import Noise, noise_of, period_of
from identify.observe import Observation, pooled_rms
from identify.response import played_hz, points
from identify.stage import Place
from identify.staircase import borders, staircase
from identify.trace import Trace, intersample_of

BORDERS = ("S_L", "D_L", "S_U", "D_U")
FITS = 1.1  # residual over noise up to which a model counts as fitting
UNSEEN = 0.7  # share of its prior's width above which a parameter was not determined by the data


def identify(
    model: Model, traces: Sequence[Trace], progress: Callable[[str, float], None] | None = None
) -> Identification:
    """Return the model refitted to all recordings at once, with intervals and what they cannot tell.

    Raises ValueError with one sentence when the recordings cannot be used.
    """
    with threadpool_limits(1, "blas"):
        return _identified(model, traces, progress or (lambda sentence, share: None))


def _identified(model: Model, traces: Sequence[Trace], note: Callable[[str, float], None]) -> Identification:
    """Read the staircase, fit, and write the answer."""
    note("reading the staircase", 0.05)
    observations, noise = observed(model, traces)
    stairs = tuple(p for o in observations for p in staircase(o, settling_s(model)))
    note("fitting all runs together", 0.2)
    bench, found = fitted(model, observations, stairs)
    note("writing the answer", 0.9)
    return _answer(model, bench, found, stairs, noise)


def observed(model: Model, traces: Sequence[Trace]) -> tuple[tuple[Observation, ...], Noise]:
    """Return every recording with its usable samples, and the noise they share; ValueError when none is usable."""
    if not traces:
        raise ValueError("no recording was given")
    noise = noise_of(traces, settling_s(model), model.noise_v)
    found = tuple(Observation(t, counted(t, model), noise.rms_v) for t in traces)
    if not any(o.count for o in found):
        raise ValueError("no sample is left to look at: the recordings are shorter than the rig takes to settle")
    return tuple(o for o in found if o.count), noise


def fitted(
    model: Model, observations: tuple[Observation, ...], stairs: Sequence[StairPoint]
) -> tuple[Bench, Hypothesis]:
    """Fit all runs from the rig file's values or from the staircase's borders, whichever is nearer to the data."""
    chain = chain_of(model, intersample_of([o.trace for o in observations]))
    bench = Bench(chain, observations, model.fixed, ())
    coarse = bench.fitted(_nearer(model, chain, observations, stairs), ())
    bench = bench.refined(coarse.fit.chain)
    return bench, bench.fitted(coarse.fit.chain, ())


def _nearer(model: Model, chain: Chain, observations: Sequence[Observation], stairs: Sequence[StairPoint]) -> Chain:
    """Return the chain with the borders that leave the smaller residual."""
    if chain.stage_of(Play) is None:
        return chain
    from_stairs = borders(stairs, model.g1.dc_gain, model.g2.dc_gain)
    other = chain.with_values({k: v for k, v in from_stairs.items() if k not in model.fixed and "F" not in model.fixed})
    return min((chain, other), key=lambda c: sum(chi_squared(c, o) for o in observations))


def _answer(
    model: Model, bench: Bench, found: Hypothesis, stairs: tuple[StairPoint, ...], noise: Noise
) -> Identification:
    """Write the identification."""
    observations, fit = bench.observations, found.fit
    wider = inflation(found.fit.chain, observations)
    own, normalised = _borders(model, fit, wider)
    rms_v = pooled_rms([o.used_residual(fit.chain) for o in observations])
    spread_v = pooled_rms([o.trace.y[o.use] - np.mean(o.trace.y[o.use]) for o in observations])
    blocks = {s.name: s for s in fit.chain.stages if isinstance(s, LinearBlock)}
    frequencies = played_hz(observations, _corner_hz(model))
    refitted = replace(model_of(fit.chain, model), noise_v=noise.rms_v, physics=physics_in(fit.chain))
    return Identification(
        model=refitted, fit=fit, observations=observations, noise=noise, rms_v=rms_v,
        fit_percent=100.0 * (1.0 - rms_v / spread_v) if spread_v > 0.0 else 0.0, borders=normalised, own_scale=own,
        g1=points(fit, blocks["G1"], frequencies, wider), g2=points(fit, blocks["G2"], frequencies, wider),
        staircase=stairs, not_identifiable=unidentifiable(model, fit),
        warnings=(*_misfit(rms_v, noise), *_warnings(fit, observations)),
    )  # fmt: skip


def _borders(model: Model, fit: Fit, wider: float) -> tuple[dict[str, Interval], dict[str, Interval]]:
    """Return the borders in the rig file's scale, and with G1(0) = G2(0) = 1 as in the paper."""
    if fit.chain.stage_of(Play) is None:
        return {}, {}
    own = {n: Interval(fit.chain.values[f"F.{n}"], *fit.ci95(f"F.{n}", wider)) for n in BORDERS}
    gains = {"S": model.g1.dc_gain * model.g2.dc_gain, "D": 1.0 / model.g1.dc_gain}
    return own, {n: _scaled(i, gains[n[0]]) for n, i in own.items()}


def _scaled(interval: Interval, gain: float) -> Interval:
    """Return an interval in another scale."""
    ends = sorted((interval.low * gain, interval.high * gain))
    return Interval(interval.value * gain, ends[0], ends[1])


def _corner_hz(model: Model) -> float:
    """Return the slowest corner of G1 and G2, Hz."""
    poles = np.concatenate([np.roots(model.g1.den), np.roots(model.g2.den)])
    return float(np.min(np.abs(poles))) / (2.0 * np.pi) if poles.size else 1.0


def unidentifiable(model: Model, fit: Fit) -> tuple[Unidentifiable, ...]:
    """Return the directions the data cannot tell: those of every such rig, and parameters no run excited."""
    found = [
        Unidentifiable(
            "delay shared between G1 and G2", "a delay before F gives the same output as one behind it",
            f"G1 assumed with a dead time of {shown(model.g1.dead_time_s, 's')}",
        ),
        Unidentifiable(
            "gain shared between G1, F and G2", "only the product reaches the reading",
            f"G1(0) = {model.g1.dc_gain:.4g} and G2(0) = {model.g2.dc_gain:.4g} as in the rig file",
        ),
    ]  # fmt: skip
    for i, c in enumerate(fit.coordinates):
        if float(np.sqrt(fit.covariance[i, i])) > UNSEEN * c.prior_sd and not c.parameter.local:
            kept = f"the rig file's value {shown(c.centre, c.parameter.unit)} is kept"
            found.append(Unidentifiable(c.name, "no run excites it", kept))
    return tuple(found)


def _misfit(rms_v: float, noise: Noise) -> list[str]:
    """Return a warning when the model does not fit: its values and intervals then mean little."""
    if rms_v <= FITS * noise.rms_v:
        return []
    return [
        f"the model leaves {rms_v / noise.rms_v:.3g} times the noise: these are the values of a model that does not "
        "fit; `rig explain` looks for what is missing"
    ]


def _warnings(fit: Fit, observations: Sequence[Observation]) -> list[str]:
    """Return what the operator should change: a fit without a minimum, sines that leave the gap stuck."""
    found = [] if fit.converged else [f"the fit did not converge: {fit.sentence}"]
    if fit.chain.stage_of(Play) is not None:
        for observation in observations:
            found += _stuck(fit.chain, observation)
    return found


def _stuck(chain: Chain, observation: Observation) -> list[str]:
    """Return a warning for every periodic step during which F never moves."""
    trace, found = observation.trace, []
    taps = signals(chain, trace)
    v, w = taps[chain.index(Place.G1) - 1], taps[chain.index(Place.F) - 1]
    gap = chain.values["F.D_L"] - chain.values["F.D_U"]
    for step in trace.steps:
        middle = (step.start + step.stop) // 2
        u = trace.u[step.start : step.stop]
        swing = float(np.ptp(v[middle : step.stop]))
        if step.repeat == 0 and period_of(u) and float(np.ptp(w[middle : step.stop])) == 0.0 and swing > 0.0:
            amplitude = 0.5 * float(np.ptp(u))
            found.append(
                f"{step.label}: the gap is stuck at U = {shown(amplitude, 'V', 3)}, raise it above "
                f"{shown(amplitude * gap / swing, 'V', 3)}"
            )
    return found
