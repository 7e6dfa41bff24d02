"""Poses with a requested configuration: their solutions, or the reason for having none."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.errors import JointPositionLimit, PlanningError, Remedy, UnreachableWaypoint, distinct
from planner.kinematics.configurations import Configuration, configurations, in_configuration
from planner.kinematics.options import InverseKinematicsOptions
from planner.kinematics.search import QUICK, Search, is_isolated
from planner.kinematics.seeds import TABLE_ROWS
from planner.robots import Robot
from planner.spatial import FloatArray, Pose

MOST_OF_CONTINUUM = 8
"""The most solutions of a continuum sought from starts in the requested configuration."""

MOST_STARTS = 64
"""The most starts from which they are sought."""


def solutions_in(
    robot: Robot,
    pose: Pose,
    solutions: tuple[FloatArray, ...],
    wanted: Configuration,
    options: InverseKinematicsOptions,
) -> tuple[FloatArray, ...]:
    """Return the solutions of a pose in the requested configuration.

    A continuum has more than the spread that is known of it: further solutions are sought from starts in that
    configuration.
    """
    fitting = in_configuration(robot, solutions, wanted)
    if len(fitting) == len(solutions) or is_isolated(robot, pose, solutions[0]):
        return fitting
    search, found = Search(robot, pose, options), list(fitting)
    for start in in_configuration(robot, search.table_starts(TABLE_ROWS - 1), wanted)[:MOST_STARTS]:
        if len(found) >= MOST_OF_CONTINUUM:
            break
        q = search.solve(start, QUICK)
        found += [] if q is None else in_configuration(robot, [q], wanted)
    return tuple(found)


def configuration_error(
    robot: Robot,
    index: int,
    pose: Pose,
    solutions: Sequence[FloatArray],
    wanted: Configuration,
    options: InverseKinematicsOptions,
) -> PlanningError:
    """Build the refusal of a reachable pose without a solution in the requested configuration; it names the others."""
    found = list(dict.fromkeys(configurations(robot, np.array(solutions))))
    others = "; ".join(map(str, found))
    changed = dict.fromkeys(other.of_parts(wanted.names) for other in found)
    remedies = [
        Remedy(("waypoints", index, "configuration"), other, f"the waypoint can be reached with {other}")
        for other in sorted(changed, key=lambda other: len(other.names.items() - wanted.names.items()))
    ]
    q = Search(robot, pose, options).beyond_the_limits(wanted)
    if q is None:
        return UnreachableWaypoint(
            f"no joint position of {robot.id} reaches waypoint {{waypoint}} with {wanted}; "
            f"it can be reached with {others}",
            waypoint=index,
            remedies=remedies,
        )
    excess = np.maximum(robot.limit("lower") - q, q - robot.limit("upper"))
    joint = robot.joints[int(excess.argmax())]
    value = float(q[excess.argmax()])
    limit = float(joint.lower if value < joint.lower else joint.upper)
    there, end = distinct(value, limit)
    return JointPositionLimit(
        f"with {wanted} waypoint {{waypoint}} can be reached only with {joint.name} at {there}, its limit is {end}; "
        f"it can be reached with {others}",
        waypoint=index,
        joint=joint.name,
        value=value,
        limit=limit,
        remedies=remedies,
    )
