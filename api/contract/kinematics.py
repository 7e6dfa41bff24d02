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
    Mounting,
    NamedRobot,
    Pose,
    QuaternionOrientation,
    Schema,
    Seed,
    SelfCollision,
    Shoulder,
    Tool,
    Wrist,
)
from api.contract.parts.pictures import PictureView  # noqa: TC001 - pydantic evaluates the annotations
from api.contract.parts.scenes import SceneOrId  # noqa: TC001 - pydantic evaluates the annotations
from api.contract.parts.waypoints import SingleWaypoint  # noqa: TC001 - pydantic evaluates the annotations
from api.contract.requests import InverseKinematicsOptions, Rows


class ForwardKinematicsRequest(Schema):
    """A request for the tool poses of joint positions."""

    robot: NamedRobot
    positions: Rows
    """The joint positions, shape (positions, joints), rad or m."""
    tool: Tool = None
    include: Annotated[list[Literal["links"]], Field(max_length=1)] = Field(default_factory=list)
    """Further parts of the answer: `links`, the poses of all links."""
    deadline: Deadline = DEFAULT_DEADLINE


class InverseKinematicsRequest(Schema):
    """A request for the joint positions of poses."""

    robot: NamedRobot
    poses: Annotated[list[Pose], Field(min_length=1)]
    """The poses of the tool in the base frame (m)."""
    solutions: Literal["best", "all"] = "best"
    """`best`: one solution; for the first pose the nearest to `reference`, for any other the nearest to the solution
    before. `all`: every isolated solution within the limits, nearest to `reference` first, at most 64. Solutions that
    differ by whole turns of joints are included. For a redundant robot it is a spread of solutions. With `scene` or
    `self_collision`, collision-free solutions come first, and `best` is one of them if any is found."""
    reference: JointVector | None = None
    """A joint position, one value for each joint, rad or m. Omitted: for the first pose any solution may be the best,
    and `all` sorts by the distance from the middle of the limits."""
    tool: Tool = None
    tolerance_position: Annotated[float, Field(ge=1e-9, le=1.0)] = 1e-6
    """The largest position error, m."""
    tolerance_orientation: Annotated[float, Field(ge=1e-9, le=1.0)] = 1e-6
    """The largest orientation error, rad."""
    scene: SceneOrId | None = None
    """The scene with objects and attached objects: collision-free solutions come first, and the answer marks the
    others. Omitted: no scene."""
    self_collision: SelfCollision = None
    frames: Annotated[dict[FrameName, Pose], Field(max_length=64)] = Field(default_factory=dict)
    """Frames by name, each with its pose in the world (m), for the objects of the scene."""
    mounting: Pose | None = None
    """The pose of the base in the world (m), the frame of the scene; omitted: the robot's own."""
    seed: Seed = 0
    """The seed of the random starts of the inverse kinematics; the same seed gives the same answer."""
    deadline: Deadline = DEFAULT_DEADLINE


class ReachabilityRequest(Schema):
    """A request for the reachability of waypoints."""

    robot: NamedRobot
    waypoints: Annotated[list[SingleWaypoint], Field(min_length=1)]
    """The waypoints, as in a plan request; motions, transitions, times and limits are ignored."""
    frames: Annotated[dict[FrameName, Pose], Field(max_length=64)] = Field(default_factory=dict)
    """Work objects by name, each with its pose in the world (m), for the `frame` of waypoints; `base` and `world` are
    predefined. Without a mounting the base is the world."""
    mounting: Mounting = None
    tool: Tool = None
    ik: InverseKinematicsOptions = InverseKinematicsOptions()
    """Options of the inverse kinematics; whole turns are chosen nearest to the reference, or to the middle of the
    limits."""
    scene: SceneOrId | None = None
    """The scene with objects and attached objects: collision-free solutions come first, and the answer says whether
    there is one. Objects that are picked up or put down at a waypoint are ignored. Omitted: no scene."""
    self_collision: SelfCollision = None
    seed: Seed = 0
    """The seed of the random starts of the inverse kinematics; the same seed gives the same answer."""
    deadline: Deadline = DEFAULT_DEADLINE


class JacobianRequest(Schema):
    """A request for the Jacobian at a joint position."""

    robot: NamedRobot
    position: JointVector
    """The joint position, one value a joint, rad or m."""
    tool: Tool = None
    deadline: Deadline = DEFAULT_DEADLINE


class WorkspaceRequest(Schema):
    """A request for the workspace of a robot."""

    robot: NamedRobot
    samples: Annotated[int, Field(ge=1, le=100_000)] = 1000
    """The number of points in the answer; the extremes do not depend on it."""
    seed: Seed = 0
    """The seed of the random joint positions; the same seed gives the same points."""
    tool: Tool = None
    view: PictureView = "isometric"
    """The view of a picture of the points (`?format=svg`, `png`)."""
    deadline: Deadline = DEFAULT_DEADLINE


class AnsweredPose(Answer):
    """A pose of the tool in the base frame."""

    position: list[float]
    """The origin of the tool x, y, z, m."""
    orientation: QuaternionOrientation
    """The orientation of the tool, as a quaternion of norm 1."""


class LinkPose(Answer):
    """The pose of a link's frame in the base frame."""

    link: str
    """The name of the link."""
    position: list[float]
    """The origin of the frame x, y, z, m."""
    orientation: QuaternionOrientation
    """The orientation of the frame, as a quaternion of norm 1."""


class ForwardKinematicsAnswer(Answer):
    """Poses of the tool in the base frame, one per joint position."""

    poses: list[AnsweredPose]
    """The poses, in the order of the joint positions."""
    links: list[list[LinkPose]] | None = Field(default=None, exclude_if=lambda links: links is None)
    """The poses of all links, shape (positions, links), from the base to the tip; only with `"include": ["links"]`.
    The frames of a Denavit-Hartenberg table are its own: they are the products of its A matrices."""


