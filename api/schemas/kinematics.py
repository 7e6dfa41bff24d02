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
from api.schemas.requests import MOST_ROWS, InverseKinematicsOptions, Rows, Waypoint


class ForwardKinematicsRequest(Schema):
    """Joint positions whose tool poses are asked."""

    robot: RobotId
    """An id of GET /v1/robots."""
    positions: Rows
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


class ReachabilityRequest(Schema):
    """Waypoints of which is asked whether they can be reached."""

    robot: RobotId
    """An id of GET /v1/robots."""
    waypoints: Annotated[list[Waypoint], Field(min_length=1, max_length=100_000)]
    """As in a plan request; motions, transitions, times and limits do not count."""
    tool: Pose | None = None
    """Tool centre point in the tip frame; omitted: the tip itself."""
    ik: InverseKinematicsOptions = InverseKinematicsOptions()
    """How poses are solved; solutions are turned nearest to the reference, or else to the middle of the limits."""
    seed: Seed = 0
    """Of the random starts."""
    deadline: Deadline = DEFAULT_DEADLINE
    """s, after which the service gives up."""


class JacobianRequest(Schema):
    """A joint position whose Jacobian is asked."""

    robot: RobotId
    """An id of GET /v1/robots."""
    position: JointVector
    """Joint position, rad or m."""
    tool: Pose | None = None
    """Tool centre point in the tip frame; omitted: the tip itself."""
    deadline: Deadline = DEFAULT_DEADLINE
    """s, after which the service gives up."""


class WorkspaceRequest(Schema):
    """A robot whose workspace is asked."""

    robot: RobotId
    """An id of GET /v1/robots."""
    samples: Annotated[int, Field(ge=1, le=100_000)] = 1000
    """How many points to answer; the figures do not depend on it."""
    seed: Seed = 0
    """Of the random joint positions."""
    tool: Pose | None = None
    """Tool centre point in the tip frame; omitted: the tip itself."""
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


class LimitMargin(Answer):
    """How near a joint position is to the position limits."""

    joint: str
    """The joint nearest to one of its limits, rad and m alike."""
    value: float
    """rad or m from there to the limit."""


class WaypointReachability(Answer):
    """Whether one waypoint can be reached, and how well."""

    index: int
    name: str | None
    status: Literal["reachable", "unreachable_waypoint", "joint_position_limit"]
    """`reachable`, or the code of the problem."""
    detail: str | None
    """Why it cannot be reached, for a person; null: it can."""
    solutions: int | None
    """How many isolated solutions the pose has, 0 if it cannot be reached; null: a joint waypoint, or a continuum."""
    limit_margin: LimitMargin | None
    """Of the best solution, the one furthest from its limits; null: no joint has limits, or it cannot be reached."""
    manipulability: float | None
    """Of the best solution: sqrt(det(J J^T)) of Yoshikawa (1985); null: it cannot be reached."""
    nearest: NearestPose | None = None
    """Only of a pose that cannot be reached."""


class ReachabilityAnswer(Answer):
    """Which waypoints can be reached, each by itself; nothing is planned."""

    reachable: bool
    """Whether all can."""
    waypoints: list[WaypointReachability]


class JacobianAnswer(Answer):
    """The Jacobian of the tool at one joint position."""

    jacobian: list[list[float]]
    """6 rows, one column a joint: linear (m/s) over angular velocity (rad/s) in the base's axes per joint velocity."""
    manipulability: float
    """sqrt(det(J J^T)) of Yoshikawa (1985): the product of the singular values."""
    singular_values: list[float]
    """Largest first."""


class Extreme(Answer):
    """A figure of the workspace, and where it is reached."""

    value: float
    """m."""
    position: list[float]
    """A joint position with that value, rad or m."""


class WorkspaceAnswer(Answer):
    """Where the tool can be within the position limits; collisions are not looked at."""

    points: list[list[float]]
    """x, y, z, m: the tool in the base frame, at random joint positions."""
    minimum_radius: Extreme
    """Distance from the base frame's z axis."""
    maximum_radius: Extreme
    """Distance from the base frame's z axis."""
    minimum_height: Extreme
    """z in the base frame."""
    maximum_height: Extreme
    """z in the base frame."""
    radius_at_maximum_height: Extreme
    """The largest, where the maximum height is reached at several."""
    minimum_reach: Extreme
    """Distance from the base frame's origin."""
    maximum_reach: Extreme
    """Distance from the base frame's origin."""
