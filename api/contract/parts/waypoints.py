"""Waypoints of a request: where to go, how to get there, and what happens there."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field
from typing_extensions import TypeAliasType

from api.contract.parts.actions import WaypointAction  # noqa: TC001 - pydantic evaluates the annotations
from api.contract.parts.common import (
    LARGEST,
    Elbow,
    FrameName,
    JointVector,
    Limits,
    Number,
    Orientation,
    Payload,
    Pose,
    ProcessForce,
    Schema,
    Seconds,
    Shoulder,
    Vector3,
    Wrist,
)
from api.contract.parts.free_motions import FreeMotion
from api.contract.parts.scenes import Name  # noqa: TC001


class JointMotion(Schema):
    """A motion straight in joint space; a smooth curve next to a waypoint with a `through` transition."""

    kind: Literal["joint"]
    """The motion: straight in joint space."""
    turns: Literal["nearest", "as_given"] = "nearest"
    """`nearest`: a continuous joint takes the shorter way to a joint waypoint, from 3.1 to -3.1 by 0.08 rad (it ends
    at 3.18). This holds while its positions here and at the waypoint before are between -pi and pi. A position
    beyond counts whole turns and is taken as given. `as_given`: all positions are taken as given, from 3.1 to -3.1 by
    6.2 rad."""


TolerancePosition = Annotated[float, Field(ge=1e-8, le=1.0)]
ToleranceOrientation = Annotated[float, Field(ge=1e-8, le=1.0)]


Singularity = TypeAliasType(
    "Singularity",
    Annotated[
        Literal["refuse", "slow", "deviate"],
        Field(
            description="What a motion of the tool does near a singularity, where a joint would have to go far for a "
            "small step of the tool. `refuse`: it is refused where a joint would have to go further than 1000 rad (or "
            "m) for 1 m or 1 rad of the tool. `slow`: the tool keeps to its path and the joints to their speeds, and "
            "time stretches. `deviate`: the tool's orientation leaves the path by up to `tolerance_orientation`, so "
            "that the arm goes right through the singularity of its wrist."
        ),
    ],
)


Offsets = Annotated[list[Number], Field(min_length=2, max_length=2)]


class Region(Schema):
    """A tolerance region: ranges along and about the axes of a pose.

    The tool may be at the pose times Trans(x, y, z) Rx(rotation_x) Ry(rotation_y) Rz(rotation_z); a missing range is
    0. The rotation about z comes last, so it is about the tool's own axis.
    """

    x: Offsets | None = None
    """The range of the shift along the x axis of the pose, m."""
    y: Offsets | None = None
    """The range of the shift along its y axis, m."""
    z: Offsets | None = None
    """The range of the shift along its z axis, m."""
    rotation_x: Offsets | None = None
    """The range of the rotation about its x axis, rad, within -pi/2 and pi/2."""
    rotation_y: Offsets | None = None
    """The range of the rotation about the y axis after that rotation, rad, within -pi/2 and pi/2."""
    rotation_z: Offsets | None = None
    """The range of the rotation about the tool's own z axis, rad, within -pi and pi."""


class ToolMotion(Schema):
    """The fields of every tool motion along a given curve."""

    tolerance_position: TolerancePosition = 1e-4
    """The largest distance of the tool from the curve, m."""
    tolerance_orientation: ToleranceOrientation = 1e-3
    """The largest angle between the tool and the orientation of the curve, rad."""
    singularity: Singularity = "refuse"
    """The behaviour near a singularity."""
    free: Literal["rotation_z"] | Region | None = None
    """The tolerance region of the poses between the ends; null or omitted: none. `rotation_z` frees the rotation about
    the tool's own z axis, as for a torch or a round nozzle. Ranges along and about the axes of the poses must contain
    0. The planner uses it where the joints cannot follow the exact motion, as with an arm of five joints. The ends are
    as requested, or within the `free` of their waypoints."""


class LinearMotion(ToolMotion):
    """The tool moves in a straight line and turns by the shortest rotation."""

    kind: Literal["linear"]
    """The motion: a straight line of the tool."""


