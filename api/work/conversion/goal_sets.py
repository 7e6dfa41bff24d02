"""From the goal sets of a request to the library's values."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

import planner
from api.contract.parts import goal_sets

if TYPE_CHECKING:
    from collections.abc import Callable

    from api.contract.parts import waypoints
    from planner import FieldPath

    Convert = Callable[[waypoints.SingleWaypoint, FieldPath], planner.AnyWaypoint | None]


def to_requested_waypoint(
    requested: goal_sets.Waypoint, path: FieldPath, convert: Convert, faults: list[tuple[FieldPath, str]]
) -> planner.AnyWaypoint | None:
    """Make a waypoint, or a goal set with all its options.

    Args:
        requested: The waypoint or goal set.
        path: Its path in the request.
        convert: Function that makes a waypoint at a path, or adds its faults and returns None.
        faults: The list to which faults are added.

    Returns:
        None: a waypoint with faults.
    """
    if not isinstance(requested, goal_sets.GoalSet):
        return convert(requested, path)
    options: list[planner.AnyWaypoint | planner.WaypointSequence] = []
    for k, option in enumerate(requested.options):
        at = (*path, "options", k)
        if isinstance(option, goal_sets.WaypointSequence):
            each = [(waypoint, (*at, "waypoints", j)) for j, waypoint in enumerate(option.waypoints)]
        else:
            each = [(option, at)]
        for waypoint, place in each:
            if waypoint.actions:
                faults.append(((*place, "actions"), "must be empty in an option. Move them to the goal set"))
        made = [one for waypoint, place in each if (one := convert(waypoint, place)) is not None]
        options += made if not isinstance(option, goal_sets.WaypointSequence) else [planner.WaypointSequence(made)]
    return cast("planner.AnyWaypoint", planner.AnyOf(options, name=requested.name))
