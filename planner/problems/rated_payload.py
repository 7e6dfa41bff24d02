"""The refusal of payloads that exceed the maker's rating of the robot."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.errors import PayloadExceeded, distinct
from planner.tolerances import LIMIT_TOLERANCE

if TYPE_CHECKING:
    from collections.abc import Iterable

    from planner.errors import Remedy
    from planner.robots import Robot


def refuse_payload_above_rating(robot: Robot, mass: float, waypoint: int = 0, remedies: Iterable[Remedy] = ()) -> None:
    """Refuse a payload that exceeds the rated payload of its robot.

    Args:
        robot: The robot; one without a known rating carries any payload.
        mass: Mass of everything that the robot carries, kg.
        waypoint: Index of the waypoint where the robot takes the payload.
        remedies: Lighter payloads.

    Raises:
        PayloadExceeded: With the mass and the rated mass, kg.
    """
    rated = robot.rated_payload
    if rated is None or mass <= rated * (1.0 + LIMIT_TOLERANCE):
        return
    carried, allowed = distinct(mass, rated)
    since = " from waypoint {waypoint} on" if waypoint else ""
    source = robot.rated_payload_source
    raise PayloadExceeded(
        f"the payload of {carried} kg{since} exceeds the rated {allowed} kg of {robot.id} ({source})",
        waypoint=waypoint or None,
        value=mass,
        limit=rated,
        remedies=remedies,
    )
