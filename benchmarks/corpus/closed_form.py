"""Times of straight joint motions in closed form."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from benchmarks.corpus.job import Law
    from planner.robots import Robot
    from planner.spatial import FloatArray


def straight_times(robot: Robot, positions: FloatArray) -> dict[Law, float]:
    """Return the summed times, s, of straight motions from rest to rest at all joint positions (N, joints), by profile.

    The profiles stand in Biagiotti and Melchiorri, Trajectory Planning for Automatic Machines and Robots, 2008.
    A motion has length 1 and time 1. The cubic 3 t^2 - 2 t^3 reaches a velocity of 1.5 and an acceleration of 6. The
    quintic 10 t^3 - 15 t^4 + 6 t^5 reaches 1.875, 10 / sqrt(3) and a jerk of 60.
    """
    times = dict.fromkeys(("cubic", "quintic", "trapezoidal", "s_curve"), 0.0)
    for travel in np.abs(np.diff(positions, axis=0)):
        if not travel.any():
            continue
        moves = travel > 0.0
        v, a, j = ((robot.limit(name)[moves] / travel[moves]).min() for name in ("velocity", "acceleration", "jerk"))
        times["cubic"] += max(1.5 / v, np.sqrt(6.0 / a))
        times["quintic"] += max(1.875 / v, np.sqrt(10.0 / np.sqrt(3.0) / a), np.cbrt(60.0 / j))
        times["trapezoidal"] += 1.0 / v + v / a if v * v < a else 2.0 * np.sqrt(1.0 / a)
        times["s_curve"] += _s_curve(v, a, j)
    return times  # type: ignore[return-value]


def _s_curve(v: float, a: float, j: float) -> float:
    """Return the time of the seven phases over a length of 1 (the same book, section 3.4)."""
    ramp = a / j + v / a if v * j > a * a else 2.0 * np.sqrt(v / j)
    if v * ramp <= 1.0:
        return 1.0 / v + ramp
    if 2.0 * a**3 <= j * j:  # the acceleration limit is reached, the velocity limit is not
        return float(a / j + np.sqrt((a / j) ** 2 + 4.0 / a))
    return float(4.0 * np.cbrt(0.5 / j))
