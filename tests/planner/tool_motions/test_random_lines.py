"""Random lists of feasible lines: a chain of joint positions within the limits was traced along each."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.corpus.tracing import on_line, tool_at, trace
from planner.errors import PlanningError
from planner.paths.joint_path import solve_path
from planner.problems.problem import JointWaypoint, LinearMotion, PlanningProblem, PoseWaypoint
from planner.robots import Robot, load_robot
from planner.spatial import FloatArray, Pose, rotation_from_rpy
from tests.sizes import NAME, SIZE

ARMS = ("kuka_kr16_l6_2", "ngv_refuelling_arm", "date_sorting_arm", "three_dof_arm", "ur5", "panda")
LISTS = 5 if NAME == "quick" else SIZE.examples // len(ARMS)
PLANNED = 0.995
"""Least share of planned lists."""

SMALL_STEP = 0.1
"""Largest step of a traced joint within 5 mm of the line, rad or m; larger steps are next to a singularity."""

FINE_STEP = 0.002 if NAME == "quick" else 0.0005
"""Step for a second trace of a chain, m or rad: long steps may have passed a singularity to another branch."""

ATTEMPTS = 80
"""Largest number of tried goals for the lines of one list."""


def lines(robot: Robot, rng: np.random.Generator) -> tuple[FloatArray, list[Pose]]:
    """Draw poses and a joint position (joints,) at the first, from which lines lead through them all.

    There are three to five poses.
    """
    lower, upper = np.maximum(robot.limit("lower"), -np.pi), np.minimum(robot.limit("upper"), np.pi)
    while True:
        start = q = rng.uniform(lower + 0.03, upper - 0.03)
        poses = [_requested(robot, tool_at(robot, q))]
        for _ in range(ATTEMPTS):
            size, turn = rng.choice([0.05, 0.15, 0.3]), rng.choice([0.0, 0.5]) * rng.uniform(-1.0, 1.0, 3)
            before = poses[-1]
            goal = _requested(robot, tool_at(robot, q))
            rotation = None if goal.rotation is None else goal.rotation @ rotation_from_rpy(*turn)
            goal = Pose(before.position + rng.uniform(-size, size, 3), rotation)
            chain = trace(robot, on_line(before, goal, 0.005), q)
            if chain is None or np.abs(np.diff(np.vstack([q, chain]), axis=0)).max() > SMALL_STEP:
                continue
            if trace(robot, on_line(before, goal, FINE_STEP), q) is not None:
                poses.append(goal)
                q = chain[-1]
            if len(poses) == 5:
                break
        if len(poses) > 2:
            return start, poses[: int(rng.integers(3, len(poses) + 1))]


def _requested(robot: Robot, pose: Pose) -> Pose:
    return Pose(pose.position) if robot.dof == 3 else pose


@pytest.mark.sized
@pytest.mark.parametrize("arm", ARMS)
def test_lines_that_exist_are_planned(arm: str) -> None:
    """They start at the first pose in any configuration, and at the first joint position of the traced chain."""
    robot, rng, refused = load_robot(arm), np.random.default_rng(0), []
    for _ in range(LISTS):
        q, poses = lines(robot, rng)
        ways = [PoseWaypoint(pose=pose, motion=LinearMotion()) for pose in poses[1:]]
        for start in (PoseWaypoint(pose=poses[0]), JointWaypoint(q)):
            try:
                solve_path(PlanningProblem(robot, (start, *ways)))
            except PlanningError as error:
                refused.append(f"{error.code}: {error}")
    assert len(refused) <= (1.0 - PLANNED) * 2 * LISTS, refused
