"""Bodies and answers of the kinematics endpoints."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from api.schemas.common import (
    DEFAULT_DEADLINE,
    Answer,
    Deadline,
    JointVector,
    Pose,
    QuaternionOrientation,
    RobotId,
    Schema,
    Seed,
)
from api.schemas.requests import MOST_ROWS


class ForwardKinematicsRequest(Schema):
    """Joint positions whose tool poses are asked."""

    robot: RobotId
    """An id of GET /v1/robots."""
    positions: Annotated[list[JointVector], Field(min_length=1, max_length=MOST_ROWS)]
    """Joint positions, rad or m."""
    tool: Pose | None = None
    """Tool centre point in the tip frame; omitted: the tip itself."""
    deadline: Deadline = DEFAULT_DEADLINE
    """s, after which the service gives up."""


class InverseKinematicsRequest(Schema):
    """Poses whose joint positions are asked."""

    robot: RobotId
    """An id of GET /v1/robots."""
    poses: Annotated[list[Pose], Field(min_length=1, max_length=MOST_ROWS)]
    """Of the tool in the base frame."""
    solutions: Literal["best", "all"] = "best"
    """`best`: one solution, of the first pose the one nearest to `reference`, of any other the one nearest to the
    solution before. `all`: every isolated solution within the limits, nearest to `reference` first, those that
    differ by whole turns of joints included, 64 at most; of a redundant robot a spread of solutions."""
    reference: JointVector | None = None
    """Joint position. Omitted: of the first pose any solution is best, and all are sorted by their distance to the
    middle of the limits."""
    tool: Pose | None = None
    """Tool centre point in the tip frame; omitted: the tip itself."""
    tolerance_position: Annotated[float, Field(ge=1e-9, le=1.0)] = 1e-6
    """m."""
    tolerance_orientation: Annotated[float, Field(ge=1e-9, le=1.0)] = 1e-6
    """rad."""
    seed: Seed = 0
    """Of the random starts."""
    deadline: Deadline = DEFAULT_DEADLINE
    """s, after which the service gives up."""


class AnsweredPose(Answer):
    """A pose of the tool in the base frame."""

    position: list[float]
    """x, y, z, m."""
    orientation: QuaternionOrientation


class ForwardKinematicsAnswer(Answer):
    """Poses of the tool in the base frame, one per joint position."""

    poses: list[AnsweredPose]


class JointSolution(Answer):
    """A joint position that reaches the pose; verified by forward kinematics."""

    position: list[float]
    """rad or m."""
    position_error: float
    """m."""
    orientation_error: float | None
    """rad; null: no orientation was asked."""
    manipulability: float
    """sqrt(det(J J^T)) of Yoshikawa (1985)."""


class NearestPose(Answer):
    """The nearest that the robot gets to a pose that it cannot reach."""

    position: list[float]
    """Joint position, rad or m."""
    pose: AnsweredPose
    position_error: float
    """m."""
    orientation_error: float | None
    """rad; null: no orientation was asked."""


class InverseKinematicsResult(Answer):
    """What was found for one pose."""

    status: Literal["solved", "unreachable_waypoint", "joint_position_limit"]
    """`solved`, or the code of the problem."""
    solutions: list[JointSolution]
    """Empty unless solved."""
    nearest: NearestPose | None = None
    """Only when not solved."""


class InverseKinematicsAnswer(Answer):
    """Results, one per pose, in order."""

    results: list[InverseKinematicsResult]
