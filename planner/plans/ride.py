"""The report of a ride on a moving object."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class RideReport:
    """The times of a ride on a moving object.

    Attributes:
        waypoint: Index in the request of the first waypoint on the object.
        object: Name of the object.
        begin: Time at which the tool begins to get up to the speed of the object, s.
        arrival: Time of arrival at that waypoint, s.
        end: Time at which the robot rests again, s.
        durations: The times of its parts, s: of getting on, of each motion on the object, and of getting off.
        latest_start: The latest time at which the program may begin, s, on the clock of the objects. A plan was made
            in which the robot rests so long at its first waypoint. 0: none was found. The same for all rides of a plan.

    Examples:
        >>> import planner
        >>> planner.RideReport(1, "part", 1.05, 1.2, 2.1, (0.15, 0.5, 0.4), latest_start=0.8).object
        'part'
    """

    waypoint: int
    object: str
    begin: float
    arrival: float
    end: float
    durations: tuple[float, ...]
    latest_start: float