class CircularMotion(ToolMotion):
    """The tool moves on the circle through three poses: the waypoint before, `via`, and this one."""

    kind: Literal["circular"]
    """The motion: an arc of the tool."""
    via: Pose
    """A pose on the circle (m), in the frame of the waypoint. With an orientation, the tool turns to it and on to the
    end, each the way of the shortest rotation. Without one, the tool turns to the end by the shortest rotation."""


class PolylineMotion(ToolMotion):
    """The tool moves straight from pose to pose with rounded corners, at constant speed where the limits allow it.

    The poses lie between the waypoint before and this one. To stop at a corner, make it a waypoint.
    """

    kind: Literal["polyline"]
    """The motion: a polyline of the tool."""
    poses: Annotated[list[Pose], Field(min_length=1)]
    """The corners (m), in the frame of the waypoint; without an orientation the tool turns on by the shortest
    rotation."""
    blend: Annotated[float, Field(ge=1e-5, le=LARGEST)]
    """The distance from a corner at which the tool leaves the straight line, m; less where half of a line is shorter.
    The curvature of the rounded corner starts and ends at zero, so accelerations do not jump."""


class SplineMotion(ToolMotion):
    """The tool moves on a smooth curve through poses, at constant speed where the limits allow it.

    The poses lie between the waypoint before and this one. The position is the natural cubic spline over the chord
    lengths; the orientation is the normalised spline of the quaternions. Both have continuous second derivatives.
    """

    kind: Literal["spline"]
    """The motion: a spline of the tool."""
    poses: Annotated[list[Pose], Field(min_length=1)]
    """The poses that the tool passes (m), in the frame of the waypoint. A pose without an orientation gets the one on
    the shortest rotation between its neighbours."""


Motion = TypeAliasType(
    "Motion",
    Annotated[
        JointMotion | FreeMotion | LinearMotion | CircularMotion | PolylineMotion | SplineMotion,
        Field(discriminator="kind", description="How to get to a waypoint."),
    ],
)


class StopTransition(Schema):
    """The robot stops at the waypoint."""

    kind: Literal["stop"]
    """The transition: a stop."""


class ThroughTransition(Schema):
    """The robot passes the waypoint exactly, without a stop."""

    kind: Literal["through"]
    """The transition: a passage without a stop."""
    velocity: JointVector | None = None
    """The joint velocities at the waypoint, rad/s or m/s. `ruckig`, `quintic` and `auto` pass it at this velocity with
    zero acceleration, and `cubic` with a jump of the acceleration. Joint motions have to run from stop to stop. Other
    back ends refuse it. Omitted: the back end chooses."""


class BlendTransition(Schema):
    """The robot rounds the corner without a stop; the tool leaves its path only within the radius of the waypoint.

    Where the blend would collide, the planner takes the largest collision-free radius, to within a tenth and down to
    1/32 of the requested radius. The warning `blend_reduced` gives it.
    """

    kind: Literal["blend"]
    """The transition: a blend."""
    radius: Annotated[float, Field(ge=1e-5, le=LARGEST)]
    """The largest distance from the waypoint at which the tool may leave its path, m."""


Transition = TypeAliasType(
    "Transition",
    Annotated[
        StopTransition | ThroughTransition | BlendTransition,
        Field(discriminator="kind", description="How to pass a waypoint."),
    ],
)


class CartesianMove(Schema):
    """A translation, then a rotation."""

    kind: Literal["cartesian"]
    """The notation of the move: Cartesian coordinates."""
    translation: Vector3
    """The translation x, y, z, m."""
    orientation: Orientation | None = None
    """The rotation; null or omitted: the tool keeps its orientation. After a pose without an orientation, the
    orientation stays open. The move starts from that position, along the base's axes or the axes that the tool has
    there."""


class CylindricalMove(Schema):
    """Trans(0, 0, l) Rot(z, alpha) Trans(r, 0, 0)."""

    kind: Literal["cylindrical"]
    """The notation of the move: cylindrical coordinates."""
    r: Number
    """The radius, m."""
    alpha: Number
    """The angle about z, rad."""
    l: Number  # noqa: E741 - the contract's letter
    """The height, m."""


