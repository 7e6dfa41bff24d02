"""The planning problem: robot, waypoints, limits and options, as immutable values in SI units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate
from typing import Any, Literal

import numpy as np

from planner.errors import InvalidProblem
from planner.kinematics.configurations import Configuration
from planner.kinematics.options import InverseKinematicsOptions
from planner.limits import Limits, SegmentLimits, segment_limits
from planner.problems.actions import Action
from planner.problems.moves import Move
from planner.problems.regions import Free
from planner.problems.residual_vibration import ResidualVibration
from planner.problems.transitions import StopTransition, Transition
from planner.roadmap import Roadmap
from planner.robots import Robot
from planner.robots.payload import Payload, ProcessForce
from planner.robots.tools import with_tools
from planner.scene.scene import Attach, Scene
from planner.spatial import ROTATION_TOLERANCE, Pose, as_pose, convert_poses
from planner.speed_zones import SpeedZone
from planner.trajectories.trajectory import Trajectory

Frame = Literal["tool", "base"]

START_TOLERANCE = 1e-4
"""Largest excess of a joint waypoint beyond a position limit that is moved to it, rad or m: errors of encoders."""

Turns = Literal["nearest", "as_given"]
"""How a joint waypoint selects among positions that differ by whole turns of a continuous joint."""


@dataclass(frozen=True)
class JointMotion:
    """A motion straight in joint space, or a curve next to a waypoint passed `through`.

    Attributes:
        turns: `nearest`: a continuous joint takes the shorter path to a joint waypoint, such as 0.08 rad from 3.1 to
            -3.1. This holds if both positions are angles between -pi and pi; a position beyond counts whole turns, and
            is taken as given. `as_given`: all positions are taken as given.
    """

    turns: Turns = "nearest"


Singularity = Literal["refuse", "slow", "deviate"]
"""Behaviour of a tool motion near a singularity, where a small step of the tool needs a large joint motion.

`refuse`: the motion is refused if a joint needs more than 1000 rad (or m) for 1 m or 1 rad of the tool. `slow`: the
tool keeps its path and slows down. `deviate`: the tool's orientation leaves the path by up to `tolerance_orientation`,
so that the arm passes through its wrist singularity.
"""


@dataclass(frozen=True, kw_only=True)
class CartesianMotion:
    """A motion of the tool along a given curve, which the joints follow.

    Attributes:
        tolerance_position: Largest distance of the tool from the curve, m.
        tolerance_orientation: Largest angle of the tool from the orientation on the curve, rad.
        singularity: Behaviour near a singularity.
        free: Tolerance region of the poses between the ends, with 0 in each range; None: none. The planner uses it only
            if the joints cannot follow the motion otherwise. The poses at the ends stay as requested.
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
    """A motion of the tool from the waypoint before along the circle through `via`.

    Attributes:
        via: A pose on the circle, in the base frame; without a rotation, the tool turns by the shortest rotation.
    """

    via: Pose

    def __post_init__(self) -> None:
        """Convert other types of poses."""
        convert_poses(self, "via")


@dataclass(frozen=True)
class _ThroughPoses(CartesianMotion):
    poses: Sequence[Pose]

    def __post_init__(self) -> None:
        """Convert other types of poses."""
        object.__setattr__(self, "poses", tuple(as_pose(pose, f"poses[{i}]") for i, pose in enumerate(self.poses)))


@dataclass(frozen=True)
class PolylineMotion(_ThroughPoses):
    """A motion of the tool along straight lines from pose to pose, with blended corners.

    The poses lie between the two waypoints of the segment. The curvature of a blend grows from zero and falls back to
    zero, so that the tool can keep one speed from end to end.

    Attributes:
        poses: The corners, in the base frame. The rotation of a pose without one is interpolated on the shortest turn
            between the nearest poses with a rotation.
        blend: Distance from a corner at which the tool leaves the straight line, m: at most half of the line.
    """

    blend: float


@dataclass(frozen=True)
class SplineMotion(_ThroughPoses):
    """A motion of the tool on a smooth curve through poses.

    The poses lie between the two waypoints of the segment. The position is the natural cubic spline
    over the length of the chords, the rotation that of the quaternions, normalised; both are C2.

    Attributes:
        poses: The poses that the tool passes, in the base frame. Rotations are interpolated as of `PolylineMotion`.
    """


Motion = JointMotion | CartesianMotion
"""The motion to a waypoint."""


@dataclass(frozen=True, kw_only=True)
class Waypoint:
    """The fields of every kind of waypoint.

    Attributes:
        name: A name for people.
        motion: The motion from the waypoint before.
        transition: Stop at this waypoint, pass it, or blend the corner.
        duration: Time for the segment that ends here, s; None: as fast as the limits allow.
        minimum_duration: Shortest time for the segment that ends here, s; the limits may require a longer one.
        earliest_arrival: The robot arrives here no sooner, s after the start; it waits at the last stop before.
        latest_arrival: The robot arrives here no later, s after the start; None: at any time.
        dwell: Time to rest here before going on, s.
        limits: Limits on the segment that ends here, no wider than the robot's; None: the limits of the problem.
        payload: The payload after this waypoint; None: unchanged. It changes only at stops; limits hold with both.
        put_down: Whether the robot puts down its payload here and continues without one.
        attach: Objects of the scene that the robot takes here, where it must stop. Set their mass in `payload`.
        detach: Names of carried objects that the robot puts down here, where they stay, or move along with the object
            that the waypoint is on. The robot must stop here.
        tool: The tool centre point in the tip frame from this waypoint on; None: unchanged. The pose of this waypoint
            and the motion to it refer to this tool. The robot must stop at the waypoint before.
        process_force: The force of the tool on the segment that ends here; it changes only where the robot stops.
    """

    name: str | None = None
    motion: Motion = JointMotion()
    transition: Transition = StopTransition()
    duration: float | None = None
    minimum_duration: float = 0.0
    earliest_arrival: float = 0.0
    latest_arrival: float | None = None
    dwell: float = 0.0
    limits: Limits | None = None
    payload: Payload | None = None
    put_down: bool = False
    attach: Sequence[Attach] = ()
    detach: Sequence[str] = ()
    tool: Pose | None = None
    process_force: ProcessForce | None = None

    def __post_init__(self) -> None:
        """Convert other types of poses."""
        convert_poses(self, "tool")


