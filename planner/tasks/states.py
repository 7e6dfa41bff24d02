"""The states of tasks: a direction, an entry and joint positions with which the robot may carry out a task."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from planner.errors import InvalidProblem, PlanningError, UnreachableWaypoint
from planner.kinematics.configurations import in_configuration
from planner.kinematics.forward import tool_pose
from planner.kinematics.inverse import IsFree, solution_layers
from planner.kinematics.turns import TURN
from planner.paths.joint_path import solved_waypoints
from planner.problems.problem import (
    AnyWaypoint,
    CartesianMotion,
    JointMotion,
    JointWaypoint,
    PlanningProblem,
    PoseWaypoint,
    RelativeWaypoint,
)
from planner.problems.regions import region_of
from planner.robots import Robot
from planner.scene import Handling, is_free
from planner.scene.carried import checker_at_waypoints
from planner.spatial import FloatArray, Pose
from planner.tasks.options import combinations, with_options
from planner.tasks.task import Task, Visit
from planner.tasks.travel import JointSpeeds
from planner.tolerances import POSITION_TOLERANCE
from planner.tool_motions.tool_motion import RefusedMotion, RequestedMotion, follow_motion
from planner.waypoints.pinned import pinned_robots
from planner.waypoints.solve import within_limits
from planner.waypoints.targets import moved_pose

TURN_SAMPLES = 12
"""The number of turns about the tool's z axis, in a whole turn, that a state may have where the turn is free."""

SAMPLES_OF_MOTION = 17
"""The number of joint positions on a tool motion by which its duration is estimated."""


class NoState(Exception):
    """A task has no state.

    Attributes:
        task: Index of the task.
        options: The options of its goal sets to which the reason belongs.
        refusal: The reason, with the index of a waypoint of the task with these options.
    """

    def __init__(self, task: int, options: tuple[int, ...], refusal: PlanningError) -> None:
        super().__init__(refusal)
        self.task, self.options, self.refusal = task, options, refusal


class Carried(NamedTuple):
    """A task carried out forwards from its first waypoint.

    Attributes:
        positions: (waypoints, joints), rad or m; of a closed contour the first waypoint again at the end.
        duration: The estimated duration, s.
    """

    positions: FloatArray
    duration: float


@dataclass(frozen=True, eq=False)
class States:
    """The states of all tasks, one task after the other.

    Attributes:
        entries: (states, joints), rad or m: where the robot begins a task.
        exits: (states, joints), rad or m: where it ends the task.
        durations: (states,), s: the estimated durations between the two.
        tasks: (states,): the index of the task of each state, ascending.
        opposites: (states,): the index of the state in the opposite direction; the state itself if there is none.
        visits: The options, the direction and the first waypoint of each state.
        positions: The joint positions (steps, joints) of each state at the waypoints.
    """

    entries: FloatArray
    exits: FloatArray
    durations: FloatArray
    tasks: np.ndarray
    opposites: np.ndarray
    visits: list[Visit]
    positions: list[FloatArray]

    @cached_property
    def of_tasks(self) -> list[np.ndarray]:
        """The indices of the states of each task."""
        ends = np.searchsorted(self.tasks, np.arange(self.tasks[-1] + 2))
        return [np.arange(first, last) for first, last in pairwise(ends.tolist())]


def states_of_tasks(
    problem: PlanningProblem,
    tasks: Sequence[Task],
    robots: Sequence[Robot],
    near: FloatArray | None,
    speeds: JointSpeeds,
) -> States:
    """Find the states of all tasks.

    Args:
        problem: The options, the limits and the scene.
        tasks: The tasks.
        robots: The robot with the tool of each task.
        near: (joints,), rad or m: the joint position to which solutions are turned. None: the reference of the options,
            or the middle of the limits.
        speeds: The limits by which durations are estimated.

    Raises:
        NoState: A task has no state.
    """
    every = [(i, options) for i, task in enumerate(tasks) for options in combinations(task)]
    chosen = [with_options(problem, tasks[i], options).task for i, options in every]
    candidates = _candidates(problem, chosen, [robots[i] for i, _ in every], near)
    entries, exits, durations, of_task, opposites = [], [], [], [], []
    visits: list[Visit] = []
    positions: list[FloatArray] = []
    for (index, options), task, own_candidates in zip(every, chosen, candidates, strict=True):
        try:
            carried = _carried(replace(problem, robot=robots[index]), task, own_candidates, speeds)
        except InvalidProblem as refusal:
            raise NoState(index, options, refusal) from None
        for forwards in carried:
            for visit in task.visits():
                there = _on_visit(problem, forwards.positions, visit)
                if there is None:
                    continue
                opposites.append(len(positions) + (0 if not task.reversible else -1 if visit.is_reversed else 1))
                entries.append(there[0])
                exits.append(there[-1])
                durations.append(forwards.duration + task.waypoints[visit.first].dwell - task.waypoints[0].dwell)
                of_task.append(index)
                visits.append(visit._replace(options=options))
                positions.append(there)
    for (index, options), task in zip(every, chosen, strict=True):
        if index not in of_task:
            raise NoState(index, options, _refusal(replace(problem, robot=robots[index]), task))
    return States(
        np.array(entries),
        np.array(exits),
        np.array(durations),
        np.array(of_task),
        np.array(opposites),
        visits,
        positions,
    )


