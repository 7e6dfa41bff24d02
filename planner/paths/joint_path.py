"""The joint path through waypoints: every waypoint is solved, and every motion is joined to the next."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from planner.dynamics import SegmentDynamics
from planner.errors import InvalidProblem
from planner.kinematics.turns import counted_velocity
from planner.limits import SegmentLimits
from planner.paths.clear_motions import ClearMotions
from planner.paths.half_spaces import HalfSpaces
from planner.paths.segment_groups import SegmentGroup, build_group, is_joint_motion, straight_group, travel_time
from planner.problems.problem import AnyWaypoint, JointMotion, PlanningProblem
from planner.problems.rides import RideMotion, unplanned_faults
from planner.problems.transitions import BlendTransition, StopTransition, ThroughTransition, Transition
from planner.robots import Robot
from planner.robots.payload import Payload, ProcessForce
from planner.spatial import FloatArray
from planner.tool_motions.pose_paths import PosePath
from planner.trajectories.polynomials import PiecewisePolynomial
from planner.trajectories.trajectory import Trajectory
from planner.waypoints.goal_regions import with_chosen_poses
from planner.waypoints.solve import SolvedWaypoint, solve_waypoints, within_limits

SHORTEST_REST = 0.01
"""Duration of a trajectory, s, without motion and without a requested rest.

