"""Time laws from rest to rest under limits of velocity, acceleration and jerk: their seven phases in closed form."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.backends.shared.rest_to_rest import unit_laws
from planner.tolerances import LIMIT_TOLERANCE, ROUNDING

if TYPE_CHECKING:
    from planner.polynomials import SegmentedPolynomial
    from planner.spatial import FloatArray


def s_curves(V: FloatArray, A: FloatArray, J: FloatArray) -> tuple[FloatArray, SegmentedPolynomial, list[np.ndarray]]:
    """Compute the fastest laws from 0 to 1, and which of their limits set their time.

    Ruckig computes the same, but not for limits of any size: four phases of jerk, each t_j long, two of constant
    acceleration (t_a) and a cruise (t_v); Biagiotti and Melchiorri, Trajectory Planning for Automatic Machines and
    Robots (2008), ch. 3.4. The times alone determine the law: v = 1 / (2 t_j + t_a + t_v), a = v / (t_j + t_a) and
    j = a / t_j.

    Args:
        V: Limits of velocity (rows,), 1/s; infinite: none.
        A: Limits of acceleration (rows,), 1/s^2; infinite: none.
        J: Limits of jerk (rows,), 1/s^3; infinite: the acceleration jumps.

    Returns:
        Durations (rows,), s, infinite where there is no limit at all; the laws; for each limit where it binds, (rows,).
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        ramp = np.where(np.isfinite(A), A / J, np.inf)
        t_j = np.where(np.isfinite(J), np.minimum.reduce([np.cbrt(0.5 / J), np.sqrt(V / J), ramp]), 0.0)
        braked = (np.sqrt(t_j**2 + 4.0 / A) - 3.0 * t_j) / 2.0
        steady = np.where(np.isfinite(A), np.minimum(V / A - t_j, braked), 0.0)
        t_a = np.where((t_j == ramp) | np.isinf(J), np.maximum(steady, 0.0), 0.0)
        v = np.where(np.isfinite(J), J * t_j, A) * np.where(np.isfinite(J), t_j + t_a, t_a)
        t_v = np.maximum(1.0 / v - 2.0 * t_j - t_a, 0.0)
    limited = np.isfinite(t_v) & (t_j + t_a > 0.0)
    t_j, t_a, t_v = np.where(limited, t_j, 1.0), np.where(limited, t_a, 0.0), np.where(limited, t_v, 0.0)
    least = ROUNDING * (4.0 * t_j + 2.0 * t_a + t_v)
    t_a, t_v = np.where(t_a > least, t_a, 0.0), np.where(t_v > least, t_v, 0.0)
    phases = np.stack([t_j, t_a, t_j, t_v, t_j, t_a, t_j], axis=1)
    duration = phases.sum(axis=1)
    phases /= duration[:, None]
    v = 1.0 / (phases[:, 2:5].sum(axis=1) + phases[:, 1])
    a = v / (phases[:, 0] + phases[:, 1])
    with np.errstate(divide="ignore", invalid="ignore"):
        j = np.where(t_j > 0.0, a / phases[:, 0], 0.0)
    zero, h = np.zeros_like(v), phases[:, 0]
    jerks = np.stack([j, zero, -j, zero, -j, zero, j], axis=1)
    accelerations = np.stack([zero, a, a, zero, zero, -a, -a], axis=1)
    velocities = np.stack([zero, a * h / 2.0, v - a * h / 2.0, v, v, v - a * h / 2.0, a * h / 2.0], axis=1)
    ways = phases * (velocities + phases * (accelerations / 2.0 + phases * jerks / 6.0))
    positions = np.cumsum(ways, axis=1) - ways
    laws = unit_laws(phases, np.stack([positions, velocities, accelerations / 2.0, jerks / 6.0], axis=-1))
    at_limit = 1.0 - LIMIT_TOLERANCE
    reached = v / duration >= V * at_limit, a / duration**2 >= A * at_limit, t_j > 0.0
    return np.where(limited, duration, np.inf), laws, [limited & bind for bind in reached]
