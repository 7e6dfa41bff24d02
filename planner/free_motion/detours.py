"""The detours of a problem's free motions, and the problem with their corners in place of these motions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import inf
from typing import NamedTuple

import numpy as np

from planner.certificate.clearance import refuse_collision_at, segment_checkers
from planner.constraints.kept_poses import KeptPoses
from planner.errors import InvalidProblem, NoPathFound, PathPoint, PlanningError
from planner.free_motion.edges import FreeEdges
from planner.free_motion.fixed import AS_GIVEN, fixed_at, fixed_motion
from planner.free_motion.free_path import FreePath, find_free_path
from planner.free_motion.straight_ends import find_path_with_straight_ends
from planner.kinematics.configurations import Configuration, in_configuration
from planner.kinematics.forward import tool_pose
from planner.kinematics.inverse import all_solutions
from planner.paths import solved_waypoints
from planner.paths.clear_motions import ClearMotions
from planner.problems.actions import Action, AtWaypoint
from planner.problems.motion_around import FreeMotion, KeptMotion, Objective
from planner.problems.problem import (
    AnyWaypoint,
    JointMotion,
    JointWaypoint,
    PlanningProblem,
    PoseWaypoint,
    ViaWaypoint,
)
from planner.problems.transitions import BlendTransition, StopTransition, ThroughTransition, Transition
from planner.quantities import MEASURES
from planner.scene import CollisionChecker, is_free
from planner.spatial import FloatArray
from planner.waypoints.goal_regions import MOST_TRIED_POSITIONS, positions_in_region
from planner.waypoints.pinned import pinned_robots
from planner.waypoints.solve import SolvedWaypoint
from planner.waypoints.targets import first_fixing

LADDER = (ThroughTransition(), BlendTransition(0.05), BlendTransition(0.01), StopTransition())
"""Transitions at the corners of a detour, the fastest first; the next is tried where the certificate refuses.

With stops the trajectory follows the straight motions that are proved free."""

LONGEST_TRAVEL = 1e3
"""The largest travel of a joint in a free motion, rad or m.

