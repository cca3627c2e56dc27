"""What should the operator change before the next recording?"""

from collections.abc import Sequence

import numpy as np

from identify.blocks import Play
from identify.chain import Chain, signals
from identify.fit import Fit
from identify.natural_units import shown
from identify.noise import Noise, period_of
from identify.observe import Observation
from identify.stage import Place

FITS = 1.1  # residual over noise up to which a model counts as fitting


def misfit(rms_v: float, noise: Noise) -> list[str]:
    """Return a warning when the model does not fit: its values and intervals then mean little."""
    if rms_v <= FITS * noise.rms_v:
        return []
    return [
        f"the model leaves {rms_v / noise.rms_v:.3g} times the noise: these are the values of a model that does not "
        "fit; `rig explain` looks for what is missing"
    ]


def warnings(fit: Fit, observations: Sequence[Observation]) -> list[str]:
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