class SphericalMove(Schema):
    """Rot(z, gamma) Rot(y, beta) Trans(0, 0, r)."""

    kind: Literal["spherical"]
    """The notation of the move: spherical coordinates."""
    r: Number
    """The radius, m."""
    beta: Number
    """The angle about y, rad."""
    gamma: Number
    """The angle about z, rad."""


Move = TypeAliasType(
    "Move",
    Annotated[
        CartesianMove | CylindricalMove | SphericalMove,
        Field(discriminator="kind", description="A move relative to the pose before."),
    ],
)


class Attach(Schema):
    """An object of the scene that the robot picks up at a waypoint."""

    id: Name
    """The id of the object."""
    link: Name | None = None
    """The name of the link that the object moves with from here on; omitted: the tool."""
    touch_links: Annotated[list[Name], Field(max_length=64)] = Field(default_factory=list)
    """The names of links and attached objects that may touch it; links that move with the same joint always may."""


class WaypointBase(Schema):
    """The fields of every kind of waypoint."""

    name: Annotated[str, Field(max_length=200)] | None = None
    """A name, which the answer repeats. Robots of a cell meet at waypoints of one name; else the planner does not use
    it."""
    motion: Motion = JointMotion(kind="joint")
    """The motion from the waypoint before; omitted: straight in joint space."""
    duration: Seconds | None = None
    """The time from the departure at the waypoint before to the arrival here, s; omitted: the shortest within the
    limits."""
    minimum_duration: Annotated[float, Field(ge=0.0, le=LARGEST)] = 0.0
    """The minimum time from the departure at the waypoint before to the arrival here, s. The segment takes longer
    where its limits or the `duration` of the whole trajectory need it."""
    earliest_arrival: Annotated[float, Field(ge=0.0, le=LARGEST)] = 0.0
    """The least time from the start to the arrival here, s. The robot waits for it at the last stop before, or slows
    down after a passed waypoint that the wait would make late."""
    latest_arrival: Seconds | None = None
    """The most time from the start to the arrival here, s. A request that cannot keep it is refused with the arrival
    that it can keep. Omitted: any time."""
    dwell: Annotated[float, Field(ge=0.0, le=LARGEST)] = 0.0
    """The dwell at the waypoint, s."""
    transition: Transition = StopTransition(kind="stop")
    """The transition at this waypoint; omitted: a stop."""
    limits: Limits | None = None
    """Limits of the segment that ends here, in addition to the limits of the whole trajectory: the narrower limit
    holds."""
    payload: Payload | None = None
    """The payload from here on, in place of the one before; omitted: no change. It can change only where the robot
    stops. A gripper may close at any time of the dwell, so the torque limits hold there with both payloads."""
    put_down: bool = False
    """Whether the robot releases its payload here and continues without one."""
    attach: Annotated[list[Attach], Field(max_length=64)] = Field(default_factory=list)
    """Objects of the `scene` that the robot picks up here. From here on they move with the robot and must not collide
    with anything else. Their weight is the `payload`. A moving object must have stopped by `earliest_arrival`, unless
    the waypoint is `on` it."""
    detach: Annotated[list[Name], Field(max_length=64)] = Field(default_factory=list)
    """The ids of objects that the robot puts down here: picked up before or `attached` in the scene. From here on they
    stay where they are, or move along with the object that the waypoint is `on`. At the same waypoint, `detach` happens
    before `attach`."""
    tool: Pose | None = None
    """The pose of the tool centre point in the tip frame (m) from here on; omitted: no change. The pose of this
    waypoint and the motion to it refer to this tool. A line starts at this tool's pose at the waypoint before, where
    the robot has to stop."""
    process_force: ProcessForce | None = None
    """The force of the tool on the segment that ends here; omitted: none. It changes only where the robot stops."""
    actions: Annotated[list[WaypointAction], Field(max_length=100)] = Field(default_factory=list)
    """The actions on arrival, one after the other; they come after the request's `actions` at this waypoint."""


