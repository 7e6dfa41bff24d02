"""Joint positions of a list of waypoints, chosen together: the shortest path through their solutions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np

from planner.errors import JointPositionLimit, NearestPose, PlanningError, Remedy, UnreachableWaypoint, distinct
from planner.kinematics.configurations import Configuration
from planner.kinematics.costs import joint_times
from planner.kinematics.forward import tool_pose
from planner.kinematics.inverse import InverseKinematicsResult, IsFree, inverse_kinematics, solution_layers
from planner.kinematics.options import InverseKinematicsOptions
from planner.kinematics.search import Search, is_isolated, pose_errors, wide_spread
from planner.kinematics.turns import TURN
from planner.problems.problem import (
    AnyWaypoint,
    JointMotion,
    JointWaypoint,
    PoseWaypoint,
    RelativeWaypoint,
    ViaWaypoint,
)
from planner.problems.regions import Region
from planner.problems.rides import RideEnd
from planner.robots import Robot
from planner.robots.tools import with_tools
from planner.spatial import FloatArray, Pose
from planner.tolerances import POSITION_TOLERANCE, SAME_SOLUTION
from planner.tool_motions.redundancy.flattest import flattest_solutions
from planner.tool_motions.tool_motion import RefusedMotion, RequestedMotion, ToolMotion
from planner.waypoints.candidates import Layer, configuration_error, solutions_in
from planner.waypoints.choice import Passage, Stop, shortest_path, with_chosen_axes, with_starts_of_motions
from planner.waypoints.goal_regions import SettledWaypoint
from planner.waypoints.motion_remedies import motion_remedies
from planner.waypoints.pinned import pinned_robots, without_pins
from planner.waypoints.preferences import best_of_continuum, costs_of
from planner.waypoints.targets import moved_pose, of_other_tool, pose_remedy, wanted_poses

Choice = Literal["given", "only", "shortest_path", "preferred", "continued", "detour"]

FREE_START_WEIGHT = 0.01
"""Weight of the time from the middle of the limits to a first waypoint without reference: it decides among equals."""

MILLIMETRE = 1e-3
"""A millimetre, m."""

MANY_METRES = 10.0
"""Distance out of reach, m, above which a position may be meant in millimetres: more than any arm's size."""


@dataclass(frozen=True, eq=False)
class SolvedWaypoint:
    """A waypoint with its joint position, confirmed by forward kinematics.

    Attributes:
        name: The requested name.
        wanted: The requested pose; for a joint waypoint, the pose of its joint position.
        position: (joints,), rad or m.
        pose: Pose of the tool there.
        position_error: Distance from the requested pose, m; 0 for a joint waypoint.
        orientation_error: Angle from the requested orientation, rad; None: the request has none.
        solutions: Number of isolated solutions in the requested configuration; only the collision-free ones, if any.
            None: a joint waypoint, a tolerance region with a tool motion after it, or a continuum.
        solution: Index of the chosen solution, in the order of time from the waypoint before: 0 is the nearest. None: a
            joint waypoint, or a continuum.
        choice: Reason for the choice. `given`: a joint waypoint. `only`: the only solution. `shortest_path`: it makes
            the path through the whole list shortest. `preferred`: the best by the preference of the options.
            `continued`: a Cartesian motion ends there. `detour`: a corner of the detour of a free motion.
        tool_motion: The motion of the tool that ends here, followed; None: a joint motion.
    """

    name: str | None
    wanted: Pose
    position: FloatArray
    pose: Pose
    position_error: float
    orientation_error: float | None
    solutions: int | None
    solution: int | None
    choice: Choice
    tool_motion: ToolMotion | None = None


