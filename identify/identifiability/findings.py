"""What can these recordings not tell, and what holds it: a stated assumption, or the step that would settle it?

Two kinds, the second first: what no recording of u and y can tell, held by assumptions; and what these recordings did
not reach, with the step that would reach it. Between them stand the points of G1 and G2 that rest on the rig file's
orders.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import hypot

from identify.blocks import Play
from identify.fit import Fit
from identify.harmonic.sines import tones_of, untold_by_sines
from identify.identifiability.assumptions import assumed
from identify.identifiability.unexcited import few_levels, railed, unexcited
from identify.identifiability.visits import visits
from identify.identification import StairPoint, Unidentifiable
from identify.model import Backlash, Model
from identify.observe import Observation

DIFFERENT = 3.0  # standard deviations from which two slopes count as two


def unidentifiable(
    model: Model, fitted: Model, fit: Fit, observations: Sequence[Observation], stairs: Sequence[StairPoint],
    wider: float = 1.0,
) -> tuple[Unidentifiable, ...]:  # fmt: skip
    """Return every direction the data leave open; ``model`` is as the rig file has it, ``fitted`` as found.

    ``wider`` is by how much standard deviations widen where the model does not fit.
    """
    tones = tuple(tone for o in observations for tone in tones_of(o.trace, o.noise_v))
    where = visits(fit.chain, observations) if fit.chain.stage_of(Play) is not None else None
    return (
        *unexcited(fit, observations, tones, where), *few_levels(stairs, tones), *railed(stairs),
        *untold_by_sines(_with_equal_slopes(fitted, fit, wider), tones), *assumed(model, fit, observations),
    )  # fmt: skip


def _with_equal_slopes(model: Model, fit: Fit, wider: float) -> Model:
    """Return the model with one slope where the data do not tell two: a difference of that size separates nothing."""
    f, sd = model.f, wider * hypot(*(fit.sd(f"F.{name}") for name in ("S_L", "S_U")))
    if not isinstance(f, Backlash) or abs(f.s_l - f.s_u) > DIFFERENT * sd:
        return model
    slope = 0.5 * (f.s_l + f.s_u)
    return replace(model, f=replace(f, s_l=slope, s_u=slope))