class JointWaypoint(WaypointBase):
    """A joint position as the goal."""

    kind: Literal["joint"]
    """The kind of waypoint: a joint position."""
    position: JointVector
    """The joint position, one value a joint in the order of `joint_names`, rad or m."""


class NamedWaypoint(WaypointBase):
    """A named position of the robot as the goal."""

    kind: Literal["named"]
    """The kind of waypoint: a named position of the robot."""
    name: Annotated[str, Field(min_length=1, max_length=200)]
    """The name of one of the robot's `named_positions`, which the answer repeats."""


class ArmConfiguration(Schema):
    """The configuration of shoulder, elbow and wrist, for arms that have these names."""

    shoulder: Shoulder | None = None
    """The side of the wrist centre, in the frame that turns with the first joint. `right`: on the side of axis 2
    (KUKA: basic area, bit 0 of the status is 0). `left`: behind axis 1 (overhead area). For an arm whose links pass
    axis 1 at a distance (UR): the `right` or `left` side of axis 1. Null or omitted: either."""
    elbow: Elbow | None = None
    """Whether the elbow is `up` or `down`: above or below the line from axis 2 to the wrist centre, seen from the side.
    Null or omitted: either."""
    wrist: Wrist | None = None
    """`no_flip`: the fifth joint is between 0 and pi; `flip`: between -pi and 0 (KUKA: bit 2 of the status is 1). The
    angle is zero where axes 4, 5 and 6 lie in one plane. Null or omitted: either."""


class PoseWaypoint(WaypointBase):
    """A pose of the tool as the goal."""

    kind: Literal["pose"]
    """The kind of waypoint: a pose of the tool."""
    pose: Pose
    """The pose of the tool (m), in the base frame unless `frame` names another, or `on` an object."""
    on: Name | None = None
    """The id of an object of the `scene` with a `linear` motion; null or omitted: none. The pose is then in the frame
    of the object, and the tool moves along with it. Its dwell is a rest relative to the object, and so is the straight
    line to a further waypoint on it. Consecutive waypoints on one object are a ride. The planner finds the earliest
    time of arrival within the time window of its first one; the answer has it in `rides`. A further ride, on this
    object or another one, begins as early as the robot can be there after the ride before."""
    frame: FrameName | None = None
    """The name of the frame of the pose, and of the `via` or `poses` of the motion to it. It is one of the request's
    `frames`, `base` or `world`; omitted: `base`. Answers are in the base frame."""
    free: Literal["rotation_z"] | Region | None = None
    """The tolerance region of the pose; null or omitted: none. `rotation_z` frees the rotation about the tool's own z
    axis, as for a drill or a round nozzle. Else give ranges along and about the axes of the pose. The planner takes the
    joint position of this region that is nearest to the one before, in time at full joint speed. In a scene it takes
    the nearest collision-free one, the tool motions that follow included. The answer has the pose of the waypoint, and
    `free` gives its place in the region."""
    configuration: ArmConfiguration | None = None
    """The configuration of the arm at this pose; a singular joint position belongs to both sides. Null or omitted:
    any, so that the whole path is shortest."""
    external: Annotated[dict[FrameName, Number], Field(max_length=8)] | None = None
    """Positions (rad or m) of external axes at this pose, by their names; they also hold for tool motions. Null,
    omitted or not named: the planner chooses."""


class RelativeWaypoint(WaypointBase):
    """A move from the pose of the waypoint before."""

    kind: Literal["relative"]
    """The kind of waypoint: a move from the one before."""
    frame: Literal["tool", "base"]
    """The frame whose axes the move is along: the tool's at the waypoint before, or the base's."""
    move: Move
    """The move from the pose of the waypoint before."""


SingleWaypoint = TypeAliasType(
    "SingleWaypoint",
    Annotated[
        JointWaypoint | NamedWaypoint | PoseWaypoint | RelativeWaypoint,
        Field(discriminator="kind", description="Where the robot is to go."),
    ],
)