def solve_waypoints(
    robot: Robot,
    waypoints: Sequence[AnyWaypoint],
    options: InverseKinematicsOptions,
    is_free: IsFree | None = None,
) -> tuple[SolvedWaypoint, ...]:
    """Compute the joint positions of all waypoints, on the shortest path through their solutions.

    `shortest_path` defines the length. The path starts at `options.reference`. Without a reference it may start
    anywhere, and the middle of the limits decides between equals. A waypoint whose pose depends on the joint position
    chosen at the waypoint before splits the list: the part before it is chosen first.

    Args:
        robot: The robot, with the tool that it has until a waypoint changes it.
        waypoints: The first is not relative.
        options: Tolerances, reference and seed.
        is_free: Function that tells which joint positions are collision-free; a pose uses only these, if it has any.
            None: no obstacles.

    Raises:
        UnreachableWaypoint: A pose has no solution; the nearest pose found comes with it.
        JointPositionLimit: A joint position lies outside the limits, or a pose has solutions only there.
        InvalidProblem: No one circle goes through three poses.
        PlanningError: The error of the first motion that could not be followed, where no other way is left.
    """
    robots = with_tools(robot, [waypoint.tool for waypoint in waypoints])
    return _Sequence(robots, waypoints, options, is_free).solve()


class _Sequence:
    def __init__(
        self,
        robots: Sequence[Robot],
        waypoints: Sequence[AnyWaypoint],
        options: InverseKinematicsOptions,
        is_free: IsFree | None,
    ) -> None:
        self.robot, self.robots = robots[0], robots
        self.waypoints, self.options, self.is_free = waypoints, options, is_free
        self.pinned = pinned_robots(robots, waypoints)
        self.wanted = wanted_poses(robots, waypoints)
        # Of the tool that continues from there: the pose requested at the waypoint before each.
        changes = zip(self.wanted, robots, robots[1:], strict=False)
        self.before: list[Pose | None] = [None, *(of_other_tool(pose, own, other) for pose, own, other in changes)]
        self.given_ahead: list[FloatArray | None] = [None] * (len(waypoints) + 1)  # at a waypoint, or after it
        for index in range(len(waypoints) - 1, -1, -1):
            waypoint = waypoints[index]
            ahead = self.given_ahead[index + 1]
            self.given_ahead[index] = np.array(waypoint.position) if isinstance(waypoint, JointWaypoint) else ahead

    def solve(self) -> tuple[SolvedWaypoint, ...]:
        position, weight, prefer = self.robot.middle, FREE_START_WEIGHT, self.options.prefer
        if self.options.reference is not None:
            position, weight = np.array(self.options.reference), 1.0
        solved: list[SolvedWaypoint] = []
        ends = [*filter(self._depends_on_position, range(len(self.waypoints))), len(self.waypoints)]
        for end in ends:
            stops = self._stops(solved, end, position)
            way = shortest_path(self.robot, stops, position, weight, prefer)
            if isinstance(way, RefusedMotion) and not way.is_out_of_reach:
                wider = self._with_wider_choice(stops)
                if wider != stops:
                    way = shortest_path(self.robot, wider, position, weight, prefer)
            if isinstance(way, RefusedMotion) and not way.is_out_of_reach and self.robot.external_axes:
                with_axes = shortest_path(self.robot, with_chosen_axes(stops), position, weight, prefer)
                way = way if isinstance(with_axes, RefusedMotion) else with_axes
            if isinstance(way, RefusedMotion):
                raise way.error.with_remedies(motion_remedies(way, self.waypoints[way.requested.index - 1]))
            for stop, passage in zip(stops, way, strict=True):
                solved.append(self._solved(stop, position, passage))
                position, weight = passage.position, 1.0
        return tuple(solved)

    def _stops(self, solved: list[SolvedWaypoint], end: int, start: FloatArray) -> list[Stop]:
        """Return the waypoints from those solved to `end`, with all that they may be solved with."""
        for index in range(len(solved), end):
            if index == 0 or not self._depends_on_position(index):
                continue
            waypoint = self.waypoints[index]  # the first of this part
            before, there = solved[-1].wanted, tool_pose(self.robots[index], solved[-1].position)
            if self.robots[index] is not self.robots[index - 1]:
                before = Pose(there.position, None if before.rotation is None else there.rotation)
            self.before[index] = before
            if isinstance(waypoint, RelativeWaypoint):
                self.wanted[index] = moved_pose(before, there.rotation, waypoint)
                if index + 1 < len(self.before):
                    self.before[index + 1] = of_other_tool(self.wanted[index], *self.robots[index : index + 2])
        wanted = {
            index: pose
            for index in range(len(solved), end)
            if not isinstance(self.waypoints[index], JointWaypoint) and (pose := self.wanted[index]) is not None
        }
        layers: dict[int, tuple[FloatArray, ...]] = {}
        for pinned in dict.fromkeys(self.pinned[index] for index in wanted):
            poses = {index: pose for index, pose in wanted.items() if self.pinned[index] is pinned}
            options = pinned.options(self.options)
            found = solution_layers(pinned.robot, list(poses.values()), options, pinned.own(start))
            layers |= dict(zip(poses, found, strict=True))
        stops: list[Stop] = []
        near = start
        for index in range(len(solved), end):
            waypoint = self.waypoints[index]
            if isinstance(waypoint, JointWaypoint):
                near = np.array(waypoint.position)
                if (error := position_limit_error(self.robot, index, near)) is not None:
                    raise error
                layer = Layer.given(near, self._may_turn(index))
            else:
                layer = self._layer(index, wanted[index], layers[index], near)
            costs = None if layer.is_given else costs_of(self.robots[index], self.options)
            stops.append(Stop(index, layer, self._requested_motion(index, layer), costs))
        return with_starts_of_motions(self.robot, stops)

    def _with_wider_choice(self, stops: list[Stop]) -> list[Stop]:
        """Return the stops, with more solutions of a redundant arm where motions of the tool begin."""
        wider = list(stops)
        for k, (stop, after) in enumerate(pairwise(stops)):
            pose, pinned = self.wanted[stop.index], self.pinned[stop.index]
            is_start = stop.layer.descend is not None and stop.requested is None and after.requested is not None
            if pose is not None and is_start and pinned.robot.dof > (3 if pose.rotation is None else 6):
                found = wide_spread(Search(pinned.robot, pose, pinned.options(self.options)))
                more = stop.layer.with_solutions(self.robot, pinned.solutions(found))
                wider[k] = replace(stop, layer=self._where_free(more))
        return wider

    def _depends_on_position(self, index: int) -> bool:
        """Tell whether a waypoint, or the start of the tool motion to it, depends on the joint position before."""
        waypoint = self.waypoints[index]
        return index > 0 and (
            self.wanted[index] is None or (self.before[index] is None and not isinstance(waypoint.motion, JointMotion))
        )

    def _may_turn(self, index: int) -> np.ndarray:
        """Return the joints (joints,), bool, that take the short way to a joint waypoint."""
        may_turn, motion = self.robot.is_continuous, self.waypoints[index].motion
        if index == 0 or not isinstance(motion, JointMotion) or motion.turns == "as_given":
            return np.zeros_like(may_turn)
        for waypoint in self.waypoints[index - 1 : index + 1]:
            if isinstance(waypoint, JointWaypoint):
                may_turn = may_turn & (np.abs(waypoint.position) <= TURN / 2.0 + POSITION_TOLERANCE)
        return may_turn

    def _layer(self, index: int, pose: Pose, solutions: tuple[FloatArray, ...], near: FloatArray) -> Layer:
        """Return the layer of a pose: `solutions` are of the joints that are not pinned, `near` (joints,) is of all."""
        waypoint, pinned = self.waypoints[index], self.pinned[index]
        robot, options = pinned.robot, pinned.options(self.options)
        if not solutions:
            result = pinned.failure(inverse_kinematics(robot, pose, options, pinned.own(near)))
            before = self.before[index]
            axes = None if before is None else before.rotation
            error = unreachable_error(self.robots[index], index, waypoint, pose, result, before, axes)
            error.remedies = (*error.remedies, *without_pins(self.robots[index], index, waypoint, pose, near))
            raise error
        wanted = waypoint.configuration if isinstance(waypoint, PoseWaypoint) else Configuration()
        allowed = solutions_in(robot, pose, solutions, wanted, options)
        if not allowed:
            raise configuration_error(robot, index, pose, solutions, wanted, options)
        if isinstance(waypoint, SettledWaypoint):
            return Layer.settled(pinned.own(np.array(waypoint.position))).on_pins(pinned)
        given = self.given_ahead[index]
        ahead = near if given is None else given
        if options.prefer == "near_reference":
            ahead = np.array(self.options.reference)
        if is_isolated(robot, pose, allowed[0]):
            return self._where_free(Layer.isolated(robot, allowed, pinned.own(ahead)).on_pins(pinned))
        layer = Layer.continuum(robot, allowed, pinned.own(ahead), pose, options, wanted).on_pins(pinned)
        if (costs := costs_of(robot, options)) is not None:
            is_flat = options.prefer == "weld_flat"
            flattest = flattest_solutions(robot, pose, Region(), options, pinned.own(near)) if is_flat else []
            best = [q for q, _ in flattest] or best_of_continuum(robot, pose, options, allowed, costs, wanted)
            layer = layer.with_solutions(self.robots[index], pinned.solutions(best))
        return self._where_free(layer)

    def _where_free(self, layer: Layer) -> Layer:
        return layer if self.is_free is None else layer.where_free(self.is_free)

    def _requested_motion(self, index: int, layer: Layer) -> RequestedMotion | None:
        waypoint = self.waypoints[index]
        if index == 0 or isinstance(waypoint.motion, JointMotion):
            return None
        before, after = self.before[index], self.wanted[index]
        assert before is not None and after is not None  # noqa: S101 - filled in before
        return RequestedMotion(self.robots[index], self.options, index, waypoint, before, after, layer.pinned_ends)

    def _solved(self, stop: Stop, before: FloatArray, passage: Passage) -> SolvedWaypoint:
        position, motion = passage
        robot, waypoint, wanted = self.robots[stop.index], self.waypoints[stop.index], self.wanted[stop.index]
        assert wanted is not None  # noqa: S101 - filled in by _stops
        if stop.layer.is_given:
            as_requested = type(waypoint) is JointWaypoint and wanted.rotation is not None
            known = as_requested and bool((position == stop.layer.positions[0]).all())
            pose = wanted if known else tool_pose(robot, position)
            why: Choice = "detour" if isinstance(waypoint, ViaWaypoint | RideEnd) else "given"
            return SolvedWaypoint(waypoint.name, wanted, position, pose, 0.0, 0.0, None, None, why, motion)
        pose = tool_pose(robot, position)
        errors = pose_errors(wanted, pose)
        count, taken = _rank(robot, stop.layer, before, position)
        choice: Choice = "shortest_path" if stop.costs is None else "preferred"
        choice = "continued" if motion else "only" if count == 1 else choice
        return SolvedWaypoint(waypoint.name, wanted, position, pose, *errors, count, taken, choice, motion)


