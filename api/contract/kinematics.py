"""Bodies and answers of the kinematics endpoints."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from api.contract.parts.common import (
    DEFAULT_DEADLINE,
    Answer,
    Deadline,
    Elbow,
    FrameName,
    JointVector,
    Pose,
    QuaternionOrientation,
    RobotId,
    Schema,
    Seed,
    Shoulder,
    Wrist,
)
from api.contract.parts.pictures import PictureView  # noqa: TC001 - pydantic evaluates the annotations
from api.contract.parts.scenes import SceneOrId  # noqa: TC001 - pydantic evaluates the annotations
from api.contract.parts.waypoints import Waypoint  # noqa: TC001 - pydantic evaluates the annotations
from api.contract.requests import InverseKinematicsOptions, Rows


class ForwardKinematicsRequest(Schema):
    """Joint positions whose tool poses are asked."""

    robot: RobotId
    """The id of a robot, as GET /v1/robots lists them."""
    positions: Rows
    """The joint positions, shape (positions, joints), rad or m."""
    tool: Pose | None = None
    """The pose of the tool centre point in the tip frame (m); omitted: the robot's own."""
    deadline: Deadline = DEFAULT_DEADLINE
    """The time after which the service gives up, s from the arrival of the request."""


class InverseKinematicsRequest(Schema):
    """Poses whose joint positions are asked."""

    robot: RobotId
    """The id of a robot, as GET /v1/robots lists them."""
    poses: Annotated[list[Pose], Field(min_length=1)]
    """The poses of the tool in the base frame (m)."""
    solutions: Literal["best", "all"] = "best"
    """`best`: one solution, of the first pose the one nearest to `reference`, of any other the one nearest to the
    solution before. `all`: every isolated solution within the limits, nearest to `reference` first, those that
    differ by whole turns of joints included, 64 at most; of a redundant robot a spread of solutions. With `scene` or
    `self_collision` those at which the robot keeps clear come first, and the best is one of them as long as there is
    one, of a redundant robot as long as one is found among a spread."""
    reference: JointVector | None = None
    """A joint position, one value a joint, rad or m. Omitted: of the first pose any solution is best, and all are
    sorted by their distance to the middle of the limits."""
    tool: Pose | None = None
    """The pose of the tool centre point in the tip frame (m); omitted: the robot's own."""
    tolerance_position: Annotated[float, Field(ge=1e-9, le=1.0)] = 1e-6
    """The distance that the tool may be off the position asked, m."""
    tolerance_orientation: Annotated[float, Field(ge=1e-9, le=1.0)] = 1e-6
    """The angle that the tool may be off the orientation asked, rad."""
    scene: SceneOrId | None = None
    """What stands around the robot and what it carries: solutions at which it keeps clear of that go before all others,
    and the answer says which do. Omitted: nothing is known."""
    self_collision: bool | None = None
    """Whether the arm is checked against itself; omitted: in a scene, unless its shapes are capsules along its
    kinematics."""
    frames: Annotated[dict[FrameName, Pose], Field(max_length=64)] = Field(default_factory=dict)
    """Frames by name, each with its pose in the world (m), for the objects of the scene."""
    mounting: Pose | None = None
    """The pose of the base in the world (m), in which the scene stands; omitted: the robot's own."""
    seed: Seed = 0
    """The seed of the random starts of the inverse kinematics; the same seed gives the same answer."""
    deadline: Deadline = DEFAULT_DEADLINE
    """The time after which the service gives up, s from the arrival of the request."""


class ReachabilityRequest(Schema):
    """Waypoints of which is asked whether they can be reached."""

    robot: RobotId
    """The id of a robot, as GET /v1/robots lists them."""
    waypoints: Annotated[list[Waypoint], Field(min_length=1)]
    """The waypoints, as in a plan request; motions, transitions, times and limits do not count."""
    frames: Annotated[dict[FrameName, Pose], Field(max_length=64)] = Field(default_factory=dict)
    """Work objects by name, each with its pose in the world (m), for the `frame` of waypoints; `base` and `world` are
    there already. Without a mounting the base is the world."""
    mounting: Pose | None = None
    """The pose of the base in the world (m), whose z axis points up: gravity follows it. Omitted: the robot's own."""
    tool: Pose | None = None
    """The pose of the tool centre point in the tip frame (m); omitted: the robot's own."""
    ik: InverseKinematicsOptions = InverseKinematicsOptions()
    """How poses are solved; solutions are turned nearest to the reference, or else to the middle of the limits."""
    scene: SceneOrId | None = None
    """What stands around the robot and what it carries: solutions at which it keeps clear of that go before all others,
    and the answer says whether there is one. What is taken or put down at some waypoint is not held against the robot.
    Omitted: nothing is known."""
    self_collision: bool | None = None
    """Whether the arm is checked against itself; omitted: in a scene, unless its shapes are capsules along its
    kinematics."""
    seed: Seed = 0
    """The seed of the random starts of the inverse kinematics; the same seed gives the same answer."""
    deadline: Deadline = DEFAULT_DEADLINE
    """The time after which the service gives up, s from the arrival of the request."""


