"""How much of the concealed physics is left once the plain model has done its best?

The plain model is refitted here without any code of the product: Levenberg-Marquardt on the bench's own integrator, all
coefficients free (the numerators stay: each is a scale that the slopes carry).
"""

from dataclasses import dataclass, replace

import numpy as np

from tests.proof.bench import SUBSTEPS, answer, schedule
from tests.proof.cases import Case
from tests.proof.integrator import Array, Grid
from tests.proof.rigs import Rig
from tests.proof.stimuli import Stimulus

COARSE = 1  # sub-steps of the refit: their error is a twentieth of the noise (tests/unit/proof/test_accuracy.py)
DIFFERENCE = 1e-5
STEPS = 40
NEGLIGIBLE = 2e-3  # share of the cost


@dataclass(frozen=True)
class Size:
    """The mismatch rms over the noise rms: before the refit, after it, and after it on the runs held out."""

    nominal: float
    refitted: float
    held_out: float
    rig: Rig


def size(case: Case) -> Size:
    """Return how large the mismatch of a case is, from readings without noise."""
    runs = tuple(schedule(case))
    clean = [answer(case.rig, s.u, _grid(s, at, SUBSTEPS), case.physics, case.seed) for s, at, _ in runs]
    kept = [(s, y) for (s, _, held_out), y in zip(runs, clean, strict=True) if not held_out]
    proof = [(s, y) for (s, _, held_out), y in zip(runs, clean, strict=True) if held_out]
    rig = refitted(case.nominal, kept)
    noise = case.rig.noise_v
    return Size(
        nominal=_rms(_residual(case.nominal, kept)) / noise,
        refitted=_rms(_residual(rig, kept)) / noise,
        held_out=_rms(_residual(rig, proof)) / noise,
        rig=rig,
    )


Data = list[tuple[Stimulus, Array]]


def refitted(start: Rig, data: Data) -> Rig:
    """Return the plain rig closest to the data in the least-squares sense."""
    theta, damping = np.zeros(_free(start)), 1e-6
    residual, idle = _residual(start, data), 0
    for _ in range(STEPS):
        varied = (_moved(start, theta + shift) for shift in DIFFERENCE * np.eye(theta.size))
        slopes = np.stack([_residual(rig, data) - residual for rig in varied]) / DIFFERENCE
        theta, residual, damping, gain = _step(start, data, (theta, residual, damping), slopes)
        idle = idle + 1 if gain < NEGLIGIBLE else 0
        if idle == 2:
            break
    return _moved(start, theta)


def _step(start: Rig, data: Data, at: tuple[Array, Array, float], slopes: Array) -> tuple[Array, Array, float, float]:
    """Return theta, residual, damping after one accepted step, and the share of the cost it gained (0: none found)."""
    theta, residual, damping = at
    matrix, right = slopes @ slopes.T, -slopes @ residual
    for _ in range(12):
        step = np.linalg.solve(matrix + damping * np.diag(np.diag(matrix) + 1e-12), right)
        trial = _residual(_moved(start, theta + np.clip(step, -0.7, 0.7)), data)
        gain = 1.0 - float(trial @ trial) / float(residual @ residual)
        if gain > 0.0:
            return theta + np.clip(step, -0.7, 0.7), trial, damping / 5.0, gain
        damping *= 8.0
    return theta, residual, damping, 0.0


def _free(rig: Rig) -> int:
    return len(rig.g1_den) + len(rig.g2_den) + 2


def _moved(rig: Rig, theta: Array) -> Rig:
    """Return the rig at theta: denominators and slopes on a log scale, the crossings in units of 1 V."""
    scale = np.exp(np.clip(theta, -12.0, 12.0))
    one, two = len(rig.g1_den) - 1, len(rig.g2_den) - 1
    g1 = tuple(a * s for a, s in zip(rig.g1_den[:-1], scale[:one], strict=True))
    g2 = tuple(a * s for a, s in zip(rig.g2_den[:-1], scale[one : one + two], strict=True))
    s_l, s_u = scale[one + two : one + two + 2]
    d_l, d_u = theta[one + two + 2 :]
    return replace(
        rig, g1_den=(*g1, rig.g1_den[-1]), g2_den=(*g2, rig.g2_den[-1]), s_l=rig.s_l * s_l, s_u=rig.s_u * s_u,
        d_l_v=rig.d_l_v + d_l, d_u_v=rig.d_u_v + d_u,
    )  # fmt: skip


def _residual(rig: Rig, data: Data) -> Array:
    return np.concatenate([answer(rig, s.u, _grid(s, 0.0, COARSE)) - y for s, y in data])


def _grid(stimulus: Stimulus, start_s: float, substeps: int) -> Grid:
    return Grid(stimulus.rate_hz, stimulus.u.size, substeps, start_s)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