def _rank(robot: Robot, layer: Layer, before: FloatArray, position: FloatArray) -> tuple[int | None, int | None]:
    """Count the solutions, and the solutions nearer to `before` than the chosen one."""
    if layer.descend is not None or not layer.solutions:
        return None, None
    times = joint_times(robot, before, layer.reached_from(before[None])[0, : layer.solutions]).max(axis=1)
    away = position - layer.positions[: layer.solutions]
    away -= np.where(robot.is_angle, TURN * np.round(away / TURN), 0.0)
    distance = np.abs(away).max(axis=1)
    if distance.min() > SAME_SOLUTION:  # followed to a solution that was not among them
        nearer = times < joint_times(robot, before, position).max()
        return layer.solutions + 1, int(np.count_nonzero(nearer))
    order = times.argsort(kind="stable")
    return layer.solutions, int(np.flatnonzero(order == distance.argmin())[0])


def within_limits(robot: Robot, waypoints: Sequence[AnyWaypoint], tolerance: float) -> tuple[AnyWaypoint, ...]:
    """Put joint positions at most `tolerance` (rad or m) outside of the position limits onto these."""
    within = list(waypoints)
    given, positions = given_positions(robot, waypoints)
    clipped = np.clip(positions, robot.limit("lower"), robot.limit("upper"))
    away = np.abs(positions - clipped).max(axis=1)
    for row in np.flatnonzero((away > 0.0) & (away <= tolerance)).tolist():
        within[given[row]] = replace(within[given[row]], position=clipped[row])
    return tuple(within)


