"""The steps of the ADC, where they are coarse enough to show in the mean reading."""

from functools import lru_cache
from typing import TYPE_CHECKING, ClassVar, final

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline
from scipy.special import ndtr

from identify import kernels
from identify.effects.effect import Confusion, Effect
from identify.stage import Grid, Parameter, Place, Run, Shape, Values, memoryless
from identify.trace import Array

if TYPE_CHECKING:
    from identify.evidence import Evidence

LSB = Parameter("adc_quantisation.LSB", "V", "log")
NOISE = Parameter("adc_quantisation.noise", "V", "log", within=30.0)
SMOOTH = 1.0  # noise over step from which on the mean reading shows no steps: they are 1e-9 of an LSB
BEYOND = 9.0  # sd: noise does not reach an edge so far off
PIECES = 1024  # of a step, in which its rounding off is told
LEAST = 0.02  # of a step: noise below it is not told from none


@final
class AdcQuantisation(Effect):
    """A reading rounded to whole steps: on the mean, noise ahead of the converter rounds the steps off."""

    id = "adc_quantisation"
    title = "steps of the ADC"
    equation = "y' = LSB round((y + n) / LSB), n the noise ahead of the ADC, its rms the value noise"
    sentence = (
        "The ADC reads in coarse steps: {}. Choose a smaller range of the ADC or amplify ahead of it; or add noise of "
        "half a step and average."
    )
    axis = "level of y"
    fingerprint = "residual on a grid"
    quick = True
    places = (Place.SENSE,)
    shapeless = True
    declared = (LSB, NOISE)
    absent: ClassVar = {"LSB": 0.0, "noise": 1.0}
    confused_with = (
        Confusion("dac_quantisation", "a loopback cable from DAC to ADC: steps of the source are not those of the ADC"),
    )
    example: ClassVar = {"LSB": 0.31, "noise": 0.03}

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the mean rounding at work."""
        lsb, noise = values
        if lsb == 0.0 or noise > SMOOTH * lsb:
            return (lambda block: block.signal), shape
        return memoryless(lambda y: rounded_mean(y, lsb, noise), shape)

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the grid of the readings, where there is one."""
        step = evidence.grid_step_v
        if SMOOTH * step < 0.1 * evidence.observations[0].noise_v:  # none, or none that the noise does not hide
            return []
        spread = np.sqrt(max(evidence.observations[0].noise_v ** 2 - step**2 / 12.0, 0.0))
        tried = sorted({max(float(spread), 0.1 * step), 0.1 * step, 0.3 * step})
        best = evidence.best(self, [{"LSB": step, "noise": noise} for noise in tried])
        return [best] if best else []


def rounded_mean(y: Array, lsb: float, noise: float) -> Array:
    """Return the mean of ``lsb`` round((y + n) / lsb) over Gaussian n: a staircase whose edges are its distribution."""
    read = np.empty(y.size)
    kernels.rounded(lsb, _rounding_off(max(noise / lsb, LEAST)), y, read)
    return read


def rounded_sd(y: Array, lsb: float, noise: float) -> Array:
    """Return the sd of ``lsb`` round((y + n) / lsb) over Gaussian n: nothing where n turns no reading over."""
    part, width = y / lsb - np.rint(y / lsb), max(noise / lsb, LEAST)
    mean, square = np.zeros(y.size), np.zeros(y.size)
    for edge in np.arange(0.5, 1.0 + BEYOND * width):  # rounded up to ``edge`` + 0.5, or as far down
        above, below = ndtr((part - edge) / width), ndtr((-part - edge) / width)
        mean += above - below
        square += 2.0 * edge * (above + below)
    return np.asarray(lsb * np.sqrt(np.maximum(square - np.square(mean), 0.0)))


@lru_cache(maxsize=64)
def _rounding_off(width: float) -> NDArray[np.float64]:
    """Return by how much the mean reading differs from the level within a step, in steps, for noise of ``width``.

    Cubic pieces as identify.kernels.rounded takes them; they are off by 1e-7 of a step at most.
    """
    part = np.linspace(-0.5, 0.5, PIECES + 1)
    off, slope = -part, -np.ones(part.size)
    for edge in np.arange(0.5, 1.0 + BEYOND * width):
        above, below = (part - edge) / width, (-part - edge) / width
        off += ndtr(above) - ndtr(below)
        slope += (np.exp(-0.5 * np.square(above)) + np.exp(-0.5 * np.square(below))) / (width * np.sqrt(2.0 * np.pi))
    rows = np.zeros((part.size, 4))
    rows[:-1] = CubicHermiteSpline(part, off, slope).c[::-1].T
    rows[-1, :2] = off[-1], slope[-1]
    return rows