class JacobianRequest(Schema):
    """A joint position whose Jacobian is asked."""

    robot: RobotId
    """The id of a robot, as GET /v1/robots lists them."""
    position: JointVector
    """The joint position, one value a joint, rad or m."""
    tool: Pose | None = None
    """The pose of the tool centre point in the tip frame (m); omitted: the robot's own."""
    deadline: Deadline = DEFAULT_DEADLINE
    """The time after which the service gives up, s from the arrival of the request."""


class WorkspaceRequest(Schema):
    """A robot whose workspace is asked."""

    robot: RobotId
    """The id of a robot, as GET /v1/robots lists them."""
    samples: Annotated[int, Field(ge=1, le=100_000)] = 1000
    """The number of points to answer; the figures do not depend on it."""
    seed: Seed = 0
    """The seed of the random joint positions; the same seed gives the same points."""
    tool: Pose | None = None
    """The pose of the tool centre point in the tip frame (m); omitted: the robot's own."""
    view: PictureView = "isometric"
    """Where a picture of the points, if one is asked (`?format=svg`, `png`), looks at them from."""
    deadline: Deadline = DEFAULT_DEADLINE
    """The time after which the service gives up, s from the arrival of the request."""


class AnsweredPose(Answer):
    """A pose of the tool in the base frame."""

    position: list[float]
    """The origin of the tool x, y, z, m."""
    orientation: QuaternionOrientation
    """The orientation of the tool, as a quaternion of norm 1."""


class ForwardKinematicsAnswer(Answer):
    """Poses of the tool in the base frame, one per joint position."""

    poses: list[AnsweredPose]
    """The poses, in the order of the joint positions."""


class AnsweredConfiguration(Answer):
    """The sides on which shoulder, elbow and wrist are, in the words of a waypoint's `configuration`."""

    shoulder: Shoulder | None
    """The side of the wrist centre; null: it is on neither, or the arm has no such name."""
    elbow: Elbow | None
    """The side of the elbow; null: it is stretched, the shoulder is singular, or the arm has no such name."""
    wrist: Wrist | None
    """The side of the wrist; null: it is straight, or the arm has no such name."""


class PostureCollision(Answer):
    """The pair that is furthest beyond its margin at a joint position."""

    pair: Annotated[list[str], Field(min_length=2, max_length=2)]
    """The names of the links or objects."""
    depth: float
    """How much nearer the two are than their margin, m: as deep as they overlap where the margin is 0."""


class JointSolution(Answer):
    """A joint position that reaches the pose; verified by forward kinematics."""

    position: list[float]
    """The joint position, one value a joint, rad or m."""
    position_error: float
    """The distance of the tool from the position asked, m."""
    orientation_error: float | None
    """The angle of the tool from the orientation asked, rad; null: none was asked."""
    manipulability: float
    """sqrt(det(J J^T)) of Yoshikawa (1985), in the units of J: 0 where the arm is singular."""
    configuration: AnsweredConfiguration
    """The configuration of the arm there, by its names."""
    collision: PostureCollision | None = None
    """What is in the way there; null: the robot is proved to keep clear. Only with `scene` or `self_collision`."""


class NearestPose(Answer):
    """The nearest that the robot gets to a pose that it cannot reach."""

    position: list[float]
    """The joint position there, one value a joint, rad or m."""
    pose: AnsweredPose
    """The pose of the tool there, in the base frame (m)."""
    position_error: float
    """The distance of the tool from the position asked, m."""
    orientation_error: float | None
    """The angle of the tool from the orientation asked, rad; null: none was asked."""
    collision: PostureCollision | None = None
    """What is in the way there; null: the robot is proved to keep clear. Only of the inverse kinematics with `scene` or
    `self_collision`."""