def given_positions(robot: Robot, waypoints: Sequence[AnyWaypoint]) -> tuple[list[int], FloatArray]:
    """Return the joint waypoints: their indices, and their positions (waypoints, joints) as given."""
    given = {i: waypoint.position for i, waypoint in enumerate(waypoints) if isinstance(waypoint, JointWaypoint)}
    return list(given), np.array([*given.values()]).reshape(-1, robot.dof)


def position_limit_error(robot: Robot, index: int, q: FloatArray) -> JointPositionLimit | None:
    """Return the error of the joint position (joints,) of a joint waypoint; None: there is none."""
    lower, upper = robot.limit("lower"), robot.limit("upper")
    outside = (q < lower) | (q > upper)
    if not outside.any():
        return None
    joint = int(np.argmax(outside))
    limit = float(lower[joint] if q[joint] < lower[joint] else upper[joint])
    there, end = distinct(float(q[joint]), limit)
    return JointPositionLimit(
        f"waypoint {{waypoint}} puts {robot.joint_names[joint]} at {there}, its limit is {end}",
        waypoint=index,
        joint=robot.joint_names[joint],
        value=float(q[joint]),
        limit=limit,
        remedies=[Remedy(("waypoints", index, "position", joint), limit, "the nearest position within the limits")],
    )


