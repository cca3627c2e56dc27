"""Contact through a diode that no feedback corrects: the gap widens with the logarithm of the speed, and creeps."""

from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar, final

from identify.altered_play import Law
from identify.effects.effect import Confusion
from identify.effects.inside_play import InsidePlay, gap_v
from identify.stage import Grid, Parameter, Place, Values

if TYPE_CHECKING:
    from identify.evidence import Evidence

N_VT = Parameter("diode_contact.n_vt", "V", "log")
TRIED = (0.001, 0.003, 0.01, 0.03, 0.1)  # of the gap
SMALL = 1e-4  # of the gap: a voltage that acts in proportion to itself


@final
class DiodeContact(InsidePlay):
    """The capacitor that holds w is charged through diodes, their current exponential in the voltage that drives it.

    How much they let through at zero volts moves D_L and D_U alone: these are told for v at 100 V/s.
    """

    id = "diode_contact"
    title = "contact through a diode"
    equation = (
        "d(w/S)/dt = r (exp((v - D_L - w/S) / n_vt) - exp((w/S - v + D_U) / n_vt)), r = 100 V/s, "
        "S that of the border"
    )
    sentence = (
        "Contact is made through a diode that no feedback corrects: w comes later by {} of v for each factor of 2.7 in "
        "its speed, and creeps on where v rests. Take the feedback of the amplifier from behind the diode."
    )
    axis = "rate of w"
    excludes = ("process_noise", "soft_knee")
    fingerprint = "gap that widens with the logarithm of the speed, creep after every move"
    places = (Place.F,)
    declared = (N_VT,)
    absent: ClassVar = {"n_vt": 0.0}
    confused_with = (
        Confusion("rate_dependent_gap", "sines of one amplitude a decade apart, twice: a diode adds as much each time"),
        Confusion("soft_knee", "a sine at a tenth of the frequency: a knee does not move"),
        Confusion("dielectric_absorption", "steps back into the gap: a dielectric creeps there, too"),
        Confusion("process_noise", "a repeat: what noise makes is another each time"),
    )
    example: ClassVar = {"n_vt": 0.03}

    def altered(self, law: Law, values: Values, grid: Grid) -> Law:
        """Return the law whose borders act through diodes."""
        return replace(law, diode_v=values[0])

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the voltage that explains most: of those tried, and of the one to which a small one points."""
        wide_v = gap_v(evidence.chain)
        return self.likeliest(evidence, "n_vt", SMALL * wide_v, [share * wide_v for share in TRIED]) if wide_v else []
