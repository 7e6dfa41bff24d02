"""Problems with a ride at a given time: joint positions and curves in time replace its waypoints on the object."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from planner.planning.rides.boarding import Boarding, Boardings
from planner.plans.ride import RideReport
from planner.problems.actions import Action, AtWaypoint
from planner.problems.any_of import ProblemWithOptions, requested_paths
from planner.problems.motion_around import FixedWaypoint, FreeMotion
from planner.problems.problem import AnyWaypoint, JointMotion, PlanningProblem, PoseWaypoint, Waypoint
from planner.problems.rides import Ride, RideEnd, RideMotion, rides_of
from planner.problems.transitions import StopTransition
from planner.scene.motions import ConstantVelocity
from planner.scene.scene import Scene, SceneObject
from planner.trajectories.trajectory import Trajectory


def with_boarding(boardings: Boardings, boarding: Boarding) -> ProblemWithOptions:
    """Return the problem of some boardings with one of them in the place of its waypoints on the object."""
    return _Boarded(boardings, boarding).problem()


def until_next_ride(problem: ProblemWithOptions) -> ProblemWithOptions:
    """Return the part of a problem before its first waypoint on an object: the robot ends at rest there.

    The part keeps only actions at its waypoints.
    """
    rides = rides_of(problem)
    if not rides:
        return problem
    *before, last = problem.waypoints[: rides[0].first]
    actions = [
        action
        for action in problem.actions
        if isinstance(action.at, AtWaypoint) and action.at.waypoint < rides[0].first
    ]
    return replace(
        problem,
        waypoints=(*before, replace(last, transition=StopTransition())),
        paths=problem.paths[: rides[0].first],
        actions=tuple(actions),
    )


def with_planned_ride(problem: PlanningProblem, report: RideReport, trajectory: Trajectory) -> ProblemWithOptions:
    """Return a requested problem with the first of its rides as it is in its plan."""
    ride, *_ = rides_of(problem)
    boardings, curve = Boardings(problem, ride), trajectory.between(report.begin, report.end)
    path = boardings.path(report.arrival, np.array(report.durations))
    return with_boarding(boardings, Boarding(report.arrival, path, curve))


@dataclass(frozen=True, eq=False)
class _Boarded:
    """A ride in the place of its waypoints on the object.

    Attributes:
        boardings: The rides of the problem at any time.
        boarding: The ride.
    """

    boardings: Boardings
    boarding: Boarding

    @property
    def ride(self) -> Ride:
        """The requested ride."""
        return self.boardings.ride

    def problem(self) -> ProblemWithOptions:
        """Return the problem with the ride."""
        problem, ride = self.boardings.problem, self.ride
        taken: float | None = None
        middle: list[AnyWaypoint] = [self._lead_in()]
        knots = self.boarding.path.knots
        previous = 0.0
        for k, waypoint in enumerate(self.boardings.waypoints):
            arrival = knots[2 * k + 1]
            middle.append(self._on_object(k, waypoint, previous))
            if taken is None and any(take.id == ride.thing.id for take in waypoint.attach):
                taken = self.boarding.begin + arrival
            previous = arrival
        middle.append(self._lead_out(previous))
        waypoints = [*problem.waypoints[: ride.first], *middle, *problem.waypoints[ride.last + 1 :]]
        inner = [ride.first, *ride.indices, ride.last + 1]
        indices = [*range(ride.first), *inner, *range(ride.last + 1, len(problem.waypoints))]
        paths = requested_paths(problem)
        given = {field.name: getattr(problem, field.name) for field in fields(PlanningProblem)}

        def moved(action: Action) -> Action:
            if not isinstance(action.at, AtWaypoint):
                return action
            index = action.at.waypoint
            return replace(action, at=AtWaypoint(index + (index >= ride.first) + (index > ride.last)))

        changed = {
            "waypoints": tuple(waypoints),
            "actions": tuple(map(moved, problem.actions)),
            "scene": self._scene(taken),
            "paths": tuple(paths[index] for index in indices),
        }
        return ProblemWithOptions(**(given | changed))

    def _scene(self, taken: float | None) -> Scene | None:
        """Return the scene, with the object moving by itself only until it is taken at a time, s."""
        scene, ride = self.boardings.problem.scene, self.ride
        if scene is None or taken is None:
            return scene

        def until(thing: SceneObject) -> SceneObject:
            if thing is not ride.thing:
                return thing
            motion = thing.motion
            assert isinstance(motion, ConstantVelocity)  # noqa: S101 - the check of the problem refuses others
            return replace(thing, motion=replace(motion, end=taken))

        return replace(scene, objects=tuple(map(until, scene.objects)))

    def _lead_in(self) -> RideEnd:
        """Return the waypoint where the robot begins to get on."""
        first, begin = self.boardings.waypoints[0], self.boarding.begin
        motion = first.motion if isinstance(first.motion, FreeMotion) else JointMotion("as_given")
        return RideEnd(
            self.boarding.start.tolist(),
            motion=motion,
            limits=first.limits,
            tool=first.tool,
            earliest_arrival=begin,
            latest_arrival=begin,
        )

    def _lead_out(self, previous: float) -> RideEnd:
        """Return the waypoint where the robot has got off; `previous` is the last arrival since the start, s."""
        path, limits = self.boarding.path, self.boardings.problem.waypoints[self.ride.last + 1].limits
        position = self.boarding.curve.evaluate(path.knots[-1:], [0])[0][0]
        motion = self._motion(previous, path.knots[-1])
        return RideEnd(position.tolist(), motion=motion, limits=limits, duration=float(path.lead_out))

    def _on_object(self, k: int, waypoint: PoseWaypoint, previous: float) -> FixedWaypoint:
        """Return a waypoint on the object at its joint position; `previous` is the arrival before, s."""
        knots = self.boarding.path.knots
        arrival, departure = knots[2 * k + 1], knots[2 * k] if k else knots[0]
        there = self.ride.thing.pose_at(self.boarding.time).to_frame(self.boardings.base)
        shift = (arrival - knots[1]) * self.boardings.velocity
        frame = replace(there, position=there.position + shift)
        requested = replace(waypoint, frame=frame)
        kept = {field.name: getattr(waypoint, field.name) for field in fields(Waypoint)}
        kept |= {
            "motion": self._motion(previous, arrival),
            "duration": float(arrival - departure),
            "minimum_duration": 0.0,
            "earliest_arrival": 0.0,
            "latest_arrival": waypoint.latest_arrival if k else None,
            "tool": None,
        }
        position = self.boarding.curve.evaluate(np.array([arrival]), [0])[0][0]
        return FixedWaypoint(position.tolist(), requested=requested, **kept)

    def _motion(self, begin: float, end: float) -> RideMotion:
        """Return the motion of the ride between times since its start, s."""
        curve, time = self.boarding.curve.between(begin, end), float(self.boarding.begin + end)
        return RideMotion("as_given", curve=curve, thing=self.ride.thing, end=time)
