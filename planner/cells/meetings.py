"""Meetings: stops at which robots of a cell wait for each other.

No robot goes on from a meeting before all have arrived and rested there. In a coordination diagram a meeting is a node
through which the path passes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from planner.cells.robots import CellRobot
from planner.fields import FieldPath
from planner.problems.any_of import AnyOf, waypoints_of
from planner.problems.problem import AnyWaypoint
from planner.problems.transitions import StopTransition
from planner.spatial import FloatArray


@dataclass(frozen=True)
class CellMeeting:
    """A meeting of robots.

    Attributes:
        name: The name of the waypoints at which they meet.
        waypoints: For each robot that takes part, by its name, the requested waypoint.
        time: When all have arrived and rested there, s.
    """

    name: str
    waypoints: Mapping[str, int]
    time: float


@dataclass(frozen=True)
class Meeting:
    """A meeting, by the indices of its robots.

    Attributes:
        name: The name of the waypoints.
        stops: For each robot that takes part, by its index, the requested waypoint or the number of its rest.
    """

    name: str
    stops: Mapping[int, int]


def meetings_of(robots: Sequence[CellRobot], names: Sequence[str]) -> tuple[Meeting, ...]:
    """Return the meetings at waypoints of some names; of two equal names in a list the last counts."""
    return tuple(
        Meeting(
            name,
            {
                k: i
                for k, robot in enumerate(robots)
                for i, waypoint in enumerate(robot.problem.waypoints)
                if waypoint.name == name
            },
        )
        for name in names
    )


def faults_of_meetings(robots: Sequence[CellRobot], names: Sequence[str]) -> Iterator[tuple[FieldPath, str]]:
    """Find faults of meetings at waypoints of some names."""
    for i, name in enumerate(names):
        if name in names[:i]:
            yield ("meetings", i), f"must differ from meeting {names.index(name)}; got {name!r}"
    meetings = meetings_of(robots, names)
    for i, meeting in enumerate(meetings):
        if len(meeting.stops) < 2:
            have = ", ".join(repr(robots[k].name) for k in meeting.stops) or "no robot"
            yield ("meetings", i), f"must be the name of a waypoint of two robots or more; {have} has one"
    for k, robot in enumerate(robots):
        latest: tuple[int, str] | None = None
        for meeting in meetings:
            if k not in meeting.stops:
                continue
            stop = meeting.stops[k]
            field: FieldPath = ("robots", k, "waypoints", stop)
            first = next(i for i, waypoint in enumerate(robot.problem.waypoints) if waypoint.name == meeting.name)
            if first != stop:
                yield (*field, "name"), f"must differ from that of waypoint {first}, a meeting; got {meeting.name!r}"
            if latest is not None and stop < latest[0]:
                order = f"robots meet at {latest[1]!r} before they meet here"
                yield (*field, "name"), f"must come after waypoint {latest[0]}: {order}"
            latest = stop, meeting.name
            if not _is_stop(robot.problem.waypoints[stop]):
                yield (*field, "transition"), f"must be a stop: robots wait for each other at {meeting.name!r}"


def _is_stop(waypoint: AnyWaypoint) -> bool:
    ends = [waypoint]
    if isinstance(waypoint, AnyOf):
        ends = [waypoints_of(option)[-1] for option in waypoint.options]
    return all(isinstance(end.transition, StopTransition) for end in ends)


def with_common_dwells(robots: Sequence[CellRobot], meetings: Sequence[Meeting]) -> tuple[CellRobot, ...]:
    """Return robots that rest at each meeting for the longest of their dwells there."""
    changed = list(robots)
    for meeting in meetings:
        dwells = {k: robots[k].problem.waypoints[stop].dwell for k, stop in meeting.stops.items()}
        for k, stop in meeting.stops.items():
            longer = max(dwells.values()) - dwells[k]
            if longer > 0.0:
                problem = changed[k].problem
                waypoints = list(problem.waypoints)
                waypoints[stop] = replace(waypoints[stop], dwell=dwells[k] + longer)
                duration = None if problem.duration is None else problem.duration + longer
                changed[k] = replace(changed[k], problem=replace(problem, waypoints=waypoints, duration=duration))
    return tuple(changed)


def with_meetings(
    meetings: Sequence[Meeting], rests: Sequence[FloatArray], waits: Sequence[FloatArray]
) -> tuple[list[FloatArray], tuple[float, ...]]:
    """Add the waits for each other to waits of robots.

    Args:
        meetings: The meetings in the order of time, with numbers of rests.
        rests: For each robot (rests,), s: when it rests without any wait.
        waits: For each robot (rests,), s: its waits besides.

    Returns:
        The waits of each robot (rests,), s, and the time of each meeting, s.
    """
    added, times = [own.copy() for own in waits], []
    for meeting in meetings:
        arrivals = {k: float(rests[k][stop] + added[k][:stop].sum()) for k, stop in meeting.stops.items()}
        times.append(max(arrivals.values()))
        for k, stop in meeting.stops.items():
            added[k][stop] += times[-1] - arrivals[k]
    for own in added:
        own[-1] = 0.0  # it rests there anyway
    return added, tuple(times)


def without_meetings(
    meetings: Sequence[Meeting], rests: Sequence[FloatArray], waits: Sequence[FloatArray]
) -> list[FloatArray]:
    """Return waits without the waits for each other, such that `with_meetings` gives the same waits again."""
    alone = [own.copy() for own in waits]
    for meeting in meetings:
        arrivals = {k: float(rests[k][stop] + waits[k][:stop].sum()) for k, stop in meeting.stops.items()}
        for k, stop in meeting.stops.items():
            alone[k][stop] = max(0.0, alone[k][stop] - (max(arrivals.values()) - arrivals[k]))
    return alone