class AnsweredConfiguration(Answer):
    """The configuration of shoulder, elbow and wrist, in the terms of a waypoint's `configuration`."""

    shoulder: Shoulder | None
    """The side of the wrist centre; null: on neither side, or the arm has no such name."""
    elbow: Elbow | None
    """The side of the elbow; null: stretched, singular shoulder, or the arm has no such name."""
    wrist: Wrist | None
    """The side of the wrist; null: straight, or the arm has no such name."""


class PositionCollision(Answer):
    """The pair that violates its margin most at a joint position."""

    pair: Annotated[list[str], Field(min_length=2, max_length=2)]
    """The names of the links or objects."""
    depth: float
    """The violation of their margin, m; with a margin of 0, the depth of the overlap."""


class JointSolution(Answer):
    """A joint position that reaches the pose, verified by forward kinematics."""

    position: list[float]
    """The joint position, one value a joint, rad or m."""
    position_error: float
    """The position error of the tool, m."""
    orientation_error: float | None
    """The orientation error of the tool, rad; null: no orientation was requested."""
    manipulability: float
    """sqrt(det(J J^T)) of Yoshikawa (1985), in the units of J: 0 where the arm is singular."""
    configuration: AnsweredConfiguration
    """The configuration of the arm there, by its names."""
    collision: PositionCollision | None = None
    """The colliding pair; null: proved collision-free. Only with `scene` or `self_collision`."""


class NearestPose(Answer):
    """The nearest pose that the robot reaches, for an unreachable pose."""

    position: list[float]
    """The joint position, one value for each joint, rad or m."""
    pose: AnsweredPose
    """The pose of the tool there, in the base frame (m)."""
    position_error: float
    """The position error of the tool, m."""
    orientation_error: float | None
    """The orientation error of the tool, rad; null: no orientation was requested."""
    collision: PositionCollision | None = None
    """The colliding pair; null: proved collision-free. Only for inverse kinematics with `scene` or
    `self_collision`."""


class InverseKinematicsResult(Answer):
    """The result for one pose."""

    status: Literal["solved", "unreachable_waypoint", "joint_position_limit"]
    """`solved`, or the code of the problem."""
    solutions: list[JointSolution]
    """The joint positions that reach the pose; empty unless solved."""
    nearest: NearestPose | None = None
    """The nearest reachable pose; only when not solved."""


class InverseKinematicsAnswer(Answer):
    """Results, one per pose, in order."""

    results: list[InverseKinematicsResult]
    """The results, one for each pose, in the order of the poses."""


class LimitMargin(Answer):
    """The distance of a joint position from the position limits."""

    joint: str
    """The joint nearest to one of its limits, in rad or m."""
    value: float
    """Its distance from that limit, rad or m."""


class WaypointReachability(Answer):
    """The reachability of one waypoint."""

    index: int
    """The index of the waypoint in the request, counted from 0."""
    name: str | None
    """The name in the request; null: none."""
    status: Literal["reachable", "unreachable_waypoint", "joint_position_limit"]
    """`reachable`, or the code of the problem."""
    detail: str | None
    """The reason why it cannot be reached, for a person; null: it can."""
    solutions: int | None
    """The number of isolated solutions, 0 for an unreachable pose; null: a joint waypoint, or a continuum."""
    free: bool | None = None
    """Whether a solution is proved collision-free. Only with `scene` or `self_collision`."""
    free_solutions: int | None = None
    """The number of collision-free `solutions`; null as for `solutions`. Only with `scene` or `self_collision`."""
    hindered_by: list[PositionCollision] | None = None
    """The colliding pairs where no solution is collision-free, each once, the least deep first; otherwise empty. Only
    with `scene` or `self_collision`."""
    limit_margin: LimitMargin | None
    """The distance of the best solution from its limits; the best is the farthest, among collision-free solutions if
    there are any. Null: no joint has limits, or the waypoint cannot be reached."""
    manipulability: float | None
    """sqrt(det(J J^T)) of Yoshikawa (1985) at the best solution, in the units of J; null: it cannot be reached."""
    nearest: NearestPose | None = None
    """The nearest reachable pose; only for an unreachable pose."""


class ReachabilityAnswer(Answer):
    """The reachability of each waypoint alone; nothing is planned."""

    reachable: bool
    """Whether all waypoints can be reached."""
    free: bool | None = None
    """Whether every waypoint has a collision-free solution. Only with `scene` or `self_collision`."""
    waypoints: list[WaypointReachability]
    """One entry for each waypoint, in order."""


class JacobianAnswer(Answer):
    """The Jacobian of the tool at one joint position."""

    jacobian: list[list[float]]
    """The Jacobian, shape (6, joints): the velocity of the tool in the base's axes per joint velocity (rad/s or m/s).
    Three rows are linear (m/s), and three below them angular (rad/s)."""
    manipulability: float
    """sqrt(det(J J^T)) of Yoshikawa (1985), in the units of J: the product of the singular values. For an arm with at
    most three joints, which cannot choose its orientation, only the rows of the position count."""
    singular_values: list[float]
    """The singular values of the Jacobian, in its units, the largest first."""


class Extreme(Answer):
    """An extreme of the workspace and a joint position that reaches it."""

    value: float
    """The value, m."""
    position: list[float]
    """A joint position with that value, one value for each joint, rad or m."""


class WorkspaceAnswer(Answer):
    """The positions that the tool reaches within the position limits; collisions are ignored."""

    points: list[list[float]]
    """The positions of the tool at random joint positions: shape (points, 3), x, y, z in the base frame, m."""
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
