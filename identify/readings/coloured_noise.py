"""Is there noise that hangs together over long times, and how large and how steep is it?

Told from what repeats (identify.readings.spectra). Its power at every frequency is compared with white noise and a
power law, by Whittle's likelihood (P. Whittle, Ark. Mat. 2 (1953) 423): ordinates of a periodogram are independent and
exponential about the spectrum.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, final

import numpy as np
from scipy.optimize import minimize, minimize_scalar
from scipy.stats import chi2, kurtosis

from identify.colour import Colour, whitening
from identify.effects.effect import Confusion
from identify.interval import Interval
from identify.quadratic import inverse
from identify.readings.blemish import Blemish
from identify.readings.spectra import Spectrum, difference, lines_of, mean_law, power_of, repeats, spectra
from identify.stage import Parameter
from identify.trace import Array, Trace

CONVINCING = 60.0  # twice the fall of the log-likelihood
CONFIRMING = 10.0  # the same on readings kept back
MISFIT = 2.0  # deviance a band from which noise follows another law, or is none
FAINT = 1e-12  # least power of a band, over its law's: coarse readings may repeat to the last digit
SLOPES = (0.3, 3.0)
STARTS = ((0.3, 1.0), (1.0, 0.7), (1.0, 1.5), (3.0, 1.0))  # sd over the white noise, slope
PER_DECADE = 1.6  # poles and zeros of the filter that whitens it
STEP = 1e-3  # of the differences for the curvature
LENGTHS = (1, 10, 100, 300)  # readings whose sums are compared with a normal law
ALIKE = 0.15  # difference in the logarithm of the rms, and in slope, that a fit hardly notices
UNEVEN = 0.01  # probability of so much difference between recordings below which it is none of the reading's
DOUBLED = 6.0  # times a coloured part may be doubled or halved in one recording
BURSTS = 5.0  # standard deviations by which their kurtosis may exceed its: chance alone does in 1 of 1000


@final
class ColouredNoise(Blemish):
    """Noise beside the white, its power falling with frequency as a power of it."""

    id = "coloured_noise"
    title = "coloured noise"
    equation = "y' = y + e, power of e in proportion to 1 / f^slope from the length of a run to half the rate, rms sd"
    sentence = (
        "The noise of the reading is not white: {}. Near a slope of 1 it is flicker noise of an amplifier, near 2 a "
        "wandering level, as of a warm joint or a reference; averaging more readings helps little against it."
    )
    axis = "frequency"
    fingerprint = "residual spectrum not white, no line"
    declared: ClassVar = (Parameter("coloured_noise.sd", "V", "log"), Parameter("coloured_noise.slope", "1"))
    confused_with: ClassVar = (
        Confusion("hum", "a longer idle run: the mains is a line, noise is none"),
        Confusion("process_noise", "a sine too small to move F: what is still there is noise of the reading"),
    )

    def weighs_as(self, other: Blemish) -> bool:
        """Return whether a fit would weigh readings much the same with another such noise."""
        sd, slope = ((self.values[name].value, other.values[name].value) for name in ("sd", "slope"))
        return abs(float(np.log(sd[0] / sd[1]))) < ALIKE and abs(slope[0] - slope[1]) < ALIKE


@dataclass(frozen=True)
class Coloured:
    """White and coloured noise together: rms of either, V, and the slope."""

    white_v: float
    sd_v: float
    slope: float

    @property
    def values(self) -> tuple[float, float, float]:
        """Return all three in a row."""
        return self.white_v, self.sd_v, self.slope

    @property
    def rms_v(self) -> float:
        """Return the rms of a reading's noise, V."""
        return float(np.hypot(self.white_v, self.sd_v))

    def colour(self, trace: Trace) -> Colour:
        """Return the filter that makes the noise of a recording white: poles and zeros in turn follow the power law.

        From the length of the run to where white noise takes over, evenly in log frequency (A. Oustaloup et al., IEEE
        Trans. Circuits Syst. I 47 (2000) 25); no steeper than lags of first order can be.
        """
        lines = lines_of(trace)
        share = self.sd_v**2 / mean_law(lines, self.slope)
        low, top = float(lines[0]), min((share / self.white_v**2) ** (1.0 / self.slope), 0.3 * trace.rate_hz)
        if top <= 2.0 * low:
            return Colour()
        count = max(1, round(PER_DECADE * float(np.log10(top / low))))
        ratio, part = (top / low) ** (1.0 / count), min(0.5 * self.slope, 1.0)
        poles = low * ratio ** (np.arange(count) + 0.5 * (1.0 - part))
        turn = 2.0 * np.pi / trace.rate_hz
        ladder = np.exp(-turn * np.stack((poles, poles * ratio**part), axis=1))
        z = np.exp(-1j * turn * lines)[:, None]
        passed = np.abs(np.prod((1.0 - ladder[:, 0] * z) / (1.0 - ladder[:, 1] * z), axis=1)) ** 2
        left = float(np.mean(passed * power_of(lines, lines, self.white_v, self.sd_v, self.slope)))
        return Colour(gain=self.rms_v / float(np.sqrt(left)), ladder=tuple(map(tuple, ladder.tolist())))


