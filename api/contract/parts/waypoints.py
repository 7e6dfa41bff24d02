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
    Schema,
    Seconds,
    Shoulder,
    Vector3,
    Wrist,
)
from api.contract.parts.scenes import Name  # noqa: TC001


class JointMotion(Schema):
    """Straight in joint space; beside a waypoint that is passed `through`, a smooth curve."""

    kind: Literal["joint"]
    """The motion: straight in joint space."""
    turns: Literal["nearest", "as_given"] = "nearest"
    """`nearest`: a continuous joint takes the short way to a joint waypoint, from 3.1 to -3.1 by 0.08 rad (it is then
    at 3.18), as far as the positions here and at the waypoint before are angles between -pi and pi; one beyond counts
    whole turns, and is taken as it is given. `as_given`: all are taken so, from 3.1 to -3.1 by 6.2 rad."""


class FreeMotion(Schema):
    """Around what is in the way: straight in joint space if that is free, and else along a way that is found.

    The way consists of straight joint motions that are proved to be free, not sampled, and is then timed by the back
    end: its corners are passed without stopping, or cut, or stopped at, whatever is the first that the certificate
    proves free. To a pose any of its configurations will do that has room, unless a motion of the tool follows. The
    segment has no `duration` of its own. Equal requests find equal ways (`seed`).
    """

    kind: Literal["free"]
    """The motion: a way around."""
    most_checks: Annotated[int, Field(ge=1, le=50_000)] = 20_000
    """The most motions that the search looks at before it gives up with `no_path_found`: 20000 take 5 to 20 s. A number
    and no time, so that equal requests have equal answers."""
    optimise: Literal["duration", "effort", "path_length"] | None = None
    """What the way is made better by once one is found: other ways are searched for and changed, timed by the back end
    and certified, and the best is the answer, whose `waypoints` have the `gain`. All is that of the whole trajectory:
    its `duration`; its `effort`, the integral of the sum of (torque / limit)^2, or of (acceleration / limit)^2 of a
    robot without inertias; the `path_length` in the space of the joints. Omitted: one change of the first way
    is tried."""
    time_budget: Annotated[float, Field(gt=0.0, le=600.0)] | None = None
    """How long that may take, s, from when planning begins: the best way until then is the answer, so that it depends
    on how fast the service is. It ends before the `deadline`, too. Omitted: it ends after `optimise_checks`."""
    optimise_checks: Annotated[int, Field(ge=1, le=50_000)] | None = None
    """The most motions that are looked at to make the way better, a trajectory that is timed counting as 100 of them:
    5000, the default, take 1 to 5 s. With a `time_budget` omitted: any number."""


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
    """Ranges of a pose that are left open: lower and upper ends, in the axes of the pose.

    The tool may be at the pose times Trans(x, y, z) Rx(rotation_x) Ry(rotation_y) Rz(rotation_z); what has no range is
    0. So a turn about z, the last one, is about the tool's own axis.
    """

    x: Offsets | None = None
    """The range of the shift along the x axis of the pose, m."""
    y: Offsets | None = None
    """The range of the shift along its y axis, m."""
    z: Offsets | None = None
    """The range of the shift along its z axis, m."""
    rotation_x: Offsets | None = None
    """The range of the turn about its x axis, rad, within a quarter of a turn to either side."""
    rotation_y: Offsets | None = None
    """The range of the turn about its y axis as turned so, rad, within a quarter of a turn to either side."""
    rotation_z: Offsets | None = None
    """The range of the turn about the tool's own z axis, rad, within half a turn to either side."""


class ToolMotion(Schema):
    """What every motion of the tool along a given curve has."""

    tolerance_position: TolerancePosition = 1e-4
    """The distance that the tool may be off the curve, m."""
    tolerance_orientation: ToleranceOrientation = 1e-3
    """The angle that the tool may be off the orientation that belongs there, rad."""
    singularity: Singularity = "refuse"
    """What to do near a singularity."""
    free: Literal["rotation_z"] | Region | None = None
    """What of the poses between the ends is left open; null or omitted: nothing. `rotation_z`: the turn about the
    tool's own z axis, as of a torch or a round nozzle; or ranges along the axes of the poses and about them, with 0. It
    is made use of where the joints could not follow the motion otherwise, as of an arm with five joints; the ends are
    as they are asked, or chosen by the `free` of their waypoints."""


class LinearMotion(ToolMotion):
    """The tool in a straight line, turning by the shortest rotation."""

    kind: Literal["linear"]
    """The motion: a straight line of the tool."""


class CircularMotion(ToolMotion):
    """The tool on the circle through three poses: the waypoint before, `via`, and this one."""

    kind: Literal["circular"]
    """The motion: an arc of the tool."""
    via: Pose
    """A pose on the way (m), in the frame of the waypoint; without an orientation the tool turns by the shortest
    rotation."""


