"""Inverse kinematics without a service: the work of `planner ik`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cli.work.robots.files import FileOptions
from cli.work.shared import refusals, robot_named
from cli.work.terminal import solutions_table, terminal
from planner.kinematics import all_solutions
from planner.kinematics.options import InverseKinematicsOptions
from planner.problems.problem import PoseWaypoint
from planner.spatial import Pose, rotation_from_rpy
from planner.waypoints.reachability import reachability

if TYPE_CHECKING:
    from pathlib import Path


def list_solutions(
    robot: str,
    position: tuple[float, float, float],
    rpy: tuple[float, float, float] | None,
    srdf: Path | None,
    tip: str | None,
) -> None:
    """List the joint positions that bring the tool to a pose; see `planner ik`."""
    with refusals():
        model = robot_named(robot, FileOptions(srdf, tip)).load()
        pose = Pose(np.array(position), None if rpy is None else rotation_from_rpy(*rpy))
        (reached,) = reachability(model, [PoseWaypoint(pose)], InverseKinematicsOptions())
        if reached.error is not None:
            raise reached.error
        solutions = all_solutions(model, pose)
    terminal().print(solutions_table(model, solutions))
