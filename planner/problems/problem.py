"""What is asked: robot, waypoints, limits and options, as immutable values. SI units everywhere."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from planner.errors import InvalidProblem
from planner.kinematics.configurations import Configuration
from planner.kinematics.options import InverseKinematicsOptions
from planner.limits import Limits, segment_limits
from planner.problems.transitions import StopTransition
from planner.robots import Robot
from planner.robots.tools import with_tools
from planner.scene.scene import Handling
from planner.spatial import ROTATION_TOLERANCE, as_pose, convert_poses

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from planner.limits import SegmentLimits
    from planner.problems.actions import Action
    from planner.problems.moves import Move
    from planner.problems.regions import Free
    from planner.problems.transitions import Transition
    from planner.robots.payload import Payload
    from planner.scene.scene import Attach, Scene
    from planner.spatial import Pose
    from planner.speed_zones import SpeedZone

Frame = Literal["tool", "base"]

START_TOLERANCE = 1e-4
"""How far outside of a position limit a joint waypoint may be, rad or m, to be taken for the limit: more than encoders
and rounding of a robot at its limit leave, and less than anybody would see."""


Turns = Literal["nearest", "as_given"]
"""Which of the positions that differ by whole turns of a continuous joint a joint waypoint means."""


@dataclass(frozen=True)
class JointMotion:
    """A motion straight in joint space; beside a waypoint that is passed `through`, a curve.

    Attributes:
        turns: `nearest`: a continuous joint takes the short way to a joint waypoint, from 3.1 to -3.1 by 0.08 rad, as
            far as the positions here and at the waypoint before are angles between -pi and pi; one beyond counts whole
            turns, and is taken as it is given. `as_given`: they are all taken so.
    """

    turns: Turns = "nearest"


Singularity = Literal["refuse", "slow", "deviate"]
"""What a motion of the tool does near a singularity, where a joint would have to go far for a small step of the tool.