def unreachable_error(
    robot: Robot,
    index: int,
    waypoint: AnyWaypoint,
    wanted: Pose,
    result: InverseKinematicsResult,
    before: Pose | None,
    axes: FloatArray | None,
) -> PlanningError:
    """Build the refusal of a waypoint whose pose has no solution.

    Args:
        robot: The robot, with its tool.
        index: Index of the waypoint.
        waypoint: The requested waypoint.
        wanted: Its pose.
        result: The result of the search for a solution.
        before: The requested pose at the waypoint before, if any.
        axes: (3, 3), of the tool there, if they are known.
    """
    near = Pose(result.pose.position, None if wanted.rotation is None else result.pose.rotation)
    nearest = NearestPose(near, result.position, result.position_error, result.orientation_error)
    away = f"{result.position_error * 1000.0:.4g} mm"
    if result.orientation_error is not None:
        away += f" and {np.degrees(result.orientation_error):.4g} deg"
    remedies = pose_remedy(index, waypoint, near, before, axes, f"the nearest reachable pose found, {away} away")
    if isinstance(waypoint, PoseWaypoint) and result.position_error > MANY_METRES:
        in_metres = replace(waypoint, pose=Pose(waypoint.pose.position * MILLIMETRE, waypoint.pose.rotation))
        if inverse_kinematics(robot, in_metres.pose_in_base).status == "solved":
            explanation = "the position looks like millimetres; it is in m"
            remedies = [Remedy(("waypoints", index, "pose"), in_metres.pose, explanation)]
            away += "; the position looks like millimetres, and is in metres"
    if result.status == "joint_position_limit":
        joint = robot.joints[robot.joint_names.index(str(result.joint))]
        value = float(result.value or 0.0)
        limit = joint.lower if value < joint.lower else joint.upper
        there, end = distinct(value, float(limit))
        return JointPositionLimit(
            f"waypoint {{waypoint}} can be reached only with {joint.name} at {there}, its limit is {end}; "
            f"within the limits the nearest pose found is {away} away",
            waypoint=index,
            joint=joint.name,
            value=value,
            limit=float(limit),
            remedies=remedies,
            nearest=nearest,
        )
    return UnreachableWaypoint(
        f"no joint position of {robot.id} reaches waypoint {{waypoint}}; the nearest pose found is {away} away",
        waypoint=index,
        remedies=remedies,
        nearest=nearest,
    )
