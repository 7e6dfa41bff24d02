"""The heaviest payload with which torques keep their limits."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from planner.errors import Remedy

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from planner.problem import PlanningProblem
    from planner.remedies.higher_limits import Change
    from planner.robots import Robot
    from planner.spatial import FloatArray

LEAST_LEVER = 1e-9
"""The torque by mass of the payload, N m/kg (N/kg), below which a joint does not feel the payload."""


def lighter_payload(
    problem: PlanningProblem,
    torques: Callable[[Robot], FloatArray],
    limit: FloatArray,
    shares: Sequence[float],
    explanation: str,
) -> Iterator[Change]:
    """A payload as heavy as the limits allow, for each share; nothing where no lighter one does.

    Args:
        problem: A problem, with or without a payload.
        torques: (N, joints), of a robot with its payload, in some motion or at rest. They are affine in the mass of
            the payload: two masses tell all.
        limit: (N, joints).
        shares: Shares of the limit that the torques may take.
        explanation: The explanation of the remedy.
    """
    payload = problem.payload
    if payload is None:
        return
    half, whole = (
        torques(problem.robot.with_payload(replace(payload, mass=mass))) for mass in (0.5 * payload.mass, payload.mass)
    )
    per_mass = (whole - half) / (0.5 * payload.mass)
    without = whole - payload.mass * per_mass
    felt = np.abs(per_mass) > LEAST_LEVER
    for share in shares:
        headroom = share * limit - np.sign(per_mass) * without
        most = float((headroom[felt] / np.abs(per_mass[felt])).min(initial=np.inf))
        if 0.0 < most < payload.mass:
            yield [Remedy(("payload", "mass"), most, explanation)]
