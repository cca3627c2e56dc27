"""Which physics is concealed in which rig, and what must an honest explainer answer?"""

from dataclasses import dataclass
from functools import cached_property

from tests.proof.rigs import LINEAR, ONE_SLOPE, OP_AMP, RC, SKEWED, Rig, toleranced
from tests.proof.stimuli import Stimulus, held_out, training


@dataclass(frozen=True)
class Concealed:
    """Physics by its name in physics.WHERE, and its true values in SI units."""

    name: str
    values: dict[str, float]


@dataclass(frozen=True)
class Finding:
    """What must be found: the public id, the stage as the report calls it, and the true parameters in SI units."""

    id: str
    stage: str
    parameters: dict[str, float]


@dataclass(frozen=True)
class Case:
    """One blind trial. ``nominal`` is the rig file given to the explainer, ``rig`` what stands on the bench.

    ``expected`` names what the library knows; physics without it is outside the library and must end unnamed.
    """

    name: str
    nominal: Rig
    physics: tuple[Concealed, ...]
    expected: tuple[Finding, ...]
    seed: int

    @cached_property
    def rig(self) -> Rig:
        """Return the rig as built, its parts off the nominal by up to 2 %."""
        return toleranced(self.nominal, self.seed)

    @cached_property
    def training(self) -> tuple[Stimulus, ...]:
        """Return the stimuli a model may be fitted to."""
        return training()

    @cached_property
    def held_out(self) -> tuple[Stimulus, ...]:
        """Return the stimuli kept for the proof."""
        return held_out()

    @property
    def verdict(self) -> str:
        """Return the verdict that is right: consistent, explained or unexplained."""
        if not self.physics:
            return "consistent"
        return "explained" if self.expected else "unexplained"


def _known(name: str, nominal: Rig, seed: int, *parts: tuple[str, str, str, dict[str, float]]) -> Case:
    """Return a case of physics inside the library: (name in WHERE, id, stage, values) each."""
    physics = tuple(Concealed(what, values) for what, _, _, values in parts)
    return Case(name, nominal, physics, tuple(Finding(i, stage, values) for _, i, stage, values in parts), seed)


def _unknown(name: str, nominal: Rig, seed: int, what: str, values: dict[str, float]) -> Case:
    """Return a case of physics outside the library."""
    return Case(name, nominal, (Concealed(what, values),), (), seed)


CLEAN = (Case("clean, op-amp", OP_AMP, (), (), 101), Case("clean, skewed", SKEWED, (), (), 102))

