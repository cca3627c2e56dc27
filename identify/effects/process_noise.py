"""Noise in front of the gap, rectified by it: the level is ratcheted outward."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar, Self, final

import numpy as np

from identify.altered_play import Law
from identify.chain import Chain
from identify.effects.effect import Confusion
from identify.effects.inside_play import InsidePlay, gap_v
from identify.innovations import Wander
from identify.observe import Observation
from identify.ratchet import Kind, renewal
from identify.stage import Grid, Parameter, Place, Values
from identify.trace import Array
from identify.wandering import wander_of

if TYPE_CHECKING:
    from identify.evidence import Evidence

SD = Parameter("process_noise.sd", "V", "log")
BANDWIDTH = Parameter("process_noise.bandwidth", "Hz", "log")
SMALL_V = 3e-3  # of the gap: noise at which the change is looked at
BANDS = (0.02, 0.3, 4.0)  # of the sample rate


@final
class ProcessNoise(InsidePlay):
    """The mean of what noise at v does to w: behind a first-order low-pass of a bandwidth, or white up to it."""

    id = "process_noise"
    title = "noise in front of the gap"
    equation = "w = mean of F(v + n), n normal with rms sd, low-passed at bandwidth or white up to it"
    sentence = (
        "There is noise in front of the gap: {}. The gap rectifies it: w is pushed past where v alone would take it, "
        "the further the longer v rests, so that the gap seems smaller and levels creep outward; filter or shield v."
    )
    axis = "rate of w"
    fingerprint = "F ratchets: the level creeps outward with hold time"
    places = (Place.G1,)
    brings = ("coloured_noise",)  # w wanders about its mean
    by_chance = True
    shapeless = True
    forms = ("low-pass", "white")
    declared = (SD, BANDWIDTH)
    absent: ClassVar = {"sd": 0.0, "bandwidth": 1e3}
    confused_with = (
        Confusion("resonance", "a staircase with two dwell times: ringing in G1 ends, a ratchet goes on"),
        Confusion("rate_dependent_gap", "a staircase with two dwell times: speed does not matter at rest"),
        Confusion("dielectric_absorption", "small steps inside the gap: a ratchet rests away from the borders"),
    )
    example: ClassVar = {"sd": 0.03, "bandwidth": 2e3}

    @property
    def shows_at(self) -> Place:
        """Return F: the mean of v stays as it is."""
        return Place.F

    @property
    def kind(self) -> Kind:
        """Return what noise it is."""
        return "white" if self.form == "white" else "low-pass"

    def altered(self, law: Law, values: Values, grid: Grid) -> Law:
        """Return the law whose borders shake."""
        sd_v, bandwidth_hz = values
        renewed = renewal(self.kind, bandwidth_hz, grid.step_s)
        return replace(law, noise_v=sd_v, kind=self.kind, renewed=renewed)

    def course(self, values: Sequence[float], grid: Grid, size: int, rng: np.random.Generator) -> Array:
        """Return a course of the noise at v, V, shape (size,)."""
        sd_v, bandwidth_hz = values
        over = np.fft.rfftfreq(size, grid.step_s) / bandwidth_hz
        passed = (over <= 1.0).astype(np.float64) if self.form == "white" else 1.0 / np.sqrt(1.0 + np.square(over))
        noise = np.fft.irfft(np.fft.rfft(rng.standard_normal(size)) * passed, size)
        return np.asarray(sd_v * noise / np.sqrt(np.mean(np.square(passed))))

    def wander(self, chain: Chain, observation: Observation) -> Wander:
        """Return how w wanders in a run by the noise that a chain has."""
        sd_v, bandwidth_hz = (chain.values[p.name] for p in (SD, BANDWIDTH))
        return wander_of(chain, observation, sd_v, self.kind, bandwidth_hz)

    def fuller(self) -> list[Self]:
        """Return the other form: it has the same two numbers, and which of them the noise has only a fit tells."""
        return [form for form in self.variants() if form != self]

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the bandwidth, tried below and above the sample rate, that explains most with the noise it needs.

        Where the borders have moved to stand in for its mean, none is needed to first order: a little is begun with.
        """
        if not self.applicable(evidence.chain):
            return []
        small_v = SMALL_V * gap_v(evidence.chain)
        small = [{"sd": small_v, "bandwidth": b / evidence.sample_s} for b in BANDS]
        best = evidence.best(self, [values for values in evidence.sized(self, "sd", small) if values["sd"] > 0.0])
        return [best or small[1]]