@dataclass(frozen=True)
class Told(Coloured):
    """The same, found beyond doubt; ``blemish`` tells of it, ``told`` is twice the fall of the log-likelihood."""

    blemish: ColouredNoise
    told: float


def coloured_noise(training: Sequence[Trace], proof: Sequence[Trace], settle_s: float) -> Told | None:
    """Return the noise when it is coloured beyond doubt and that holds on readings kept back; None when it is white.

    What comes in bursts is no such noise: made white, it is not Gaussian. Nor is what some recordings have and others
    have not: noise of the reading does not know what is played.
    """
    seen, kept = spectra(training, settle_s), spectra(proof, settle_s)
    told = told_by(seen, kept, lambda noise: _bursts(training, settle_s, noise))
    return told if told is not None and told_apart(seen, told) > UNEVEN else None


def told_by(seen: Sequence[Spectrum], kept: Sequence[Spectrum], bursts: Callable[[Coloured], float]) -> Told | None:
    """Return the coloured noise that spectra show beyond doubt; ``bursts`` are by how much it strays, made white."""
    if not seen or (white_v := _white(seen)) == 0.0:  # readings on a coarse grid stand still
        return None
    options = [_fitted(seen, white_v, share * white_v, slope) for share, slope in STARTS]
    best, cost = min(options, key=lambda option: option[1])
    told = 2.0 * (_cost(seen, white_v, 0.0, 1.0) - cost)
    law = SLOPES[0] < best[2] < SLOPES[1] and misfit(seen, Coloured(*_values(best))) < MISFIT
    if told < CONVINCING or not law or (kept and _improvement(kept, Coloured(*_values(best))) < CONFIRMING):
        return None
    scatter = np.sqrt(np.diag(inverse(_curvature(seen, best))))
    if bursts(Coloured(*_values(best))) > BURSTS:
        return None
    white_v, sd_v, slope = _values(best)
    values = {
        "sd": Interval(sd_v, sd_v * float(np.exp(-1.96 * scatter[1])), sd_v * float(np.exp(1.96 * scatter[1]))),
        "slope": Interval(slope, slope - 1.96 * float(scatter[2]), slope + 1.96 * float(scatter[2])),
    }
    return Told(white_v, sd_v, slope, ColouredNoise(values, float(chi2.sf(told, 2))), told)


def _white(seen: Sequence[Spectrum]) -> float:
    """Return the likeliest rms of noise that is white, V."""
    return float(np.sqrt(sum(s.power @ s.count for s in seen) / sum(np.sum(s.count) for s in seen)))


def _values(at: Array) -> tuple[float, float, float]:
    """Return white noise and sd, V, and slope from search coordinates."""
    return float(np.exp(at[0])), float(np.exp(at[1])), float(np.clip(at[2], *SLOPES))


def _cost(seen: Sequence[Spectrum], white_v: float, sd_v: float, slope: float) -> float:
    """Return minus Whittle's log-likelihood."""
    expected = [s.expected(white_v, sd_v, slope) for s in seen]
    return sum(float(np.sum(s.count * (np.log(e) + s.power / e))) for s, e in zip(seen, expected, strict=True))