`refuse`: it is refused where a joint would have to go further than 1000 rad (or m) for 1 m or 1 rad of the tool.
`slow`: it keeps to its path, and time stretches. `deviate`: the tool's orientation leaves the path by up to
`tolerance_orientation`, so that the arm goes right through the singularity of its wrist."""


@dataclass(frozen=True, kw_only=True)
class CartesianMotion:
    """A motion of the tool along a given curve, which the joints follow.

    Attributes:
        tolerance_position: How far the tool may be from the curve, m.
        tolerance_orientation: How far it may be from the orientation that belongs there, rad.
        singularity: What it does near a singularity.
        free: What of the poses between the ends is left open, 0 among it; None: nothing. It is made use of where the
            joints could not follow the motion otherwise; the ends are as they are asked.
    """

    tolerance_position: float = 1e-4
    tolerance_orientation: float = 1e-3
    singularity: Singularity = "refuse"
    free: Free | None = None


@dataclass(frozen=True)
class LinearMotion(CartesianMotion):
    """A motion of the tool in a straight line, turning about one axis by the shortest rotation."""


@dataclass(frozen=True)
class CircularMotion(CartesianMotion):
    """A motion of the tool on the circle through a third pose, from the waypoint before by way of `via`.

    Attributes:
        via: A pose on the way, in the base frame; without a rotation the shortest one from start to end is made.
    """

    via: Pose

    def __post_init__(self) -> None:
        """Convert other types of poses."""
        convert_poses(self, "via")


@dataclass(frozen=True)
class PolylineMotion(CartesianMotion):
    """A motion of the tool straight from pose to pose, its corners cut.

    The poses lie between the waypoint before and the one that it leads to. A corner is cut by a curve whose curvature
    grows from nought and falls again, so that the tool can go at one speed from end to end.

    Attributes:
        poses: Where the corners are, in the base frame; one without a rotation has that which belongs there on the
            shortest turn between its neighbours that have one.
        blend: How near to a corner the tool leaves the straight line, m: less where half of a line is shorter.
    """

    poses: Sequence[Pose]
    blend: float

    def __post_init__(self) -> None:
        """Convert other types of poses."""
        object.__setattr__(self, "poses", tuple(as_pose(pose, f"poses[{i}]") for i, pose in enumerate(self.poses)))


@dataclass(frozen=True)
class SplineMotion(CartesianMotion):
    """A motion of the tool on a smooth curve through poses.

    The poses lie between the waypoint before and the one that it leads to. The position is the natural cubic spline
    over the length of the chords, the rotation that of the quaternions, normalised; both are C2.

    Attributes:
        poses: What the tool passes, in the base frame; one without a rotation has that which belongs there on the
            shortest turn between its neighbours that have one.
    """

    poses: Sequence[Pose]

    def __post_init__(self) -> None:
        """Convert other types of poses."""
        object.__setattr__(self, "poses", tuple(as_pose(pose, f"poses[{i}]") for i, pose in enumerate(self.poses)))


Motion = JointMotion | CartesianMotion


@dataclass(frozen=True, kw_only=True)
class Waypoint:
    """The fields that every kind of waypoint has.

    Attributes:
        name: A name for people.
        motion: How to get here from the waypoint before.
        transition: How to pass this waypoint.
        duration: Time for the segment that ends here, s; None: as fast as the limits allow.
        minimum_duration: Least time for the segment that ends here, s: it takes longer where its limits ask for that.
        dwell: Time to rest here before going on, s.
        limits: Limits on the segment that ends here, no wider than the robot's; None: those of the problem.
        payload: What the robot carries from here on, in place of what it carried; None: that. It changes only where the
            robot stops, and while it rests there both are held: a gripper may close at any time of the dwell.
        put_down: Whether the robot puts down here what it carries, and goes on without a payload.
        attach: Objects of the scene that the robot takes here: from here on they move with it. It has to stop here;
            what they weigh is the `payload`.
        detach: Names of objects that the robot puts down here, which it has taken or which were attached to it: from
            here on they stay where they are. It has to stop here.
        tool: The tool centre point in the tip frame from here on, in place of the one before; None: that. It is the
            tool whose pose is meant here, and whose motion leads here: a line begins where this tool is at the waypoint
            before. There the robot has to stop.
    """

    name: str | None = None
    motion: Motion = JointMotion()
    transition: Transition = StopTransition()
    duration: float | None = None
    minimum_duration: float = 0.0
    dwell: float = 0.0
    limits: Limits | None = None
    payload: Payload | None = None
    put_down: bool = False
    attach: Sequence[Attach] = ()
    detach: Sequence[str] = ()
    tool: Pose | None = None

    def __post_init__(self) -> None:
        """Convert other types of poses."""
        convert_poses(self, "tool")


@dataclass(frozen=True)
class JointWaypoint(Waypoint):
    """A waypoint given by a joint position.

    Attributes:
        position: One value per joint, rad or m; an array will do, too.
        position_name: Name of the robot's named position that this is, see `named`; None: it has none.
    """

    position: Sequence[float]
    position_name: str | None = None

    def __post_init__(self) -> None:
        """Keep plain numbers, which are compared and cannot change."""
        super().__post_init__()
        object.__setattr__(self, "position", tuple(map(float, self.position)))

    @classmethod
    def named(cls, robot: Robot, position_name: str, **more: Any) -> JointWaypoint:
        """Make the waypoint at a named position of a robot, such as its home.

        Args:
            robot: The arm.
            position_name: One of its `named_positions`.
            more: The fields that every kind of waypoint has.

        Raises:
            InvalidProblem: The robot has no position of this name.
        """
        if position_name not in robot.named_positions:
            names = ", ".join(robot.named_positions) or "none"
            fault = f"{robot.id} has no position called {position_name!r}; it has {names}"
            raise InvalidProblem([(("position_name",), fault)])
        return cls(robot.named_positions[position_name], position_name, **more)


@dataclass(frozen=True)
class ViaWaypoint(JointWaypoint):
    """A joint position on the way that was found for a free motion."""


@dataclass(frozen=True)
class PoseWaypoint(Waypoint):
    """A waypoint given by a pose of the tool.

    Attributes:
        pose: In the base frame, or in `frame`; without a rotation, any orientation will do.
        configuration: The sides on which shoulder, elbow and wrist are to be; those that are None are free.
        frame: Pose in the base frame of the work object that `pose` is given in; None: the base frame.
        free: What of the pose is left open; None: nothing. Of all poses in that region the one is taken whose posture
            is nearest to the posture before, in time at the joints' full speed; the way to that posture starts like the
            whole way, and goes on from waypoint to waypoint.
        external: Positions of external axes at which they are to be here, rad or m, by their names; None, and the axes
            that are not named: wherever the choice of the posture takes them.
    """

    pose: Pose
    configuration: Configuration = Configuration()
    frame: Pose | None = None
    free: Free | None = None
    external: Mapping[str, float] | None = None

    def __post_init__(self) -> None:
        """Convert other types of poses."""
        super().__post_init__()
        convert_poses(self, "pose", "frame")

    @property
    def pose_in_base(self) -> Pose:
        """The pose in the base frame."""
        return self.pose if self.frame is None else self.pose.from_frame(self.frame)


@dataclass(frozen=True)
class RelativeWaypoint(Waypoint):
    """A waypoint given by a move from the pose of the waypoint before.

    Where that leaves the orientation open, so does a move that does not turn the tool. One that does asks for the
    orientation to which it turns the one reached there.

    Attributes:
        move: The displacement M.
        frame: Whose axes M is in. `tool`: T(k) = T(k-1) M. `base`: p(k) = p(k-1) + p(M), R(k) = R(M) R(k-1).
    """

    move: Move
    frame: Frame = "tool"

    @property
    def turns_tool(self) -> bool:
        """Whether the move turns the tool, by more than rounding."""
        turn, _ = self.move.transform()
        return bool(np.abs(turn - np.eye(3)).max() > ROTATION_TOLERANCE)


AnyWaypoint = JointWaypoint | PoseWaypoint | RelativeWaypoint


def _as_waypoint(value: Any, robot: Robot, name: str) -> AnyWaypoint:
    """Convert joint values (joints,), the name of a joint position or a pose to a waypoint; return a waypoint as it is.

    Raises:
        InvalidProblem: The robot has no position of this name.
        TypeError: The value is none of these.
    """
    if isinstance(value, AnyWaypoint):
        return value
    if isinstance(value, str):
        return JointWaypoint.named(robot, value)
    if np.ndim(value) == 1 and np.asarray(value).dtype.kind in "fiu":
        return JointWaypoint(value)
    try:
        return PoseWaypoint(as_pose(value, name))
    except TypeError:
        expected = "a waypoint, a joint position, the name of one, a Pose, a pinocchio.SE3 or a transform (4, 4)"
        raise TypeError(f"`{name}` must be {expected}; got {type(value).__name__}") from None


@dataclass(frozen=True)
class PlanningProblem:
    """Everything that one plan depends on but the back end, which puts time on the path.

    Attributes:
        robot: The arm, with its tool already attached if there is one.
        waypoints: One or more. Joint values, names of the robot's positions and poses become waypoints. The robot
            starts at rest at the first and ends at rest at the last. One at the joint position of the one before (up to
            1e-9 rad or m) is passed with it, as the strictest of their transitions asks; a `duration` or
            a `minimum_duration` there is a rest of that time. Where nothing moves and no rest is asked, the robot rests
            for 0.01 s.
        limits: Limits on the whole trajectory; where a waypoint has limits of its own, the narrower hold.
        inverse_kinematics: How the poses among the waypoints are solved.
        payload: What the robot carries, until a waypoint changes it; None: nothing.
        duration: Time for the whole trajectory, dwells included, s: what segments with a duration of their own and
            dwells leave of it, the others share in the proportion of the shortest times that they can take. None: as
            fast as the limits allow.
        start_tolerance: How far outside of a position limit the start, or another joint waypoint, may be, rad or m: it
            is taken to be at the limit, and a warning says so.
        actions: What happens on the way besides motion; the plan says when.
        scene: What stands around the robot and what it carries, from which it keeps clear; None: nothing is known.
        self_collision: Whether the arm keeps clear of itself; None: in a scene, unless its shapes
            are capsules along its kinematics.
        speed_zones: The speeds that no point of the robot exceeds near objects of the scene. The back end's motion is
            slowed there on its own path.
    """

    robot: Robot
    waypoints: Sequence[AnyWaypoint]
    limits: Limits = Limits()
    inverse_kinematics: InverseKinematicsOptions = InverseKinematicsOptions()
    payload: Payload | None = None
    duration: float | None = None
    start_tolerance: float = START_TOLERANCE
    actions: Sequence[Action] = ()
    scene: Scene | None = None
    self_collision: bool | None = None
    speed_zones: Sequence[SpeedZone] = ()

    def __post_init__(self) -> None:
        """Convert waypoints of other types; keep waypoints, actions and speed zones in tuples, which cannot change.

        Raises:
            TypeError: The robot is none, or one of the waypoints.
        """
        if not isinstance(self.robot, Robot):
            hint = f" Write planner.load_robot({self.robot!r})." if isinstance(self.robot, str) else ""
            raise TypeError(f"`robot` must be a planner.Robot; got {type(self.robot).__name__}.{hint}")
        waypoints = [_as_waypoint(value, self.robot, f"waypoints[{i}]") for i, value in enumerate(self.waypoints)]
        object.__setattr__(self, "waypoints", tuple(waypoints))
        for name in ("actions", "speed_zones"):
            object.__setattr__(self, name, tuple(getattr(self, name)))

    def __repr__(self) -> str:
        """Return robot and number of waypoints, in one line."""
        return f"PlanningProblem({self.robot!r}, {len(self.waypoints)} waypoints)"

    def segment_limits(self) -> SegmentLimits:
        """Return the limits in force on each segment; of a single waypoint, those while the robot rests there."""
        own = tuple(waypoint.limits for waypoint in self.waypoints[1:])
        return segment_limits(self.robot, self.limits, own or (None,))

    @cached_property
    def robots(self) -> tuple[Robot, ...]:
        """The robot with the tool of each waypoint; one that goes on with the same tool is the same object."""
        return with_tools(self.robot, [waypoint.tool for waypoint in self.waypoints])

    @cached_property
    def numbers(self) -> tuple[int, ...]:
        """The index with which each waypoint was requested; a corner of a detour has that of the one it leads to."""
        requested = [not isinstance(waypoint, ViaWaypoint) for waypoint in self.waypoints]
        return tuple(accumulate(requested[:-1], initial=0))

    @property
    def payloads(self) -> tuple[Payload | None, ...]:
        """What the robot carries from each waypoint on; None: nothing."""
        carried: list[Payload | None] = []
        payload = self.payload
        for waypoint in self.waypoints:
            payload = None if waypoint.put_down else waypoint.payload or payload
            carried.append(payload)
        return tuple(carried)

    @property
    def handling(self) -> tuple[Handling, ...]:
        """What the robot takes and puts down at each waypoint."""
        return tuple(Handling(waypoint.attach, waypoint.detach) for waypoint in self.waypoints)

    @property
    def all_limits(self) -> tuple[Limits, ...]:
        """All limits that are asked: those of the whole trajectory first, then those of single waypoints."""
        own = (waypoint.limits for waypoint in self.waypoints)
        return (self.limits, *(limits for limits in own if limits is not None))
