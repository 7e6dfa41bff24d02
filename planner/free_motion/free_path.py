"""A free path from one joint position to one of several others."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from planner.constraints.kept_poses import KeptPoses
from planner.free_motion.barriers import Barrier, find_barrier
from planner.free_motion.edges import FreeEdges
from planner.free_motion.roadmaps.queries import find_path_on_roadmap
from planner.free_motion.rrt_connect import Trees
from planner.free_motion.shortcuts import shortened
from planner.problems.motion_around import MOST_CHECKS
from planner.roadmap import Roadmap
from planner.robots import Robot
from planner.scene import CollisionChecker, is_free
from planner.spatial import FloatArray

AROUND = np.pi
"""Extent of the search beyond the start and the goals, rad or m, within the limits.

A path may take the other direction, but makes no additional whole turns.
"""

ROOM = 0.005
"""Additional clearance of a path at first, m.

Such a path is proved faster, and stays free when its corners are cut.
"""

SHARE_WITH_ROOM = 0.25
"""Share of the checked motions spent on a path with that clearance, before the search accepts less."""

SearchStatus = Literal["found", "start_not_free", "no_goal_free", "enclosed", "budget_spent"]
"""The result of the search: a path, or the reason for its absence."""


@dataclass(frozen=True, eq=False)
class FreePath:
    """A path of straight joint motions, or the partial result of the search.

    Attributes:
        status: `found`; `start_not_free` or `no_goal_free`: there is not enough room at an end of it;
            `enclosed`: it is proved that no path exists; or `budget_spent`: as many motions as allowed were looked at.
        positions: (positions, joints), rad or m, from the start to a goal, proved free between neighbours. Without a
            complete path, the part of the start's tree that comes closest to the goals' trees.
        goal: Number of the goal that it leads to, or that is nearest to where it ends.
        left: Distance of its end from the nearest position that leads to a goal, rad or m; 0 for a complete path.
        checks: The number of motions that were looked at.
        barrier: The proof that no path exists; None: there is none.
    """

    status: SearchStatus
    positions: FloatArray
    goal: int
    left: float
    checks: int
    barrier: Barrier | None = None


def find_free_path(
    robot: Robot,
    checker: CollisionChecker,
    start: FloatArray,
    goals: Sequence[FloatArray] | FloatArray,
    *,
    most_checks: int = MOST_CHECKS,
    seed: int = 0,
    in_narrow: Callable[[], FreePath | None] | None = None,
    kept: KeptPoses | None = None,
    roadmap: Roadmap | None = None,
) -> FreePath:
    """Find a free path: the straight motion to a goal, the nearest first, or a detour.

    Args:
        robot: The arm, whose position limits the path keeps.
        checker: The arm and its obstacles.
        start: (joints,), rad or m, within the limits.
        goals: (goals, joints), within the limits: alternatives.
        most_checks: The largest number of checked motions.
        seed: Seed of the random positions; equal seeds give equal paths.
        in_narrow: A search for narrow places, tried after the search with additional clearance fails; None: not tried.
        kept: Constraints on the tool, which the start and the goals keep; None: there are none.
        roadmap: A roadmap that is searched first, for a path without constraints on the tool; None: there is none.
    """
    edges = FreeEdges(checker, most_checks, kept)
    start, goals = np.asarray(start, dtype=np.float64), np.asarray(goals, dtype=np.float64)
    order = np.argsort(np.linalg.norm(goals - start, axis=1), kind="stable")
    are_free = is_free(checker, np.vstack([start[None], goals]))
    free = [k for k in order.tolist() if are_free[k + 1]]
    if not are_free[0] or not free:
        left = float(np.linalg.norm(goals[order[0]] - start))
        return FreePath("no_goal_free" if are_free[0] else "start_not_free", start[None], int(order[0]), left, 0)
    for k in free:
        if edges.is_free(start, goals[k]):
            return FreePath("found", np.stack([start, goals[k]]), k, 0.0, edges.checked)

    within = sought_within(robot, np.vstack([start[None], goals[free]]))
    rng = np.random.default_rng(seed)
    if roadmap is not None and kept is None:
        found = find_path_on_roadmap(edges, roadmap, start, [goals[k] for k in free], within, rng)
        if found is not None:
            return FreePath("found", found.positions, free[found.goal], 0.0, edges.checked)

    def enclosed_by(barrier: Barrier) -> FreePath:
        left = float(np.linalg.norm(goals[free[0]] - start))
        return FreePath("enclosed", start[None], free[0], left, edges.checked, barrier)

    if (barrier := find_barrier(robot, checker, start, goals[free], joints=1)) is not None:
        return enclosed_by(barrier)
    for room, most in ((ROOM, int(SHARE_WITH_ROOM * most_checks)), (0.0, most_checks)):
        edges.keep_room(room, most)
        trees = Trees(edges, start, goals[free], within)
        has_room = not room or (edges.has_room(start[None]) and edges.has_room(goals[free]))
        met = trees.find_meeting(rng) if has_room else None
        if met is not None:
            return FreePath("found", shortened(edges, met.positions, rng), free[met.goal], 0.0, edges.checked)
        if room and (barrier := find_barrier(robot, checker, start, goals[free], joints=2)) is not None:
            return enclosed_by(barrier)
        if room and in_narrow is not None and (path := in_narrow()) is not None:
            return replace(path, checks=path.checks + edges.checked)
    left, row = trees.gap()
    far = trees.from_start.positions[trees.from_start.branch(row)[::-1]]
    return FreePath("budget_spent", far, free[0], left, edges.checked)


def sought_within(robot: Robot, ends: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the lowest and the highest joint positions (joints,) that a path between ends (ends, joints) may have."""
    lower = np.maximum(robot.limit("lower"), ends.min(axis=0) - AROUND)
    return lower, np.minimum(robot.limit("upper"), ends.max(axis=0) + AROUND)
