"""From the actions of a request to the library's values."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from api.contract.parts import actions as schemas
from planner.problems.actions import AtDistance, AtTime, AtWaypoint, SetOutput, Wait

if TYPE_CHECKING:
    from collections.abc import Sequence

    from api.contract.parts.goal_sets import Waypoint
    from planner.problems.actions import Action, Moment
    from planner.problems.problem import AnyWaypoint


def to_actions(
    asked: Sequence[schemas.SetOutputAction | schemas.WaitAction], waypoints: Sequence[Waypoint]
) -> tuple[Action, ...]:
    """Make the actions of a request: its own, then the actions of its waypoints."""
    own = [_to_action(action, _to_moment(action.at)) for action in asked]
    at_waypoints = [_to_action(action, AtWaypoint(i)) for i, one in enumerate(waypoints) for action in one.actions]
    return (*own, *at_waypoints)


def _to_action(asked: schemas.SetOutput | schemas.Wait, at: Moment) -> Action:
    return SetOutput(at, asked.name, asked.value) if isinstance(asked, schemas.SetOutput) else Wait(at, asked.duration)


def _to_moment(asked: schemas.ActionMoment) -> Moment:
    if asked.waypoint is not None:
        return AtWaypoint(asked.waypoint)
    return AtDistance(asked.distance) if asked.distance is not None else AtTime(asked.time or 0.0)


def with_waits(waypoints: tuple[AnyWaypoint, ...], actions: Sequence[Action]) -> tuple[AnyWaypoint, ...]:
    """Lengthen the dwells of waypoints by the waits there; the check of the problem finds waits that are elsewhere."""
    waits = [0.0] * len(waypoints)
    for action in actions:
        if isinstance(action, Wait) and isinstance(action.at, AtWaypoint) and action.at.waypoint < len(waits):
            waits[action.at.waypoint] += action.duration
    return tuple(
        replace(waypoint, dwell=waypoint.dwell + wait) if wait > 0.0 else waypoint
        for waypoint, wait in zip(waypoints, waits, strict=True)
    )
