"""From the actions of a request to those of the library."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from api.schemas.actions import SetOutputAction
from planner.actions import AtDistance, AtTime, AtWaypoint, SetOutput, Wait

if TYPE_CHECKING:
    from collections.abc import Sequence

    from api.schemas.actions import ActionMoment, WaitAction
    from planner.actions import Action, Moment
    from planner.problem import AnyWaypoint


def to_action(asked: SetOutputAction | WaitAction) -> Action:
    """Make an action."""
    at = _to_moment(asked.at)
    return SetOutput(at, asked.name, asked.value) if isinstance(asked, SetOutputAction) else Wait(at, asked.duration)


def _to_moment(asked: ActionMoment) -> Moment:
    if asked.waypoint is not None:
        return AtWaypoint(asked.waypoint)
    return AtDistance(asked.distance) if asked.distance is not None else AtTime(asked.time or 0.0)


def with_waits(
    waypoints: tuple[AnyWaypoint, ...], asked: Sequence[SetOutputAction | WaitAction]
) -> tuple[AnyWaypoint, ...]:
    """Lengthen the dwells of waypoints by the waits there; the check of the problem finds waits that are elsewhere."""
    waits = [0.0] * len(waypoints)
    for action in asked:
        if not isinstance(action, SetOutputAction):
            waypoint = action.at.waypoint
            if waypoint is not None and waypoint < len(waits):
                waits[waypoint] += action.duration
    return tuple(
        replace(waypoint, dwell=waypoint.dwell + wait) if wait > 0.0 else waypoint
        for waypoint, wait in zip(waypoints, waits, strict=True)
    )