def _fitted(seen: Sequence[Spectrum], white_v: float, sd_v: float, slope: float) -> tuple[Array, float]:
    """Return the likeliest search coordinates from a start, and their cost."""
    start = np.array([np.log(white_v), np.log(sd_v), slope])

    def cost(at: Array) -> float:
        return _cost(seen, *_values(at))

    found: Any = minimize(cost, start, method="Nelder-Mead", options={"maxiter": 300})
    return np.asarray(found.x), float(found.fun)


def misfit(seen: Sequence[Spectrum], noise: Coloured) -> float:
    """Return the deviance from a spectrum that is free in every band, per band: about one for the right law."""
    ratios = np.concatenate([np.maximum(s.power / s.expected(*noise.values), FAINT) for s in seen])
    count = np.concatenate([s.count for s in seen])
    return float(np.mean(2.0 * count * (ratios - 1.0 - np.log(ratios))))


def _improvement(seen: Sequence[Spectrum], noise: Coloured) -> float:
    """Return twice the gain in log-likelihood of coloured over white noise on readings it was not fitted to."""
    return 2.0 * (_cost(seen, _white(seen), 0.0, 1.0) - _cost(seen, *noise.values))


def told_apart(seen: Sequence[Spectrum], noise: Coloured) -> float:
    """Return how likely chance makes the coloured part as unlike in single recordings as it is, its law being one."""
    fallen = 0.0
    for spectrum in seen:

        def cost(doubled: float, spectrum: Spectrum = spectrum) -> float:
            return _cost([spectrum], noise.white_v, noise.sd_v * 2.0**doubled, noise.slope)

        found: Any = minimize_scalar(cost, bounds=(-DOUBLED, DOUBLED), method="bounded")
        fallen += 2.0 * max(cost(0.0) - float(found.fun), 0.0)
    return float(chi2.sf(fallen, len(seen)))


def in_repeats(noise: Coloured, seen: Sequence[Spectrum]) -> bool:
    """Return whether the differences between repeats have the colour of a noise rather than none.

    What is the same in every repeat is in none of them.
    """
    return bool(seen) and _improvement(seen, noise) > CONFIRMING


def against_repeats(noise: Coloured, seen: Sequence[Spectrum]) -> bool:
    """Return whether the differences between repeats rule a noise out: they are whiter than it would make them."""
    return bool(seen) and _improvement(seen, noise) < -CONFIRMING


def _curvature(seen: Sequence[Spectrum], at: Array) -> Array:
    """Return the expected curvature of the cost: the sum of products of relative slopes of the expected power."""
    total = np.zeros((3, 3))
    for spectrum in seen:
        ends = [
            [np.log(spectrum.expected(*_values(at + sign * step))) for sign in (1.0, -1.0)] for step in STEP * np.eye(3)
        ]
        slopes = np.array([(above - below) / (2.0 * STEP) for above, below in ends])
        total += (slopes * spectrum.count) @ slopes.T
    return total


def _bursts(traces: Sequence[Trace], settle_s: float, noise: Coloured) -> float:
    """Return by how many standard deviations of chance the noise, made white, strays farther than a normal law's."""
    white = []
    for trace in traces:
        made_white = whitening(noise.colour(trace))
        for left, use in (difference(trace, *pair) for pair in repeats(trace, settle_s)):
            white.append(made_white(left[use], np.ones(np.count_nonzero(use), dtype=np.bool_)))
    return straying(white)


def straying(white: Sequence[Array]) -> float:
    """Return by how many standard deviations of chance white noise, or sums of it, strays beyond a normal law.

    The filter that made it white took the first readings for all before them: the first tenth of them is left out.
    """
    sums: dict[int, list[Array]] = {length: [] for length in LENGTHS}
    for new in (each[each.size // 10 :] for each in white):
        for length, found in sums.items():
            found.append(new[: new.size // length * length].reshape(-1, length).sum(axis=1))
    together = [np.concatenate(found) for found in sums.values() if found]
    return max((float(kurtosis(each)) / (24.0 / each.size) ** 0.5 for each in together if each.size), default=0.0)
