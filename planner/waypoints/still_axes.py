"""Poses that an arm on external axes reaches while these stand still, or move as little as will do."""

from __future__ import annotations

import numpy as np

from planner.kinematics.configurations import Configuration, in_configuration
from planner.kinematics.inverse import all_solutions
from planner.kinematics.search import QUICK, Search
from planner.kinematics.turns import counted_velocity, travel_times
from planner.spatial import FloatArray
from planner.tool_motions.least_cost import least_cost
from planner.waypoints.pinned import pinned_at

ARM_SHARE = 1e-3
"""The weight of the arm's time beside that of its external axes: it decides where these can stand still."""


def with_still_axes(search: Search, start: FloatArray, wanted: Configuration) -> FloatArray | None:
    """Return the solution of a pose for which external axes move least from a joint position (joints,).

    Args:
        search: For the pose, of a robot with external axes.
        start: (joints,), within the limits.
        wanted: The configuration of the arm.

    Returns:
        The nearest solution of the arm alone. Otherwise a solution with a local minimum of the external axes' motion;
        None: no solution nearby.
    """
    robot, carried = search.robot, len(search.robot.external_axes)
    pinned = pinned_at(robot, dict(zip(robot.external_axes, start.tolist(), strict=False)))
    alone = all_solutions(pinned.robot, search.pose, pinned.options(search.options), pinned.own(start))
    if alone := in_configuration(pinned.robot, alone, wanted):
        return min(pinned.solutions(alone), key=lambda q: float(travel_times(robot, q, start)))
    solution = search.solve(start, QUICK)
    if solution is None:
        return None
    velocity = counted_velocity(robot.limit("velocity"))

    def costs(positions: FloatArray) -> FloatArray:
        """Return the times (N,), s, of the external axes from the start, plus a fraction of the arm's time."""
        times = np.abs(positions - start) / velocity
        found: FloatArray = times[:, :carried].sum(axis=1) + ARM_SHARE * times[:, carried:].sum(axis=1)
        return found

    return least_cost(search, solution, costs)
