"""What are the borders in the paper's scale, where only what the data can tell is left free (eq. 5)?"""

from identify.blocks import Play
from identify.fit import Fit
from identify.interval import Interval
from identify.model import Model

BORDERS = ("S_L", "D_L", "S_U", "D_U")


def scaled_borders(model: Model, fit: Fit, wider: float) -> tuple[dict[str, Interval], dict[str, Interval]]:
    """Return the borders in the rig file's scale, and with abs(G1(0)) = abs(G2(0)) = 1 as in the paper."""
    if fit.chain.stage_of(Play) is None:
        return {}, {}
    own = {n: Interval(fit.chain.values[f"F.{n}"], *fit.ci95(f"F.{n}", wider)) for n in BORDERS}
    gains = {"S": abs(model.g1.dc_gain * model.g2.dc_gain), "D": 1.0 / abs(model.g1.dc_gain)}
    return own, {n: _scaled(i, gains[n[0]]) for n, i in own.items()}


def _scaled(interval: Interval, gain: float) -> Interval:
    """Return an interval in another scale."""
    ends = sorted((interval.low * gain, interval.high * gain))
    return Interval(interval.value * gain, ends[0], ends[1])