class PolylineMotion(ToolMotion):
    """The tool straight from pose to pose, the corners cut, at one speed from end to end if the limits allow it.

    The poses lie between the waypoint before and this one. To come to rest at a corner, let it be a waypoint.
    """

    kind: Literal["polyline"]
    """The motion: a polyline of the tool."""
    poses: Annotated[list[Pose], Field(min_length=1)]
    """The corners (m), in the frame of the waypoint; without an orientation the tool turns on by the shortest
    rotation."""
    blend: Annotated[float, Field(ge=1e-5, le=LARGEST)]
    """The distance from a corner at which the tool leaves the straight line, m; less where half of a line is shorter.
    The curvature of the curve that cuts the corner grows from nought and falls again, so that accelerations do not
    jump."""


class SplineMotion(ToolMotion):
    """The tool on a smooth curve through poses, at one speed from end to end if the limits allow it.

    The poses lie between the waypoint before and this one. The position is the natural cubic spline over the length of
    the chords, the orientation that of the quaternions, normalised: both have continuous second derivatives.
    """

    kind: Literal["spline"]
    """The motion: a spline of the tool."""
    poses: Annotated[list[Pose], Field(min_length=1)]
    """The poses that the tool passes (m), in the frame of the waypoint; one without an orientation has that of the
    shortest rotation between its neighbours."""


Motion = TypeAliasType(
    "Motion",
    Annotated[
        JointMotion | FreeMotion | LinearMotion | CircularMotion | PolylineMotion | SplineMotion,
        Field(discriminator="kind", description="How to get to a waypoint."),
    ],
)


class StopTransition(Schema):
    """Come to rest at the waypoint."""

    kind: Literal["stop"]
    """The transition: a stop."""


class ThroughTransition(Schema):
    """Pass the waypoint exactly, without stopping."""

    kind: Literal["through"]
    """The transition: a passage without a stop."""
    velocity: JointVector | None = None
    """The velocity of each joint with which the waypoint is passed, rad/s or m/s: `ruckig`, `quintic` and `auto` keep
    it without an acceleration, `cubic` with a jump of the acceleration, where only joint motions are passed from stop
    to stop; other back ends refuse it; omitted: one that suits the back end."""


class BlendTransition(Schema):
    """Cut the corner without stopping; the tool leaves its paths only within the radius of the waypoint.

    Where the robot would collide with the blend, it takes the largest radius that is proved free, to a tenth of it and
    down to a 32nd of what is asked; the warning `blend_reduced` says which.
    """

    kind: Literal["blend"]
    """The transition: a cut corner."""
    radius: Annotated[float, Field(ge=1e-5, le=LARGEST)]
    """The most distance from the waypoint at which the tool may leave its path, m."""


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
    """The rotation; null or omitted: the tool keeps its orientation. After a waypoint that asks for a position alone
    the orientation stays open, whatever the move: it goes from that position, along the base's axes or those that the
    tool has there."""


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
    """An object of the scene that the robot takes at a waypoint."""

    id: Name
    """The id of the object."""
    link: Name | None = None
    """The name of the link that it moves with from here on; omitted: it is held at the tool."""
    touch_links: Annotated[list[Name], Field(max_length=64)] = Field(default_factory=list)
    """The names of links and attached objects that may touch it, besides what moves with the same joint as its link."""


class WaypointBase(Schema):
    """What every kind of waypoint has."""

    name: Annotated[str, Field(max_length=200)] | None = None
    """A name that the answer repeats; it means nothing to the planner."""
    motion: Motion = JointMotion(kind="joint")
    """How to get here from the waypoint before; omitted: straight in joint space."""
    duration: Seconds | None = None
    """The time from the departure at the waypoint before to the arrival here, s; omitted: the shortest within the
    limits."""
    minimum_duration: Annotated[float, Field(ge=0.0, le=LARGEST)] = 0.0
    """The least time from the departure at the waypoint before to the arrival here, s: it takes longer where the limits
    ask for that, or the `duration` of the whole leaves more."""
    dwell: Annotated[float, Field(ge=0.0, le=LARGEST)] = 0.0
    """The time to rest here before going on, s."""
    transition: Transition = StopTransition(kind="stop")
    """How to pass this waypoint; omitted: with a stop."""
    limits: Limits | None = None
    """Limits of the segment that ends here, besides those of the whole trajectory: the narrower of both hold."""
    payload: Payload | None = None
    """The body that the robot carries from here on, in place of what it carried; omitted: that. It changes only where
    the robot stops; as a gripper may close at any time of the dwell, what is carried before and what is carried after
    are both held there within the torque limits."""
    put_down: bool = False
    """Whether the robot puts down here what it carries, and goes on without a payload."""
    attach: Annotated[list[Attach], Field(max_length=64)] = Field(default_factory=list)
    """Objects of the `scene` that the robot takes here: from here on they move with it, where they are now, and keep
    clear of everything else. What they weigh is the `payload`."""
    detach: Annotated[list[Name], Field(max_length=64)] = Field(default_factory=list)
    """The ids of objects that the robot puts down here, taken before or `attached` in the scene: from here on they stay
    where they are. At one waypoint this comes before `attach`."""
    tool: Pose | None = None
    """The pose of the tool centre point in the tip frame (m) from here on, in place of the tool before; omitted: that.
    It is this tool whose pose is meant here, and the motion to here is its motion: a line begins where this tool is at
    the waypoint before, where the robot has to stop."""
    actions: Annotated[list[WaypointAction], Field(max_length=100)] = Field(default_factory=list)
    """What happens on arrival here besides motion, one after the other; after the `actions` of the request that are at
    this waypoint."""