class InverseKinematicsResult(Answer):
    """What was found for one pose."""

    status: Literal["solved", "unreachable_waypoint", "joint_position_limit"]
    """`solved`, or the code of the problem."""
    solutions: list[JointSolution]
    """The joint positions that reach the pose; empty unless solved."""
    nearest: NearestPose | None = None
    """The nearest that the tool gets; only when not solved."""


class InverseKinematicsAnswer(Answer):
    """Results, one per pose, in order."""

    results: list[InverseKinematicsResult]
    """What was found, one result a pose, in the order of the poses."""


class LimitMargin(Answer):
    """How near a joint position is to the position limits."""

    joint: str
    """The joint nearest to one of its limits, rad and m alike."""
    value: float
    """The distance from there to that limit, rad or m."""


class WaypointReachability(Answer):
    """Whether one waypoint can be reached, and how well."""

    index: int
    """The index of the waypoint in the request, counted from 0."""
    name: str | None
    """The name that the request gave it; null: none."""
    status: Literal["reachable", "unreachable_waypoint", "joint_position_limit"]
    """`reachable`, or the code of the problem."""
    detail: str | None
    """Why it cannot be reached, for a person; null: it can."""
    solutions: int | None
    """The number of isolated solutions, 0 if the pose cannot be reached; null: a joint waypoint, or a continuum."""
    free: bool | None = None
    """Whether there is a solution at which the robot is proved to keep clear. Only with `scene` or `self_collision`."""
    free_solutions: int | None = None
    """The number of the `solutions` at which it does; null as these. Only with `scene` or `self_collision`."""
    hindered_by: list[PostureCollision] | None = None
    """What is in the way at the solutions where none is free, each pair once, the least deep first; empty where one is
    free, or the waypoint cannot be reached. Only with `scene` or `self_collision`."""
    limit_margin: LimitMargin | None
    """The margin of the best solution, which is the one furthest from its limits, of those that are free as long as
    there is one; null: no joint has limits, or the waypoint cannot be reached."""
    manipulability: float | None
    """sqrt(det(J J^T)) of Yoshikawa (1985) at the best solution, in the units of J; null: it cannot be reached."""
    nearest: NearestPose | None = None
    """The nearest that the tool gets; only of a pose that cannot be reached."""


class ReachabilityAnswer(Answer):
    """Which waypoints can be reached, each by itself; nothing is planned."""

    reachable: bool
    """Whether all waypoints can be reached."""
    free: bool | None = None
    """Whether the robot can keep clear at all of them. Only with `scene` or `self_collision`."""
    waypoints: list[WaypointReachability]
    """What was found, one entry a waypoint, in order."""


class JacobianAnswer(Answer):
    """The Jacobian of the tool at one joint position."""

    jacobian: list[list[float]]
    """The Jacobian, shape (6, joints): three rows of linear (m/s) over three of angular velocity (rad/s) of the tool in
    the base's axes, per joint velocity (rad/s or m/s)."""
    manipulability: float
    """sqrt(det(J J^T)) of Yoshikawa (1985), in the units of J: the product of the singular values. Of an arm with three
    joints or fewer, which cannot choose its orientation, the rows of the position alone count."""
    singular_values: list[float]
    """The singular values of the Jacobian, in its units, the largest first."""


class Extreme(Answer):
    """A figure of the workspace, and where it is reached."""

    value: float
    """The figure, m."""
    position: list[float]
    """A joint position with that figure, one value a joint, rad or m."""


class WorkspaceAnswer(Answer):
    """Where the tool can be within the position limits; collisions are not looked at."""

    points: list[list[float]]
    """Where the tool is at random joint positions: shape (points, 3), x, y, z in the base frame, m."""
    minimum_radius: Extreme
    """The smallest distance of the tool from the base frame's z axis."""
    maximum_radius: Extreme
    """The largest distance of the tool from the base frame's z axis."""
    minimum_height: Extreme
    """The smallest z of the tool in the base frame."""
    maximum_height: Extreme
    """The largest z of the tool in the base frame."""
    radius_at_maximum_height: Extreme
    """The largest distance from the base frame's z axis at which the tool reaches its maximum height."""
    minimum_reach: Extreme
    """The smallest distance of the tool from the base frame's origin."""
    maximum_reach: Extreme
    """The largest distance of the tool from the base frame's origin."""