LIBRARY = (
    _known("saturation", OP_AMP, 111, ("saturation", "saturation", "F", {"upper": 13.46, "lower": -17.13})),
    _known("soft_saturation", OP_AMP, 112, ("soft_saturation", "soft_saturation", "F", {"level": 47.3})),
    _known("soft_saturation, upper", SKEWED, 113, ("soft_saturation, upper", "soft_saturation", "F", {"level": 43.7})),
    Case(  # the bench knows R I_s, the library where the diode conducts as well as R does: n V_T ln(n V_T / (R I_s))
        "diode_clamp", OP_AMP, (Concealed("diode_clamp", {"drop": 1.3e-5, "knee": 1.27}),),
        (Finding("diode_clamp", "F", {"n_vt": 1.27, "knee": 14.592}),), 123,
    ),
    _known("plateau_droop, leak", OP_AMP, 114, ("leak", "plateau_droop", "F", {"rate": 0.097})),
    _known("plateau_droop, bias current", OP_AMP, 115, ("bias current", "plateau_droop", "F", {"current": 0.53})),
    _known("plateau_droop, leak across", OP_AMP, 160, ("leak across", "plateau_droop", "F", {"rate": 0.13})),
    _known("dead_time", RC, 116, ("dead_time", "dead_time", "G2", {"delay": 173e-6})),
    _known("extra_pole, G1", RC, 117, ("extra_pole in G1", "extra_pole", "G1", {"tau": 0.77e-3})),
    _known("extra_pole, G2", RC, 118, ("extra_pole in G2", "extra_pole", "G2", {"tau": 0.57e-3})),
    _known(
        "capacitor_nonlinearity, G1", OP_AMP, 161,
        ("nonlinear capacitor in G1", "capacitor_nonlinearity", "G1", {"k2": 0.0057, "tau": 0.0193}),
    ),
    _known(
        "capacitor_nonlinearity, G2", RC, 162,
        ("nonlinear capacitor in G2", "capacitor_nonlinearity", "G2", {"k2": -0.0011, "tau": 0.00213}),
    ),
    _known("self_heating, G1", OP_AMP, 164, ("self-heating in G1", "self_heating", "G1", {"k": 0.0021, "tau": 0.21})),
    _known("self_heating, F", RC, 165, ("self-heating in F", "self_heating", "F", {"k": -1.3e-4, "tau": 0.087})),
    _known("feedthrough", OP_AMP, 119, ("feedthrough", "feedthrough", "sense", {"k": 0.0137})),
    _known(
        "hum, sense", OP_AMP, 120,
        ("hum at sense", "hum", "sense", {"frequency": 50.013, "amplitude": 0.047, "third": 0.0146, "fifth": 0.0081}),
    ),
    _known(
        "hum, G1", SKEWED, 121,
        ("hum at G1", "hum", "G1", {"frequency": 49.991, "amplitude": 0.0113, "third": 0.0027, "fifth": 0.0016}),
    ),
    _known(
        "hum, F", OP_AMP, 163,
        ("hum at F", "hum", "F", {"frequency": 60.011, "amplitude": 0.0213, "third": 0.0047, "fifth": 0.0026}),
    ),
    _known("second_play", OP_AMP, 132, ("second_play", "second_play", "F", {"gap": 3.575, "weight": 0.067})),
    _known("slew_limit", OP_AMP, 133, ("slew_limit", "slew_limit", "F", {"rate": 2310.0})),
    _known("absorption", OP_AMP, 134, ("absorption", "dielectric_absorption", "F", {"fraction": 0.043, "tau": 0.083})),
    _known(
        "absorption on plateaus", SKEWED, 139,
        ("absorption on plateaus", "dielectric_absorption", "F", {"fraction": 0.031, "tau": 0.037}),
    ),
    _known("diode_contact", OP_AMP, 193, ("diode_contact", "diode_contact", "F", {"n_vt": 0.0041})),
    _known("rate_dependent_gap", RC, 140, ("rate_dependent_gap", "rate_dependent_gap", "F", {"k": 2.1e-4})),
    Case(  # compared by name only: what chance does in one recording moves the values more than their intervals tell
        "process_noise", OP_AMP, (Concealed("process_noise", {"sd": 0.011, "bandwidth": 730.0}),),
        (Finding("process_noise", "G1", {}),), 143,
    ),
    Case(
        "backlash", LINEAR, (Concealed("backlash", {"D_L": 0.21, "D_U": -0.13}),),
        (Finding("backlash", "F", {"D_L": 0.21, "D_U": -0.13}),), 145,
    ),
    _known("unequal_slopes", ONE_SLOPE, 146, ("unequal_slopes", "unequal_slopes", "F", {"ratio": 1.031})),
    _known("curved_border", OP_AMP, 131, ("curved_border", "curved_border", "F", {"k3": 0.021})),
    _known("soft_knee", SKEWED, 147, ("soft_knee", "soft_knee", "F", {"width": 0.43})),
    _known("plateau_tilt", RC, 148, ("plateau_tilt", "plateau_tilt", "F", {"k": 0.021})),
    _known("offset_drift", SKEWED, 122, ("offset_drift", "offset_drift", "sense", {"rate": 4.7e-3})),
    _known("gain_drift", SKEWED, 136, ("gain_drift", "gain_drift", "sense", {"rate": 8.3e-4})),
    _known("rectifying_sensor", OP_AMP, 137, ("rectifying_sensor", "rectifying_sensor", "sense", {"lost": 0.019})),
    Case(
        "adc_quantisation", OP_AMP, (Concealed("adc_quantisation", {"lsb": 0.087}),),
        (Finding("adc_quantisation", "sense", {"LSB": 0.087}),), 126,
    ),
    Case(
        "ac_coupling", SKEWED, (Concealed("ac_coupling", {"tau": 37.0}),),
        (Finding("ac_coupling", "sense", {"T": 37.0}),), 138,
    ),
    _known("adc_clipping", OP_AMP, 124, ("adc_clipping", "adc_clipping", "sense", {"upper": 12.13, "lower": -13.04})),
    _known(
        "adc_nonlinearity", RC, 125, ("adc_nonlinearity", "adc_nonlinearity", "sense", {"k2": -3.1e-5, "k3": 9.3e-6})
    ),
    _known("dac_quantisation", OP_AMP, 158, ("dac_quantisation", "dac_quantisation", "source", {"lsb": 0.0117647})),
    _known("source_pole", RC, 151, ("source_pole", "source_pole", "source", {"tau": 0.31e-3})),
    _known("source_nonlinearity", OP_AMP, 152, ("source_nonlinearity", "source_nonlinearity", "source", {"k": 9.3e-5})),
    Case(
        "input_ac_coupling", SKEWED, (Concealed("input_ac_coupling", {"tau": 17.0}),),
        (Finding("input_ac_coupling", "source", {"T": 17.0}),), 153,
    ),
    _known(
        "input_clipping", OP_AMP, 154, ("input_clipping", "input_clipping", "source", {"upper": 5.71, "lower": -7.93})
    ),
    _known("resonance, G1", RC, 155, ("resonance in G1", "resonance", "G1", {"w_n": 2310.0, "zeta": 0.19})),
    _known("adc_averaging", OP_AMP, 194, ("adc_averaging", "adc_averaging", "sense", {"length": 2.3e-3})),
    _known("resonance, G2", OP_AMP, 135, ("resonance in G2", "resonance", "G2", {"w_n": 1430.0, "zeta": 0.27})),
    _known("clock_skew, fast ADC", OP_AMP, 156, ("clock_skew", "clock_skew", "sense", {"ppm": 217.0})),
    _known("clock_skew, slow ADC", SKEWED, 157, ("clock_skew", "clock_skew", "sense", {"ppm": -231.0})),
)  # fmt: skip

OUTSIDE = (
    _unknown("crosstalk", OP_AMP, 159, "crosstalk", {"size": 0.217, "level": 0.73}),
)

PAIRS = (
    _known(
        "saturation and hum", OP_AMP, 141,
        ("saturation", "saturation", "F", {"upper": 13.42, "lower": -17.34}),
        ("hum at sense", "hum", "sense", {"frequency": 49.988, "amplitude": 0.036, "third": 0.0098, "fifth": 0.0043}),
    ),
)  # fmt: skip

IN_RED_NOISE = _known(
    "absorption in red noise", OP_AMP, 171,
    ("absorption in G1", "dielectric_absorption", "G1", {"fraction": 0.0043, "tau": 0.0117}),
    ("coloured_noise", "coloured_noise", "sense", {"sd": 0.0083, "slope": 1.83}),
)  # fmt: skip

CASES = (*CLEAN, *LIBRARY, *OUTSIDE, *PAIRS, IN_RED_NOISE)