class JointWaypoint(WaypointBase):
    """A joint position to go to."""

    kind: Literal["joint"]
    """The kind of waypoint: a joint position."""
    position: JointVector
    """The joint position, one value a joint in the order of `joint_names`, rad or m."""


class NamedWaypoint(WaypointBase):
    """A named position of the robot to go to."""

    kind: Literal["named"]
    """The kind of waypoint: a named position of the robot."""
    name: Annotated[str, Field(min_length=1, max_length=200)]
    """The name of one of the robot's `named_positions`, which the answer repeats."""


class ArmConfiguration(Schema):
    """The sides on which shoulder, elbow and wrist are to be, for arms that have such names."""

    shoulder: Shoulder | None = None
    """Where the wrist centre is, seen in the frame that turns with the first joint: `right`, on the side of axis 2
    (KUKA: basic area, bit 0 of the status is 0), `left`, behind axis 1 (overhead area); of an arm whose links go by
    axis 1 at a distance (UR): to the `right` or the `left` of it, seen from there. Null or omitted: either."""
    elbow: Elbow | None = None
    """Whether the elbow is `up` or `down`: above or below the line from axis 2 to the wrist centre, seen from the side.
    Null or omitted: either."""
    wrist: Wrist | None = None
    """`no_flip`: the fifth joint is between 0 and pi; `flip`: between -pi and 0 (KUKA: bit 2 of the status is 1),
    counted from where axes 4, 5 and 6 lie in one plane. Null or omitted: either."""


class PoseWaypoint(WaypointBase):
    """A pose to bring the tool to."""

    kind: Literal["pose"]
    """The kind of waypoint: a pose of the tool."""
    pose: Pose
    """The pose of the tool (m), in the base frame unless `frame` names another."""
    frame: FrameName | None = None
    """The name of the frame that the pose, and the `via` or `poses` of a motion to it, are in: one of the request's
    `frames`, `base` or `world`; omitted: `base`. Answers are in the base frame."""
    free: Literal["rotation_z"] | Region | None = None
    """What of the pose is left open; null or omitted: nothing. `rotation_z`: the turn about the tool's own z axis, as
    of a drill or a round nozzle; or ranges along the axes of the pose and about them. Of all poses in this region the
    one is taken whose posture is nearest to the one before, in time at the joints' full speed; in a scene the nearest
    at which the robot keeps clear, there and on the motions of the tool that follow. Motions to and from this waypoint
    are as if it had been asked, and the answer has its pose, and in `free` where in the region it is."""
    configuration: ArmConfiguration | None = None
    """The configuration in which the arm is to be there; a singular posture belongs to those on both sides. Null or
    omitted: any, chosen so that the way through the whole list is shortest."""
    external: Annotated[dict[FrameName, Number], Field(max_length=8)] | None = None
    """Positions (rad or m) at which external axes of the robot are to be there, by their names, motions of the tool
    included; null, omitted, or an axis that is not named: wherever the choice of the posture takes it."""


class RelativeWaypoint(WaypointBase):
    """A move from the pose of the waypoint before."""

    kind: Literal["relative"]
    """The kind of waypoint: a move from the one before."""
    frame: Literal["tool", "base"]
    """The frame whose axes the move is along: the tool's at the waypoint before, or the base's."""
    move: Move
    """The move from the pose of the waypoint before."""


Waypoint = TypeAliasType(
    "Waypoint",
    Annotated[
        JointWaypoint | NamedWaypoint | PoseWaypoint | RelativeWaypoint,
        Field(discriminator="kind", description="Where the robot is to go."),
    ],
)
