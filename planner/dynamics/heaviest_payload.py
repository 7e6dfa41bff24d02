"""The heaviest payload with which torques keep their limits."""

from __future__ import annotations

import numpy as np

from planner.spatial import FloatArray

LEAST_LEVER = 1e-9
"""The torque by mass of the payload, N m/kg (N/kg), below which a joint does not feel the payload."""


def heaviest_mass(without: FloatArray, per_mass: FloatArray, lower: FloatArray, upper: FloatArray) -> float:
    """Return the largest mass of a payload, kg, with which torques keep their limits; infinite: no joint feels it.

    For a given center of mass torques are affine in the mass. A negative result means that a limit is broken without
    the payload.

    Args:
        without: Torques (..., joints) without the payload, N m or N.
        per_mass: The torques that each kilogram adds, of the same shape, N m/kg or N/kg.
        lower: Lower limits of the torques, of a shape that fits.
        upper: Upper limits.
    """
    headroom = np.where(per_mass > 0.0, upper - without, without - lower)
    felt = np.abs(per_mass) > LEAST_LEVER
    return float((headroom[felt] / np.abs(per_mass[felt])).min(initial=np.inf))