A motion is checked at ten joint positions per radian, and a million radians would exceed the memory.
"""

MOST_REGION_GOALS = 12
"""Largest number of end positions of a free motion in a tolerance region, besides the chosen pose."""

SHARE_OF_PREFERRED = 0.25
"""Share of the checked motions of a search to the preferred solution of a pose alone, before all others count."""

GOALS_APART = 0.4
"""Smallest distance between these joint positions, rad or m."""


@dataclass(frozen=True)
class Gain:
    """The gain of an optimisation of a detour.

    Attributes:
        objective: The objective of the optimisation.
        first: Its value with the first detour, see `planner.problems.motion_around.Objective`.
        last: Its value with the best detour, no larger.
        candidates: The number of other detours that were timed.
        checks: The number of motions checked for them.
    """

    objective: Objective
    first: float
    last: float
    candidates: int
    checks: int


@dataclass(frozen=True, eq=False)
class Detour:
    """The path found for a free motion.

    Attributes:
        waypoint: Index of the waypoint that the motion leads to.
        positions: (corners + 2, joints), rad or m: its start, its corners, and where it ends.
        transition: The transition at its corners.
        lead: (waypoints, joints), rad or m: the joint positions of earlier waypoints that the pose at its start depends
            on. A relative move continues from their open coordinates.
        gain: The gain of its optimisation; None: not requested.
    """

    waypoint: int
    positions: FloatArray
    transition: Transition
    lead: FloatArray
    gain: Gain | None = None

    @property
    def has_corners(self) -> bool:
        """Whether the path is not straight."""
        return len(self.positions) > 2

    def slower(self) -> Detour | None:
        """Return the detour with slower transitions at its corners; None: it has no corners, or stops at them."""
        rung = LADDER.index(self.transition) + 1
        return replace(self, transition=LADDER[rung]) if self.has_corners and rung < len(LADDER) else None


def free_waypoints(problem: PlanningProblem) -> list[int]:
    """Return the indices of the waypoints that free motions lead to."""
    return [i for i, waypoint in enumerate(problem.waypoints) if isinstance(waypoint.motion, FreeMotion)]


def with_detours(problem: PlanningProblem, detours: Sequence[Detour]) -> PlanningProblem:
    """Replace free motions by joint motions between the corners of their paths.

    The start and the end of a path become joint waypoints, and so do the waypoints that the pose at its start depends
    on. This fixes their configurations.
    """
    if not detours:
        return problem
    free = free_waypoints(problem)
    by_waypoint = {detour.waypoint: detour for detour in detours if detour.waypoint in free}
    waypoints: list[AnyWaypoint] = []
    last: list[int] = []
    for i, waypoint in enumerate(problem.waypoints):
        if i in by_waypoint:
            detour = by_waypoint[i]
            if i > 1 or not isinstance(waypoints[-1], JointWaypoint):
                found = [*detour.lead, detour.positions[0]]
                waypoints[-len(found) :] = map(fixed_at, waypoints[-len(found) :], found)
            waypoints += _along(waypoint, detour)
        else:
            waypoints.append(waypoint)
        last.append(len(waypoints) - 1)

    def moved(action: Action) -> Action:
        return replace(action, at=AtWaypoint(last[action.at.waypoint])) if isinstance(action.at, AtWaypoint) else action

    return replace(problem, waypoints=tuple(waypoints), actions=tuple(map(moved, problem.actions)))


def with_moved_ends(detours: Sequence[Detour], moved: Mapping[int, FloatArray]) -> tuple[Detour, ...]:
    """Return detours between other joint positions (joints,) of waypoints, by the indices of these."""
    changed = []
    for detour in detours:
        k, positions, lead = detour.waypoint, detour.positions.copy(), detour.lead.copy()
        positions[0], positions[-1] = moved.get(k - 1, positions[0]), moved.get(k, positions[-1])
        for row in range(len(lead)):
            lead[row] = moved.get(k - 1 - len(lead) + row, lead[row])
        changed.append(replace(detour, positions=positions, lead=lead))
    return tuple(changed)


def last_of(problem: PlanningProblem, number: int) -> int:
    """Return the index of a requested waypoint, by its number, in a problem with detours: corners come before it."""
    return len(problem.waypoints) - 1 - problem.numbers[::-1].index(number)


def find_detours(problem: PlanningProblem, known: Sequence[Detour] = ()) -> tuple[Detour, ...]:
    """Find the detours of all free motions after the `known` ones, each from the end of the previous one.

    Raises:
        PlanningError: As `find_detour`.
    """
    detours = list(known)
    for index in free_waypoints(problem)[len(known) :]:
        detours.append(find_detour(problem, detours, index))
    return tuple(detours)


def find_detour(problem: PlanningProblem, before: Sequence[Detour], index: int) -> Detour:
    """Find the detour of the free motion to a waypoint, after the detours of all free motions before.

    Raises:
        Collision: There is not enough room at an end of the free motion.
        NoPathFound: The search used its budget of checked motions.
        PlanningError: A waypoint cannot be solved; its index is that of the problem.
    """
    checker, start, goals, lead = ends_of_detour(problem, before, index)
    motion = problem.waypoints[index].motion
    most = motion.most_checks if isinstance(motion, FreeMotion) else 0
    robots, options = problem.robots[index - 1 : index + 1], problem.inverse_kinematics
    kept = kept_poses(problem, index)
    search = partial(
        find_free_path, problem.robot, checker, start, seed=options.seed, kept=kept, roadmap=problem.roadmap
    )
    searches = [(goals, most)]
    if options.prefer != "continuous" and len(goals) > 1:
        searches.insert(0, (goals[:1], int(SHARE_OF_PREFERRED * most)))
    for own, checks in searches:
        lines = partial(find_path_with_straight_ends, robots, checker, start, own, options, checks)
        found = search(own, most_checks=checks, in_narrow=None if kept else lines)
        if found.status == "found":
            return Detour(index, found.positions, LADDER[0 if len(found.positions) > 2 else -1], lead)
    raise _refusal(problem, checker, index, found, start, goals)


class EndsOfDetour(NamedTuple):
    """The ends of the search for a path.

    Attributes:
        checker: The robot and its obstacles.
        start: (joints,), rad or m.
        goals: (goals, joints): alternatives, first the one chosen for the waypoint.
        lead: (waypoints, joints), see `Detour`.
    """

    checker: CollisionChecker
    start: FloatArray
    goals: FloatArray
    lead: FloatArray


def ends_of_detour(problem: PlanningProblem, before: Sequence[Detour], index: int) -> EndsOfDetour:
    """Return the ends of the search for the path to a waypoint.

    Args:
        problem: The requested problem.
        before: The detours of all free motions before.
        index: Index of the waypoint that the free motion leads to.

    Raises:
        InvalidProblem: A joint would travel too far.
        PlanningError: A waypoint cannot be solved; its index is that of the problem.
    """
    itself = problem.self_collision if problem.scene is not None or problem.self_collision else False
    so_far = with_detours(problem, before)
    number = last_of(so_far, index)
    try:
        waypoints, solved = solved_waypoints(so_far)
    except PlanningError as refusal:
        raise refusal.numbered(so_far.numbers) from None
    positions = np.array([waypoint.position for waypoint in solved])
    first = first_fixing(so_far.robots, waypoints, number - 1)
    checker = segment_checkers(replace(so_far, self_collision=itself), positions)[number - 1]
    start = solved[number - 1].position
    goals = _goals(problem, index, checker, (solved[number - 1], solved[number]), (so_far, waypoints, number))
    if (kept := kept_poses(problem, index)) is not None:
        goals = _goals_kept(kept, index, start, goals)
    travels = np.abs(goals - start)
    if travels[0].max() > LONGEST_TRAVEL:
        joint = int(travels[0].argmax())
        own, name = float(travels[0, joint]), problem.robots[index].joint_names[joint]
        message = f"{name} travels {own:g} rad or m there: a free motion is sought up to {LONGEST_TRAVEL:g}"
        raise InvalidProblem([(("waypoints", index), message)])
    return EndsOfDetour(checker, start, goals[travels.max(axis=1) <= LONGEST_TRAVEL], positions[first : number - 1])


def kept_poses(problem: PlanningProblem, index: int) -> KeptPoses | None:
    """Return the constraints on the tool of the motion to a waypoint; None: there are none."""
    motion = problem.waypoints[index].motion
    return KeptPoses(problem.robots[index], motion.keep) if isinstance(motion, KeptMotion) and motion.keep else None


def _goals_kept(kept: KeptPoses, index: int, start: FloatArray, goals: FloatArray) -> FloatArray:
    """Return the goals (goals, joints) that keep the constraints on the tool.

    Raises:
        InvalidProblem: The start breaks one, or all goals do.
    """
    broken = [kept.broken_at(position) for position in (start, *goals)]
    number, worst = (index - 1, broken[0]) if broken[0] is not None else (index, broken[1])
    holds = [found is None for found in broken[1:]]
    if worst is not None and not (number == index and any(holds)):
        constraint, value = worst
        title, unit, _ = MEASURES[constraint.quantity]
        message = (
            f"must satisfy `keep` of the free motion to waypoint {index}; got {value:.4g} {unit} ({title.lower()}), "
            f"the limit is {constraint.limit:.4g} {unit}. Change the waypoint, or raise the `{constraint.field}`."
        )
        raise InvalidProblem([(("waypoints", number), message)])
    return goals[holds]


def _along(waypoint: AnyWaypoint, detour: Detour) -> list[AnyWaypoint]:
    """Return the corners of the detour to a waypoint, and that waypoint."""
    vias: list[AnyWaypoint] = [
        ViaWaypoint(
            position=corner,
            motion=fixed_motion(waypoint),
            transition=detour.transition,
            limits=waypoint.limits,
            tool=waypoint.tool,
        )
        for corner in detour.positions[1:-1].tolist()
    ]
    return [*vias, fixed_at(waypoint, detour.positions[-1])]


def _goals(
    problem: PlanningProblem,
    index: int,
    checker: CollisionChecker,
    ends: tuple[SolvedWaypoint, SolvedWaypoint],
    so_far: tuple[PlanningProblem, Sequence[AnyWaypoint], int],
) -> FloatArray:
    """Return the joint positions (goals, joints) at which a free motion may end: the one that was chosen comes first.

    The goals have any configuration of the requested pose, or of a few poses all over its goal region. Where a motion
    of the tool follows, each goal leads on without a collision. Other poses of the region then count only if no
    straight motion to the first one is free: each proof takes 10 ms.

    Args:
        problem: The requested problem.
        index: Index of the waypoint.
        checker: The robot and its surroundings during the motion.
        ends: The solved previous waypoint and this one.
        so_far: The problem with the detours found so far, its waypoints with their poses, and the index there.
    """
    waypoint, (before, chosen) = problem.waypoints[index], ends
    following = problem.waypoints[index + 1].motion if index + 1 < len(problem.waypoints) else AS_GIVEN
    if isinstance(waypoint, JointWaypoint):
        return chosen.position[None]
    options = problem.inverse_kinematics
    (pinned,) = pinned_robots([problem.robots[index]], [waypoint])
    wanted = waypoint.configuration if isinstance(waypoint, PoseWaypoint) else Configuration()
    near = pinned.own(before.position)
    solutions = all_solutions(pinned.robot, chosen.wanted, pinned.options(options), near)
    found = [chosen.position, *pinned.solutions(in_configuration(pinned.robot, solutions, wanted))]
    leads_on = None
    if not isinstance(following, JointMotion):
        part, waypoints, number = so_far
        clear = ClearMotions.of(part, waypoints)
        if clear is None:
            return chosen.position[None]
        leads_on = partial(clear.leads_on, waypoints, number, before.position)
        found = [found[0], *filter(leads_on, found[1:])]
    if isinstance(waypoint, PoseWaypoint) and waypoint.free:
        edges = FreeEdges(checker, inf)
        if leads_on is None or not any(edges.is_free(before.position, goal) for goal in found):
            in_region = positions_in_region(pinned, waypoint, before.position, options)
            found += apart(in_region[is_free(checker, in_region)], before.position, leads_on)
    return np.array(found)


def apart(
    positions: FloatArray, start: FloatArray, leads_on: Callable[[FloatArray], bool] | None = None
) -> list[FloatArray]:
    """Return a few joint positions far from each other from which the plan continues, the nearest to a start first.

    Args:
        positions: (N, joints), rad or m.
        start: (joints,).
        leads_on: Tells whether the motions of the tool that follow a joint position (joints,) keep clear. It is called
            `MOST_TRIED_POSITIONS` times at most. None: no such motion follows.
    """
    left = positions[np.linalg.norm(positions - start, axis=1).argsort(kind="stable")]
    found: list[FloatArray] = []
    for _ in range(MOST_TRIED_POSITIONS):
        if not len(left) or len(found) == MOST_REGION_GOALS:
            break
        position, left = left[0], left[1:]
        if leads_on is None or leads_on(position):
            found.append(position)
            left = left[np.linalg.norm(left - position, axis=1) > GOALS_APART]
    return found


def _refusal(
    problem: PlanningProblem,
    checker: CollisionChecker,
    index: int,
    search: FreePath,
    start: FloatArray,
    goals: FloatArray,
) -> NoPathFound:
    """Build the refusal of a search without a path, with its farthest point.

    Raises:
        Collision: There is not enough room at an end of it.
    """
    if search.status == "start_not_free":
        refuse_collision_at(checker, start, index - 1)
    if search.status == "no_goal_free":
        refuse_collision_at(checker, goals[0], index)
    end = search.positions[-1]
    whole = float(np.linalg.norm(goals[search.goal] - start))
    fraction = float(np.clip(1.0 - search.left / whole, 0.0, 1.0)) if whole > 0.0 else 0.0
    where = f"from waypoint {index - 1} to {index}"
    if search.barrier is None:
        message = (
            f"no path was found {where} among {search.checks} motions: the search came within {search.left:.3g} rad or "
            "m of a position that leads to a goal"
        )
    else:
        objects = " and ".join(search.barrier.objects)
        message = f"no path exists {where}: {search.barrier.joint} cannot pass {objects}, whatever the other joints do"
    return NoPathFound(
        message,
        checks=search.checks,
        enclosed_by=() if search.barrier is None else search.barrier.objects,
        segment=index - 1,
        path_point=PathPoint(fraction, tool_pose(problem.robots[index], end), end),
    )