def _on_visit(problem: PlanningProblem, positions: FloatArray, visit: Visit) -> FloatArray | None:
    """Return the joint positions (steps, joints) of a visit; None: a closed contour cannot begin there.

    Args:
        problem: The robot, with its position limits.
        positions: (steps, joints), forwards from the first waypoint.
        visit: The direction and the first waypoint.
    """
    if visit.first:
        around = positions[-1] - positions[0]
        turns = np.where(problem.robot.is_angle, TURN * np.round(around / TURN), 0.0)
        rotated = np.vstack([positions[visit.first : -1], positions[: visit.first + 1] + turns])
        lower, upper = problem.robot.limit("lower"), problem.robot.limit("upper")
        if np.abs(around - turns).max() > POSITION_TOLERANCE or ((rotated < lower) | (rotated > upper)).any():
            return None
        positions = rotated
    return positions[::-1] if visit.is_reversed else positions


def _candidates(
    problem: PlanningProblem, tasks: Sequence[Task], robots: Sequence[Robot], near: FloatArray | None
) -> list[list[FloatArray]]:
    """Find the joint positions (n, joints) of all waypoints at which joint motions end, by task and waypoint.

    A waypoint at which a tool motion ends has none.
    """
    robot, options = problem.robot, problem.inverse_kinematics
    found = [[np.zeros((0, robot.dof)) for _ in task.waypoints] for task in tasks]
    poses: dict[tuple[int, int], list[Pose]] = {}
    waypoints: dict[tuple[int, int], PoseWaypoint] = {}
    for i, task in enumerate(tasks):
        for k, waypoint in enumerate(within_limits(robot, task.waypoints, problem.start_tolerance)):
            if k and isinstance(waypoint.motion, CartesianMotion):
                continue
            if isinstance(waypoint, JointWaypoint):
                found[i][k] = np.array([waypoint.position])
            elif isinstance(waypoint, PoseWaypoint):
                poses[i, k], waypoints[i, k] = _sampled(waypoint), waypoint
    free = _free_positions(problem, tasks)
    every_pinned = pinned_robots([robots[i] for i, _ in waypoints], list(waypoints.values()))
    reference = near if options.reference is None else np.array(options.reference)
    for pinned in dict.fromkeys(every_pinned):
        keys = [key for key, own in zip(waypoints, every_pinned, strict=True) if own is pinned]
        own_near = None if reference is None else pinned.own(reference)
        layers = iter(
            solution_layers(
                pinned.robot, [pose for key in keys for pose in poses[key]], pinned.options(options), own_near
            )
        )
        for key in keys:
            solutions = [q for _ in poses[key] for q in next(layers)]
            allowed = in_configuration(pinned.robot, solutions, waypoints[key].configuration)
            there = pinned.whole(np.array(allowed).reshape(-1, pinned.robot.dof))
            if len(there) and free is not None and (clear := free(there)).any():
                there = there[clear]
            found[key[0]][key[1]] = there
    return found


def _free_positions(problem: PlanningProblem, tasks: Sequence[Task]) -> IsFree | None:
    """Return the function that tells which joint positions are collision-free; None: nothing may collide.

    Objects that the robot takes or puts down at some waypoint are not checked.
    """
    waypoints = [*problem.waypoints, *(waypoint for task in tasks for waypoint in task.waypoints)]
    handling = [Handling(waypoint.attach, waypoint.detach) for waypoint in waypoints]
    checker = checker_at_waypoints(problem.robot, problem.scene, problem.self_collision, handling)
    return None if checker is None or checker.is_empty else partial(is_free, checker)