A trajectory needs a positive duration; this is one step of a controller at 100 Hz.
"""

SHORT_MOTION_RATIO = 0.03
"""Duration at full speed, relative to the longest of the next motions, up to which a motion is too short to turn in."""

SHARP = 0.3
"""Difference of the joints' rates, relative to their velocity limits, above which a waypoint between two motions at
full speed is a turn."""


@dataclass(frozen=True, eq=False)
class StraightMotions:
    """Straight joint motions from rest to rest, row by row.

    Attributes:
        robot: The robot, with its tool.
        dynamics: The robot with its payloads.
        segments: (rows,), index of each.
        starts: (rows, joints).
        travels: (rows, joints), from the start of each to its end.
        durations: (rows,), s; NaN: as fast as the limits allow.
        limits: The limits in force on each.
    """

    robot: Robot
    dynamics: SegmentDynamics
    segments: np.ndarray
    starts: FloatArray
    travels: FloatArray
    durations: FloatArray
    limits: SegmentLimits

    def of(self, rows: np.ndarray) -> StraightMotions:
        """Return some of them, by index or mask."""
        arrays = (self.segments[rows], self.starts[rows], self.travels[rows], self.durations[rows])
        return StraightMotions(self.robot, self.dynamics, *arrays, self.limits.of(rows))


@dataclass(frozen=True, eq=False)
class JointPath:
    """The joints' path without time. It exists only if all waypoints are solved and the joints can follow all motions.

    Neighbouring waypoints that differ only by rounding have exactly the same joint position. The segment between them
    has no length, unless the tool makes a closed motion there. Such a segment belongs to no segment group and is no
    straight motion: the robot rests there for the requested time, if any.

    Attributes:
        robot: The arm, with the tool and the payload that it starts with.
        dynamics: The arm with the payload and the tool that it has on each segment.
        waypoints: The solved waypoints, in order; segment i goes from waypoint i to waypoint i + 1.
        limits: The limits in force on each segment.
        durations: (segments,), s; NaN: as fast as the limits allow.
        dwells: (waypoints,), s.
        groups: The segment groups and the tool motions. All other segments with a length are straight joint motions
            from rest to rest.
        tool_motions: (segments,), the path of the tool; None: a joint motion.
        passed_at: The velocities (joints,), rad/s or m/s, requested at passed waypoints, by the segment that begins
            there.
        half_spaces: Half spaces for the path of a back end that searches between joint waypoints; None: no restriction.
        rides: The curves of the segments of rides, with time of their own: see `RideMotion`. Back ends rest there.
    """

    robot: Robot
    dynamics: SegmentDynamics
    waypoints: tuple[SolvedWaypoint, ...]
    limits: SegmentLimits
    durations: FloatArray
    dwells: FloatArray
    groups: tuple[SegmentGroup, ...]
    tool_motions: tuple[PosePath | None, ...]
    passed_at: Mapping[int, FloatArray] = field(default_factory=dict)
    half_spaces: HalfSpaces | None = None
    rides: Mapping[int, PiecewisePolynomial] = field(default_factory=dict)

    def __repr__(self) -> str:
        """Return robot and number of waypoints, in one line."""
        return f"JointPath({self.robot.id!r}, {len(self.waypoints)} waypoints)"

    def keeping(self, quantities: Collection[str]) -> JointPath:
        """Return the path without those limits of the tool that are not among some quantities."""
        others = self.limits.of_tool.keys() - set(quantities)
        return replace(self, limits=self.limits.without(others)) if others else self

    @cached_property
    def positions(self) -> FloatArray:
        """The joint positions (waypoints, joints) of the waypoints, rad or m."""
        return np.array([waypoint.position for waypoint in self.waypoints])

    @cached_property
    def moving(self) -> np.ndarray:
        """Indices of the segments that have a length and no time of their own, ascending."""
        return _moving(self.waypoints, self.rides)

    @cached_property
    def still(self) -> np.ndarray:
        """Indices of the other segments, ascending."""
        still = np.ones(len(self.durations), dtype=bool)
        still[self.moving] = False
        return np.flatnonzero(still)

    def positions_of(self, group: SegmentGroup) -> FloatArray:
        """Return the joint positions (segments + 1, joints) of the waypoints of a segment group, rad or m."""
        positions: FloatArray = self.positions[np.append(group.segments, group.segments[-1] + 1)]
        return positions

    @cached_property
    def every_group(self) -> tuple[SegmentGroup, ...]:
        """The groups, and each straight motion as a segment group of its own, in order."""
        own = self.straight_groups(self.straight.segments)
        return tuple(sorted((*self.groups, *own), key=lambda group: group.first))

    def rows_of_groups(self, trajectory: Trajectory) -> list[np.ndarray]:
        """Return the indices of the pieces that each of `every_group` has in a trajectory, without dwells."""
        moves = trajectory.moves
        return [np.flatnonzero(moves & np.isin(trajectory.segments, group.segments)) for group in self.every_group]

    @cached_property
    def straight(self) -> StraightMotions:
        """The segments that have a length and belong to no group."""
        in_groups = {segment for group in self.groups for segment in group.segments.tolist()}
        return self.straight_motions(np.array([k for k in self.moving.tolist() if k not in in_groups], dtype=int))

    def straight_motions(self, segments: np.ndarray) -> StraightMotions:
        """Return straight joint motions from waypoint to waypoint, with rest at both."""
        starts = self.positions[segments]
        travels = self.positions[segments + 1] - starts
        durations, limits = self.durations[segments], self.limits.of(segments).along(travels)
        return StraightMotions(self.robot, self.dynamics, segments, starts, travels, durations, limits)

    def straight_groups(self, segments: np.ndarray) -> list[SegmentGroup]:
        """Make each of these segments a segment group of its own, straight from waypoint to waypoint."""
        most = self.limits.velocity.narrower
        return [
            straight_group(segment, self.positions[segment], self.positions[segment + 1], most[segment])
            for segment in segments.tolist()
        ]


def solve_path(problem: PlanningProblem) -> JointPath:
    """Solve the waypoints, choose their branches and join their motions.

    Raises:
        InvalidProblem: A corner cannot be passed; there is no path through the poses of a motion of the tool.
        UnreachableWaypoint: A pose has no solution, or a motion of the tool leaves the arm's workspace.
        JointPositionLimit: A waypoint or the way to it lies beyond a joint's position limits.
        ConfigurationChange: A motion of the tool ends in another configuration than its waypoint.
        SingularPath: A motion of the tool meets a singularity.
    """
    dynamics = dynamics_of(problem)
    robots = problem.robots
    waypoints, solved = solved_waypoints(problem)
    limits = problem.segment_limits()
    dwells = np.array([waypoint.dwell for waypoint in waypoints])
    rides = {k: w.motion.curve for k, w in enumerate(waypoints[1:]) if isinstance(w.motion, RideMotion)}
    moving = _moving(solved, rides)
    durations = np.array(
        [_rest_time(waypoint) if k not in moving else waypoint.duration for k, waypoint in enumerate(waypoints[1:])],
        dtype=float,
    )
    transitions = [_transition(waypoints[before + 1 : after + 1]) for before, after in pairwise(moving.tolist())]
    transitions = _with_stops_where_sharp(solved, limits, moving, transitions)
    stops = _stops(transitions)
    groups = tuple(
        build_group(
            robots[moving[first] + 1], waypoints, solved, limits, moving[first:last], transitions[first : last - 1]
        )
        for first, last in pairwise([0, *stops, len(moving)])
        if last > first + 1 or (last > first and not isinstance(waypoints[moving[first] + 1].motion, JointMotion))
    )
    if not len(moving) and np.nansum([*durations, *dwells]) == 0.0:
        dwells[-1] = SHORTEST_REST if problem.duration is None else problem.duration
    return JointPath(
        robot=dynamics.robots[0],
        dynamics=dynamics,
        waypoints=solved,
        limits=limits,
        durations=durations,
        dwells=dwells,
        groups=groups,
        tool_motions=tuple(
            None if waypoint.tool_motion is None else waypoint.tool_motion.path for waypoint in solved[1:]
        ),
        passed_at=_passed_at(waypoints, moving, transitions),
        rides=rides,
    )


def solved_waypoints(problem: PlanningProblem) -> tuple[tuple[AnyWaypoint, ...], tuple[SolvedWaypoint, ...]]:
    """Choose the open coordinates of waypoints and solve the waypoints.

    Raises:
        PlanningError: As `solve_waypoints` does.
    """
    options = problem.inverse_kinematics
    if faults := list(unplanned_faults(problem.waypoints)):
        raise InvalidProblem(faults)
    waypoints = within_limits(problem.robot, problem.waypoints, problem.start_tolerance)
    surroundings = ClearMotions.of(problem, waypoints)
    is_free = None if surroundings is None else surroundings.is_free
    waypoints = with_chosen_poses(problem.robot, waypoints, options, surroundings)
    solved = solve_waypoints(problem.robot, waypoints, options, is_free=is_free)
    if surroundings is not None:
        settled = surroundings.with_clear_branches(waypoints, solved)
        if any(other is not waypoint for other, waypoint in zip(settled, waypoints, strict=True)):
            return settled, solve_waypoints(problem.robot, settled, options, is_free=is_free)
    return waypoints, solved


def dynamics_of(problem: PlanningProblem) -> SegmentDynamics:
    """Return the robot with payload, tool and process force on each segment, and at the end."""
    payloads, robots = problem.payloads, problem.robots
    carried = [*payloads[: max(1, len(payloads) - 1)], payloads[-1]]
    tools = [*(robots[1:] or robots), robots[-1]]
    forces = [waypoint.process_force for waypoint in problem.waypoints[1:] or problem.waypoints]
    every = list(zip(tools, carried, [*forces, None], strict=True))
    loaded = {one: _loaded(*one) for one in dict.fromkeys(every)}
    return SegmentDynamics.of_robots([loaded[one] for one in every])


def _loaded(robot: Robot, payload: Payload | None, force: ProcessForce | None) -> Robot:
    """Return the robot with a payload and a process force."""
    robot = robot if payload is None else robot.with_payload(payload)
    return robot if force is None else replace(robot, process_force=force)


def _moving(solved: Sequence[SolvedWaypoint], rides: Collection[int]) -> np.ndarray:
    """Return the segments, but for rides, between different joint positions, or where the tool goes and comes back."""
    pairs = ((k, *ends) for k, ends in enumerate(pairwise(solved)) if k not in rides)
    moving = [k for k, start, end in pairs if (start.position != end.position).any() or not is_joint_motion(end)]
    return np.array(moving, dtype=int)


def _stops(transitions: Sequence[Transition]) -> list[int]:
    """Return the numbers of the segments that begin at a stop."""
    return [k for k, transition in enumerate(transitions, 1) if isinstance(transition, StopTransition)]


def _with_stops_where_sharp(
    solved: Sequence[SolvedWaypoint],
    limits: SegmentLimits,
    moving: np.ndarray,
    transitions: Sequence[Transition],
) -> list[Transition]:
    """Replace transitions (segments - 1,) that almost stop the robot by stops.

    These are exact passages between two motions in different directions, one of them a joint motion, and one short
    beside its neighbours. Such a turn takes as long as a stop, and its curve is hard to time. Waypoints between joint
    motions that are all passed exactly stay: the path between them is free.
    """
    result = list(transitions)
    travels = np.diff(np.array([waypoint.position for waypoint in solved]), axis=0)[moving]
    speeds = counted_velocity(limits.velocity.narrower[moving])
    ends = [solved[k + 1] for k in moving]
    times = np.array(list(map(travel_time, ends, travels, speeds)))
    rates = travels / speeds / times[:, None]
    turns = np.abs(np.diff(rates, axis=0)).max(axis=1, initial=0.0) > SHARP
    for first, last in pairwise([0, *_stops(transitions), len(moving)]):
        joint = [is_joint_motion(solved[segment + 1]) for segment in moving[first:last]]
        passed = [isinstance(transition, ThroughTransition) for transition in transitions[first : last - 1]]
        if all(joint) and all(passed):
            continue
        for k in np.flatnonzero(turns[first : last - 1] & np.array(passed, dtype=bool)).tolist():
            around = times[first:last][max(0, k - 1) : k + 3]
            if any(joint[k : k + 2]) and times[first + k : first + k + 2].min() <= SHORT_MOTION_RATIO * around.max():
                result[first + k] = StopTransition()
    return result


def _passed_at(
    waypoints: Sequence[AnyWaypoint], moving: np.ndarray, transitions: Sequence[Transition]
) -> dict[int, FloatArray]:
    """Return the requested velocities (joints,) at passed waypoints, by the segment that begins there.

    Raises:
        InvalidProblem: Waypoints at one joint position request different velocities, or one requests a stop.
    """
    passed = {
        int(segment): transition.velocity
        for segment, transition in zip(moving[1:], transitions, strict=True)
        if isinstance(transition, ThroughTransition) and transition.velocity is not None
    }
    for i, waypoint in enumerate(waypoints):
        transition, next_ones = waypoint.transition, moving[moving >= i]
        requested = transition.velocity if isinstance(transition, ThroughTransition) else None
        if requested is not None and (not len(next_ones) or passed.get(int(next_ones[0])) != requested):
            field = "waypoints", i, "transition", "velocity"
            raise InvalidProblem([(field, "another waypoint at this position is passed otherwise, or the robot stops")])
    return {segment: np.array(velocity) for segment, velocity in passed.items()}


def _rest_time(waypoint: AnyWaypoint) -> float | None:
    """Return the requested rest of a segment of no length, s; None: no rest."""
    return waypoint.minimum_duration or None if waypoint.duration is None else waypoint.duration


def _transition(waypoints: Sequence[AnyWaypoint]) -> Transition:
    """Join the transitions of waypoints at one joint position.

    The strictest of their transitions holds, with the smallest radius. The robot also stops if the request has a
    duration from one to the next, which is a rest.
    """
    transitions = [waypoint.transition for waypoint in waypoints]
    rests = any(_rest_time(waypoint) is not None for waypoint in waypoints[1:])
    if rests or any(isinstance(transition, StopTransition) for transition in transitions):
        return StopTransition()
    passed = [transition for transition in transitions if isinstance(transition, ThroughTransition)]
    if passed:
        return next((transition for transition in passed if transition.velocity is not None), passed[0])
    return BlendTransition(
        min(transition.radius for transition in transitions if isinstance(transition, BlendTransition))
    )
