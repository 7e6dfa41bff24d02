"""Rides: consecutive waypoints on one moving object, where the tool moves along with it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from planner.fields import FieldPath
from planner.problems.any_of import goal_sets
from planner.problems.problem import (
    AnyWaypoint,
    CartesianMotion,
    JointMotion,
    JointWaypoint,
    LinearMotion,
    PlanningProblem,
    PoseWaypoint,
    RelativeWaypoint,
)
from planner.problems.transitions import StopTransition
from planner.scene.motions import ConstantVelocity
from planner.scene.scene import Carrier, Handling, SceneObject
from planner.spatial import Pose
from planner.trajectories.polynomials import PiecewisePolynomial

ONLY_AT_FIRST = {"earliest_arrival": 0.0, "tool": None}
"""Fields of waypoints on an object that only the first of them may have, with their defaults."""

NEVER = {"external": None, "free": None, "frame": None, "process_force": None}
"""Fields that no waypoint on an object has, with their defaults."""


@dataclass(frozen=True)
class Ride:
    """The waypoints of a problem on one moving object.

    Attributes:
        first: Index of the first of them.
        last: Index of the last.
        thing: The object.
    """

    first: int
    last: int
    thing: SceneObject

    @property
    def indices(self) -> range:
        """The indices of the waypoints."""
        return range(self.first, self.last + 1)


@dataclass(frozen=True, eq=False)
class RideMotion(JointMotion):
    """A joint motion with given time, on which the robot rides on an object, or gets on or off.

    Attributes:
        curve: Joint positions over time from the arrival at the waypoint before, s: the rest there relative to the
            object, then the motion. C2.
        thing: The object as requested.
        end: When the motion ends, s.
    """

    curve: PiecewisePolynomial = field(kw_only=True)
    thing: SceneObject = field(kw_only=True)
    end: float = field(kw_only=True)

    @property
    def carrier(self) -> Carrier:
        """The object with which the robot moves along at the end."""
        return Carrier(self.thing, self.end)


@dataclass(frozen=True)
class RideEnd(JointWaypoint):
    """The joint position where the robot rests before it gets on an object, or after it has got off."""


def rides_of(problem: PlanningProblem) -> list[Ride]:
    """Return the rides of a problem whose objects exist, in order."""
    things = {} if problem.scene is None else {thing.id: thing for thing in problem.scene.objects}
    rides: list[Ride] = []
    for i, waypoint in enumerate(problem.waypoints):
        name = object_of(waypoint)
        if name not in things:
            continue
        if rides and rides[-1].last == i - 1 and rides[-1].thing.id == name:
            rides[-1] = Ride(rides[-1].first, i, rides[-1].thing)
        else:
            rides.append(Ride(i, i, things[name]))
    return rides


def object_of(waypoint: AnyWaypoint) -> str | None:
    """Return the name of the object that a waypoint is on; None: it is on none."""
    return waypoint.on if isinstance(waypoint, PoseWaypoint) else None


def handling_of(problem: PlanningProblem) -> tuple[Handling, ...]:
    """Return the objects that the robot takes and puts down at each waypoint."""
    return tuple(
        Handling(own.attach, own.detach, own.motion.carrier if isinstance(own.motion, RideMotion) else None)
        for own in problem.waypoints
    )


def is_riding(problem: PlanningProblem, waypoint: int) -> bool:
    """Tell whether the robot leaves a waypoint on a ride, so that it does not stand there."""
    waypoints = problem.waypoints
    return waypoint + 1 < len(waypoints) and isinstance(waypoints[waypoint + 1].motion, RideMotion)


def ride_faults(problem: PlanningProblem) -> Iterator[tuple[FieldPath, str]]:
    """Find faults of waypoints on objects, and fields of the problem that cannot be combined with them."""
    on = [i for i, waypoint in enumerate(problem.waypoints) if object_of(waypoint) is not None]
    if not on:
        return
    if problem.robot.positioner:
        text = "must be left out: the robot's base frame is its workpiece, which moves, too"
        yield from ((("waypoints", i, "on"), text) for i in on)
        return
    things = {} if problem.scene is None else {thing.id: thing for thing in problem.scene.objects}
    for i in on:
        yield from _object_faults(things, object_of(problem.waypoints[i]), ("waypoints", i, "on"))
    for ride in rides_of(problem):
        yield from _waypoint_faults(problem, ride)
    yield from _other_faults(problem)


def _object_faults(
    things: dict[str, SceneObject], name: str | None, path: FieldPath
) -> Iterator[tuple[FieldPath, str]]:
    """Find an object on which no waypoint can be."""
    if name not in things:
        yield path, f"must name an object of the scene; got {name!r}"
        return
    thing = things[name]
    if not thing.moves:
        yield path, f"must name an object that moves; {name!r} stands still. Give the pose in the base frame"
    elif not isinstance(thing.motion, ConstantVelocity):
        yield path, f"must name an object that moves at constant velocity; {name!r} moves through timed poses"


def _waypoint_faults(problem: PlanningProblem, ride: Ride) -> Iterator[tuple[FieldPath, str]]:
    """Find faults of the waypoints of a ride and of its neighbours."""
    waypoints = problem.waypoints
    if any(take.id == ride.thing.id for waypoint in waypoints[: ride.first] for take in waypoint.attach):
        text = f"must name an object that still moves by itself: the robot has taken {ride.thing.id!r} before"
        yield ("waypoints", ride.first, "on"), text
    if ride.first == 0:
        yield ("waypoints", 0, "on"), "must be left out: the robot starts at rest"
    if ride.last == len(waypoints) - 1:
        text = "must be left out at the last waypoint: the robot ends at rest. Add a waypoint after it"
        yield ("waypoints", ride.last, "on"), text
    for i in ride.indices:
        waypoint, path = waypoints[i], ("waypoints", i)
        assert isinstance(waypoint, PoseWaypoint)  # noqa: S101 - only poses are on objects
        if waypoint.pose.rotation is None:
            yield (*path, "pose"), "must have an orientation on an object"
        never = NEVER | (ONLY_AT_FIRST if i > ride.first else {})
        for name, default in never.items():
            if getattr(waypoint, name) != default:
                where = "after the first waypoint on the object" if name in ONLY_AT_FIRST else "on an object"
                yield (*path, name), f"must be left out {where}"
        if i > ride.first and not (type(waypoint.motion) is LinearMotion and waypoint.motion.free is None):
            yield (*path, "motion"), "must be a straight line without `free`: the tool moves so relative to the object"
        if waypoint.detach and any(take.id == ride.thing.id for other in waypoints for take in other.attach):
            yield (*path, "detach"), f"must be left out on {ride.thing.id!r}, which the robot takes itself"
        for j, other in enumerate(waypoints[i + 1 :], i + 1):
            for k, take in enumerate(other.attach):
                if take.id in waypoint.detach:
                    text = f"must be another object: {take.id!r} moves along with {ride.thing.id!r} since waypoint {i}"
                    yield ("waypoints", j, "attach", k, "id"), text
        for k, take in enumerate(waypoint.attach):
            if take.id != ride.thing.id:
                yield (
                    (*path, "attach", k, "id"),
                    f"must be {ride.thing.id!r}, on which the waypoint is; got {take.id!r}",
                )
        if not isinstance(waypoint.transition, StopTransition):
            yield (*path, "transition"), "must be a stop: the tool stops there relative to the object"
    if waypoints[ride.first].duration is not None or waypoints[ride.first].minimum_duration:
        name = "duration" if waypoints[ride.first].duration is not None else "minimum_duration"
        text = "must be left out: the object determines the arrival. Set `earliest_arrival` and `latest_arrival`"
        yield ("waypoints", ride.first, name), text
    for i in (ride.first, ride.last + 1):
        if i >= len(waypoints) or (i > ride.last and object_of(waypoints[i]) is not None):
            continue
        if isinstance(waypoints[i].motion, CartesianMotion):
            where = "to the first waypoint on an object" if i == ride.first else "away from an object"
            yield ("waypoints", i, "motion"), f"must be a joint or free motion {where}"
        if isinstance(waypoints[i], RelativeWaypoint):
            yield ("waypoints", i), "must not be relative to a waypoint on an object"


def _other_faults(problem: PlanningProblem) -> Iterator[tuple[FieldPath, str]]:
    """Find fields of the problem that cannot be combined with waypoints on objects."""
    for i in goal_sets(problem):
        yield ("waypoints", i), "must not be a goal set: another waypoint is on a moving object (`on`)"
    mode = problem.residual_vibration
    parts = {
        "duration": problem.duration is not None,
        "optimise": problem.optimise is not None,
        "speed_zones": bool(problem.speed_zones),
        "residual_vibration": mode is not None and mode.suppress,
    }
    for name, is_given in parts.items():
        if is_given:
            yield (name,), "must be left out with waypoints on a moving object (`on`)"


def unplanned_faults(waypoints: Sequence[AnyWaypoint]) -> Iterator[tuple[FieldPath, str]]:
    """Find waypoints on moving objects where they are solved by themselves."""
    for i, waypoint in enumerate(waypoints):
        if object_of(waypoint) is not None:
            text = "must be left out here: only a plan of waypoints in their order meets a moving object"
            yield ("waypoints", i, "on"), text


def velocity_in_base(thing: SceneObject, base: Pose | None) -> np.ndarray:
    """Return the velocity (3,), m/s, of an object in the base frame, which has a pose in the world."""
    motion = thing.motion
    velocity = np.asarray(motion.velocity) if isinstance(motion, ConstantVelocity) else np.zeros(3)
    return velocity if base is None or base.rotation is None else base.rotation.T @ velocity