@dataclass(frozen=True)
class JointWaypoint(Waypoint):
    """A waypoint given by a joint position.

    Attributes:
        position: One value per joint, rad or m, as a sequence or an array.
        position_name: Name of this position among the robot's named positions, see `named`; None: no name.
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
            more: The fields of every kind of waypoint.

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
    """A joint position on the detour of a free motion."""


@dataclass(frozen=True)
class PoseWaypoint(Waypoint):
    """A waypoint given by a pose of the tool.

    Attributes:
        pose: The pose in the base frame, or in `frame` or on an object; without a rotation, any is allowed.
        configuration: The branches of shoulder, elbow and wrist; None: any branch.
        frame: Pose in the base frame of the work object that `pose` is given in; None: the base frame.
        free: Tolerance region of the pose; None: none. The planner takes the joint position of that region that is
            nearest to the one before, in time at the joints' full speed. It chooses one waypoint after the other, and
            starts from `inverse_kinematics.reference` or the middle of the limits.
        external: Positions of external axes here, rad or m, by their names; without an entry, the planner chooses.
        on: Name of an object at constant velocity, in whose frame `pose` is; the planner chooses the time. None: none.
    """

    pose: Pose
    configuration: Configuration = Configuration()
    frame: Pose | None = None
    free: Free | None = None
    external: Mapping[str, float] | None = None
    on: str | None = None

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
"""Type of the waypoints of a problem."""


def _as_waypoint(value: Any, robot: Robot, name: str) -> Waypoint:
    """Convert joint values (joints,), a named position or a pose to a waypoint; return a waypoint unchanged."""
    if isinstance(value, Waypoint):
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
    """The full input of one plan, except the back end that computes its time scaling.

    Attributes:
        robot: The arm, with its tool already attached if there is one.
        waypoints: One or more; joint values, names of positions and poses become waypoints. The robot starts and ends
            at rest. A waypoint within 1e-9 rad or m of the one before is passed with it, by the stricter transition.
            A `duration` there is a rest. A trajectory without motion or rest is a rest of 0.01 s.
        limits: Limits on the whole trajectory; where a waypoint has its own limits, the narrower ones hold.
        inverse_kinematics: Options of the inverse kinematics for pose waypoints.
        payload: The payload until a waypoint changes it; None: none.
        duration: Time for the whole trajectory, dwells included, s. Segments without a `duration` share the time left,
            in proportion to their shortest times. None: as fast as the limits allow.
        start_tolerance: Largest excess of a joint waypoint beyond a position limit that is moved to it, rad or m.
        actions: Actions besides motion; the plan has their times.
        scene: The obstacles, and the objects that the robot carries; None: no obstacle is known.
        self_collision: Whether the planner checks the arm against itself. None: only in a scene, and not if its shapes
            are capsules along its kinematics.
        speed_zones: Speed limits of every point of the robot near objects; it slows there, on the same path.
        residual_vibration: A vibration mode whose residual vibration is suppressed or reported; None: none is known.
        optimise: `duration` moves joint positions at poses, radii of blends, and corners of free motions without an
            `optimise` of their own, for a shorter duration. None: the first certified plan counts.
        time_budget: Longest time of it, s, the first plan included; equal requests may then differ. None: no limit.
        optimise_iterates: The most trajectories tried, and again for each free motion; None: 100 without `time_budget`.
        warm_start: A trajectory of any origin, at whose joint positions it also begins; None: none.
        roadmap: A roadmap that free motions without constraints on the tool are first searched on; None: there is none.
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
    residual_vibration: ResidualVibration | None = None
    optimise: Literal["duration"] | None = None
    time_budget: float | None = None
    optimise_iterates: int | None = None
    warm_start: Trajectory | None = None
    roadmap: Roadmap | None = None

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
        own = tuple(waypoint.limits for waypoint in self.waypoints[1:]) or (None,)
        masses = [0.0 if payload is None else payload.largest_mass for payload in self.payloads[: len(own)]]
        return segment_limits(self.robot, self.limits, own, masses)

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
        """The payload after each waypoint; None: none."""
        carried: list[Payload | None] = []
        payload = self.payload
        for waypoint in self.waypoints:
            payload = None if waypoint.put_down else waypoint.payload or payload
            carried.append(payload)
        return tuple(carried)

    @property
    def all_limits(self) -> tuple[Limits, ...]:
        """All requested limits: the limits of the whole trajectory first, then the limits of single waypoints."""
        return (self.limits, *(waypoint.limits for waypoint in self.waypoints if waypoint.limits is not None))