def _sampled(waypoint: PoseWaypoint) -> list[Pose]:
    """Return the poses of a waypoint: itself, or turned within its tolerance region."""
    requested = waypoint.pose_in_base
    if waypoint.free is None:
        return [requested]
    region = region_of(waypoint.free)
    ends = np.array(list(region.ranges.values()))
    offsets = np.clip(0.0, ends[:, 0], ends[:, 1])[None]
    if "rotation_z" in region.ranges:
        column = list(region.ranges).index("rotation_z")
        lower, upper = ends[column]
        steps = max(1, int(np.ceil((upper - lower) / TURN * TURN_SAMPLES - POSITION_TOLERANCE)))
        whole = upper - lower > TURN - POSITION_TOLERANCE  # a whole turn ends where it begins
        offsets = np.tile(offsets, (steps if whole else steps + 1, 1))
        offsets[:, column] = lower + (upper - lower) * np.arange(len(offsets)) / steps
    return [region.pose(requested, row) for row in offsets]


def _carried(
    problem: PlanningProblem, task: Task, candidates: Sequence[FloatArray], speeds: JointSpeeds
) -> list[Carried]:
    """Return the ways to carry out a task forwards, the fastest between each first and last joint position."""
    found = []
    closing = [task.waypoints[0]] if task.closed else []
    waypoints = [*task.waypoints, *closing]
    for entry in candidates[0]:
        ends = [Carried(entry[None], task.waypoints[0].dwell)]
        for k, waypoint in enumerate(waypoints[1:], 1):
            if isinstance(waypoint.motion, JointMotion):
                ends = [_fastest_to(ends, waypoint, position, speeds) for position in candidates[k % len(candidates)]]
            else:
                ends = [there for before in ends if (there := _followed(problem, before, k, waypoint, speeds))]
            if not ends:
                break
        found += ends
    return found


def _fastest_to(starts: Sequence[Carried], waypoint: AnyWaypoint, position: FloatArray, speeds: JointSpeeds) -> Carried:
    """Return the fastest way on to a joint position (joints,) of a waypoint."""
    durations = speeds.durations(np.array([start.positions[-1] for start in starts]), position)
    totals = np.array([start.duration for start in starts]) + _requested(waypoint, durations, speeds)
    best = int(np.argmin(totals))
    return Carried(np.vstack([starts[best].positions, position]), float(totals[best]))


def _followed(
    problem: PlanningProblem, before: Carried, index: int, waypoint: AnyWaypoint, speeds: JointSpeeds
) -> Carried | None:
    """Return the way on along a tool motion; None: the joints cannot follow it from here."""
    robot, start = problem.robot, before.positions[-1]
    there = tool_pose(robot, start)
    match waypoint:
        case PoseWaypoint():
            goal = waypoint.pose_in_base
        case RelativeWaypoint():
            goal = moved_pose(there, there.rotation, waypoint)
        case _:
            goal = tool_pose(robot, np.array(waypoint.position))
    motion = follow_motion(RequestedMotion(robot, problem.inverse_kinematics, index, waypoint, there, goal), start)
    if isinstance(motion, RefusedMotion):
        return None
    (samples,) = motion.curve.evaluate(np.linspace(0.0, motion.curve.breakpoints[-1], SAMPLES_OF_MOTION), (0,))
    travelled = np.abs(np.diff(samples, axis=0)).sum(axis=0)
    duration = float(_requested(waypoint, speeds.durations(np.zeros(robot.dof), travelled), speeds))
    return Carried(np.vstack([before.positions, motion.end]), before.duration + duration)


def _requested(waypoint: AnyWaypoint, durations: FloatArray, speeds: JointSpeeds) -> FloatArray:
    """Return the durations (...), s, of segments to a waypoint with the dwell there, from the least durations (...)."""
    return speeds.requested(durations, waypoint.minimum_duration, waypoint.duration or 0.0) + waypoint.dwell


def _refusal(problem: PlanningProblem, task: Task) -> PlanningError:
    """Return why a task has no state."""
    forwards = [*task.waypoints, *([task.waypoints[0]] if task.closed else [])]
    alone = [replace(forwards[0], motion=JointMotion(), duration=None, limits=None), *forwards[1:]]
    try:
        solved_waypoints(replace(problem, waypoints=alone))
    except PlanningError as refusal:
        return refusal
    return UnreachableWaypoint("no joint position leads through all waypoints of the task", waypoint=0)
