"""Views: parallel projections of the base frame onto pictures, and the stick model of a robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin

from planner.dynamics import SegmentDynamics
from planner.kinematics.forward import tool_poses
from planner.robots import Robot
from planner.robots.derived.standing import placement_in_world
from planner.scene.bodies import Bodies, JointTree
from planner.spatial import FloatArray

ELEVATION = 25.0
"""Angle of the isometric view above the floor, degrees."""

AZIMUTH = -55.0
"""Angle from the x axis to the viewer of the isometric view, degrees."""


@dataclass(frozen=True, eq=False)
class View:
    """A parallel projection.

    Attributes:
        columns: The coordinates that the axes of the picture show.
        directions: The directions (2, 3) in the base frame that point to the right and up.
    """

    columns: tuple[int, ...]
    directions: FloatArray

    @cached_property
    def toward(self) -> FloatArray:
        """The direction (3,) that points to the viewer."""
        return np.cross(*self.directions)

    def project(self, points: FloatArray) -> FloatArray:
        """Return the places in the picture (..., 2) of points (..., 3), m."""
        return np.asarray(points @ self.directions.T, dtype=np.float64)


def _isometric() -> FloatArray:
    elevation, azimuth = np.radians([ELEVATION, AZIMUTH])
    right = [-np.sin(azimuth), np.cos(azimuth), 0.0]
    up = [-np.sin(elevation) * np.cos(azimuth), -np.sin(elevation) * np.sin(azimuth), np.cos(elevation)]
    return np.array([right, up])


VIEWS = {"isometric": View((0, 1, 2), _isometric())} | {
    name: View(columns, np.eye(3)[list(columns)]) for name, columns in (("xy", (0, 1)), ("xz", (0, 2)), ("yz", (1, 2)))
}
"""The views by name."""


def joined_names(points: FloatArray, names: Sequence[str], distance: float) -> list[tuple[int, list[str]]]:
    """Join the different names at points (N, 2) nearer than a distance; return the first point of each group."""
    groups: list[tuple[int, list[str]]] = []
    for number, name in enumerate(names):
        near = (group for group in groups if np.linalg.norm(points[group[0]] - points[number]) <= distance)
        group = next(near, None)
        if group is None:
            groups.append((number, [name]))
        elif name not in group[1]:
            group[1].append(name)
    return groups


SAME_JOINT_DISTANCE = 1e-9
"""Distance, m, up to which two points of a stick model are one: joints whose axes meet."""


def stick_model(robot: Robot, position: FloatArray) -> FloatArray:
    """Return the points (joints + 2, 3), m, of the model at a joint position: base, joints, tool.

    They are in the frame that stands still, as all of a picture: with a positioner, the base frame moves. An arm that
    holds the workpiece ends at its foot: it does not lead to the fixed tool.
    """
    pin.forwardKinematics(robot.model, robot.data, position)
    end = robot.tip_frame_id if robot.holds_workpiece else robot.tool_frame_id
    tool = pin.updateFramePlacement(robot.model, robot.data, end).translation
    joint = int(robot.model.frames[robot.tool_frame_id].parentJoint)
    points = [tool.copy()]
    while joint > 0:
        points.append(robot.data.oMi[joint].translation.copy())
        joint = int(robot.model.parents[joint])
    (placed,) = _in_standing_frame(robot, position[None], np.array([[*points, np.zeros(3)]]))
    return np.asarray(placed[::-1])


def drawn_tool_poses(
    dynamics: SegmentDynamics, segments: np.ndarray, positions: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Compute the positions (N, 3), m, and rotations (N, 3, 3) of the tool in the frame that stands still.

    Args:
        dynamics: The robot on each segment.
        segments: (N,), index of the segment of each state.
        positions: (N, joints), rad or m.
    """

    def poses(robot: Robot, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        points, rotations = tool_poses(robot, q)
        tips = np.concatenate([points[:, None], points[:, None] + rotations.transpose(0, 2, 1)], axis=1)
        tips = _in_standing_frame(robot, q, tips)
        return tips[:, 0], (tips[:, 1:] - tips[:, :1]).transpose(0, 2, 1) if robot.positioner else rotations

    points, rotations = dynamics.by_robot(poses, segments, positions)
    return points, rotations


def _in_standing_frame(robot: Robot, positions: FloatArray, points: FloatArray) -> FloatArray:
    """Return points (N, points, 3), m, of the base frame at N joint positions in the frame that stands still."""
    if not robot.positioner:
        return points
    joint, base = placement_in_world(robot, 0, pin.SE3.Identity())
    rotations, origins = Bodies(JointTree.of(robot), ()).frames(positions)
    placed = points @ base.rotation.T + base.translation
    found: FloatArray = placed @ rotations[:, joint].transpose(0, 2, 1) + origins[:, joint, None]
    return found


def distinct_points(points: FloatArray) -> FloatArray:
    """Return the points (N, 3) of a stick model without repetitions of the previous point."""
    apart = np.linalg.norm(np.diff(points, axis=0), axis=1) > SAME_JOINT_DISTANCE
    kept: FloatArray = points[np.concatenate([[True], apart])]
    return kept
