"""The six arms, and where in their work space jobs are done."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from itertools import product

import numpy as np

from benchmarks.corpus.tracing import on_line, tool_at, trace
from planner.robots import Robot, catalogue_ids, load_robot
from planner.spatial import FloatArray, Pose, rotation_z

DOWN = np.pi / 2.0

POSITIONS: dict[str, tuple[float, ...]] = {
    "kuka_kr16_l6_2": (0.0, -DOWN, DOWN, 0.0, DOWN, 0.0),
    "ngv_refuelling_arm": (0.0, -0.4, 0.8, 0.0, -0.4, 0.0),
    "date_sorting_arm": (0.0, 0.25, 0.25, 0.0, DOWN, 0.0),
    "three_dof_arm": (0.0, -0.9, -1.2),
    "ur5": (0.0, -DOWN, DOWN, -DOWN, -DOWN, 0.0),
    "panda": (0.0, -np.pi / 4.0, 0.0, -0.75 * np.pi, 0.0, DOWN, np.pi / 4.0),
}
"""Where each arm works: the tool straight down, or level (`date_sorting_arm`), or none (`three_dof_arm`)."""

SIZES = dict(zip(POSITIONS, (1.0, 1.0, 0.3, 0.12, 0.5, 0.4), strict=True))
"""The length for each arm that stands for 1 m in a job, m."""

PAYLOADS = dict(zip(POSITIONS, (3.0, 5.0, 0.5, 0.05, 1.5, 1.0), strict=True))
"""kg that each arm carries."""

ARMS = tuple(POSITIONS)
INSTALLED = tuple(arm for arm in ARMS if arm in catalogue_ids())
"""Without the package of robots two are missing."""

AZIMUTHS = (0.0, 0.6, -0.6, DOWN, -2.0)
"""rad about the base's axis: straight ahead, aside, mirrored, along an axis of the base, far round."""

REACHES = ((0.0, 0.0), (-0.15, 0.1), (0.1, -0.15))
"""Outwards and up from the working position, in lengths of a job."""


@dataclass(frozen=True, eq=False)
class Place:
    """The place of a job.

    Attributes:
        robot: The arm.
        size: The length that stands for 1 m in a job, m.
        position: (joints,): the arm in the middle of the job.
        pose: The tool's there; without a rotation for an arm of three joints.
        axes: (3, 3): columns are the job's directions: outwards or along the base's x, leftwards, up.
    """

    robot: Robot
    size: float
    position: FloatArray
    pose: Pose
    axes: FloatArray

    def at(self, x: float, y: float, z: float, turn: FloatArray | None = None) -> Pose:
        """Return a pose at job coordinates, turned in the tool's own axes by a rotation (3, 3)."""
        rotation = self.pose.rotation
        if rotation is not None and turn is not None:
            rotation = rotation @ turn
        return Pose(self.pose.position + self.size * (self.axes @ np.array([x, y, z])), rotation)


@cache
def robot_of(arm: str) -> Robot:
    """Return the arm, loaded once."""
    return load_robot(arm)


@cache
def places(arm: str) -> tuple[Place, ...]:
    """Return all places to which the working position of an arm can be moved."""
    made = (_place(robot_of(arm), *which) for which in product(REACHES, AZIMUTHS, (True, False)))
    return tuple(place for place in made if place is not None)


def _place(robot: Robot, offset: tuple[float, float], azimuth: float, outwards: bool) -> Place | None:
    size, seed = SIZES[robot.id], np.array(POSITIONS[robot.id])
    rotation = rotation_z(azimuth)
    home = tool_at(robot, seed)
    radial = home.position * [1.0, 1.0, 0.0]
    radial /= np.linalg.norm(radial)
    moved = home.position + size * (offset[0] * radial + offset[1] * np.array([0.0, 0.0, 1.0]))
    seed[0] += azimuth * (-1.0 if robot.id == "kuka_kr16_l6_2" else 1.0)  # that arm's first axis points down
    turned = None if robot.dof == 3 or home.rotation is None else rotation @ home.rotation
    start = Pose(rotation @ home.position, turned)
    goal = Pose(rotation @ moved, start.rotation)
    if not outwards and home.rotation is not None and robot.dof > 3 and robot.id != "date_sorting_arm":
        goal = replace(goal, rotation=home.rotation)
    elif not outwards and azimuth == 0.0:
        return None
    chain = trace(robot, on_line(start, goal, 0.05 * size), seed)
    if chain is None:
        return None
    axes = np.column_stack([rotation @ radial, np.cross([0.0, 0.0, 1.0], rotation @ radial), [0.0, 0.0, 1.0]])
    return Place(robot, size, chain[-1], goal, axes if outwards else np.eye(3))
