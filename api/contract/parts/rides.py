"""The times of a ride on a moving object, in answers."""

from __future__ import annotations

from api.contract.parts.common import Answer


class RideAnswer(Answer):
    """The times of a ride on a moving object."""

    waypoint: int
    """The index in the request of the first waypoint on the object."""
    object: str
    """The id of the object."""
    begin: float
    """The time at which the tool begins to get up to the speed of the object, s from the start of the trajectory."""
    arrival: float
    """The time of arrival at that waypoint, s: the earliest one found, to 5 ms."""
    end: float
    """The time at which the robot rests again, after the last waypoint on the object, s."""
    durations: list[float]
    """The times of getting on, of each motion on the object, and of getting off, s."""
    latest_start: float
    """The latest time at which the program may begin, s on the clock of the objects. A plan was made in which the robot
    rests so long at the first waypoint. 0: none was found."""
