"""What is asked: robot, waypoints, limits and options, as immutable values. SI units everywhere."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np

from planner.kinematics.options import InverseKinematicsOptions
from planner.limits import Limits
from planner.spatial import FloatArray, Pose, rotation_y, rotation_z

if TYPE_CHECKING:
    from planner.robots import Robot
    from planner.robots.payload import Payload

Frame = Literal["tool", "base"]


@dataclass(frozen=True)
class CartesianMove:
    """A translation (m) and a rotation; None keeps the orientation."""

    translation: tuple[float, float, float]
    rotation: FloatArray | None = None

    def transform(self) -> tuple[FloatArray, FloatArray]:
        """Rotation (3, 3) and translation (3,) of the move."""
        rotation = np.eye(3) if self.rotation is None else self.rotation
        return rotation, np.array(self.translation)


@dataclass(frozen=True)
class CylindricalMove:
    """Trans(0, 0, l) Rot(z, alpha) Trans(r, 0, 0): document 001, Section III.A. m and rad."""

    r: float
    alpha: float
    l: float  # noqa: E741 - the document's letter, and the contract's

    def transform(self) -> tuple[FloatArray, FloatArray]:
        """Rotation (3, 3) and translation (3,) of the move."""
        rotation = rotation_z(self.alpha)
        return rotation, np.array([0.0, 0.0, self.l]) + self.r * rotation[:, 0]


@dataclass(frozen=True)
class SphericalMove:
    """Rot(z, gamma) Rot(y, beta) Trans(0, 0, r): document 001, Section III.A (E15 corrected). m and rad."""

    r: float
    beta: float
    gamma: float

    def transform(self) -> tuple[FloatArray, FloatArray]:
        """Rotation (3, 3) and translation (3,) of the move."""
        rotation = rotation_z(self.gamma) @ rotation_y(self.beta)
        return rotation, self.r * rotation[:, 2]


Move = CartesianMove | CylindricalMove | SphericalMove


@dataclass(frozen=True)
class JointMotion:
    """Straight in joint space; beside a waypoint passed `through`, a curve."""


@dataclass(frozen=True)
class LinearMotion:
    """The tool in a straight line, turning about one axis by the shortest rotation.

    Attributes:
        tolerance_position: m, how far the tool may be from the line.
        tolerance_orientation: rad, how far it may be from the orientation due there.
    """

    tolerance_position: float = 1e-4
    tolerance_orientation: float = 1e-3


@dataclass(frozen=True)
class CircularMotion:
    """The tool on the circle through a third pose, from the waypoint before by way of `via`.

    Attributes:
        via: On the way, in the base frame; without a rotation the shortest one from start to end is made.
        tolerance_position: m, how far the tool may be from the circle.
        tolerance_orientation: rad, how far it may be from the orientation due there.
    """

    via: Pose
    tolerance_position: float = 1e-4
    tolerance_orientation: float = 1e-3


Motion = JointMotion | LinearMotion | CircularMotion


@dataclass(frozen=True)
class StopTransition:
    """Come to rest at the waypoint."""


@dataclass(frozen=True)
class ThroughTransition:
    """Pass the waypoint exactly, without stopping."""


@dataclass(frozen=True)
class BlendTransition:
    """Cut the corner without stopping.

    Attributes:
        radius: m; the tool leaves its paths to and from the waypoint only this near to it.
    """

    radius: float


Transition = StopTransition | ThroughTransition | BlendTransition


@dataclass(frozen=True, kw_only=True)
class Waypoint:
    """What every kind of waypoint has.

    Attributes:
        name: For the answer only.
        motion: How to get here from the waypoint before.
        transition: How to pass this waypoint.
        duration: s, of the segment that ends here; None: as fast as the limits allow.
        dwell: s, rest here before going on.
        limits: Of the segment that ends here.
    """

    name: str | None = None
    motion: Motion = JointMotion()
    transition: Transition = StopTransition()
    duration: float | None = None
    dwell: float = 0.0
    limits: Limits | None = None


@dataclass(frozen=True, kw_only=True)
class JointWaypoint(Waypoint):
    """A joint position, one value per joint, rad or m."""

    position: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class PoseWaypoint(Waypoint):
    """A pose of the tool in the base frame."""

    pose: Pose


@dataclass(frozen=True, kw_only=True)
class RelativeWaypoint(Waypoint):
    """A move from the pose of the waypoint before, in the tool's axes or in the base's.

    With `frame` `tool`: T(k) = T(k-1) M. With `base`: p(k) = p(k-1) + p(M), R(k) = R(M) R(k-1).
    """

    frame: Frame
    move: Move


AnyWaypoint = JointWaypoint | PoseWaypoint | RelativeWaypoint


@dataclass(frozen=True)
class PlanningProblem:
    """Everything that one plan depends on but the back end, which puts time on the path.

    Attributes:
        robot: With the tool, if any, already attached.
        waypoints: Two or more; the robot starts at rest at the first and ends at rest at the last.
        limits: For the whole trajectory; a waypoint's own limits go before these.
        inverse_kinematics: Tolerances, reference and seed.
        payload: None: nothing carried.
    """

    robot: Robot
    waypoints: tuple[AnyWaypoint, ...]
    limits: Limits = field(default_factory=Limits)
    inverse_kinematics: InverseKinematicsOptions = field(default_factory=InverseKinematicsOptions)
    payload: Payload | None = None

    @property
    def all_limits(self) -> tuple[Limits, ...]:
        """All limits that are asked: those of the whole trajectory first, then those of single waypoints."""
        own = (waypoint.limits for waypoint in self.waypoints)
        return (self.limits, *(limits for limits in own if limits is not None))
