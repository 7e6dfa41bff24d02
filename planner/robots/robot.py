"""The robot: an immutable wrapper of a Pinocchio model, with names, limits and their provenance."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import pinocchio as pin

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.robots.payload import Payload
    from planner.spatial import FloatArray, Pose

JointKind = Literal["revolute", "continuous", "prismatic"]
Provenance = Literal["published", "datasheet", "estimate", "default"]
LIMITED_QUANTITIES = ("position", "velocity", "acceleration", "jerk", "torque")

TOOL_FRAME = "tool"
"""Name of the frame that carries the tool, when there is one."""


@dataclass(frozen=True)
class Joint:
    """One degree of freedom. Angles in rad, lengths in m; infinite: no limit.

    Attributes:
        name: As in `Robot.joint_names`.
        kind: `continuous` is a revolute joint without position limits that may turn for ever.
        lower: Lower position limit.
        upper: Upper position limit.
        velocity: rad/s or m/s.
        acceleration: rad/s^2 or m/s^2.
        jerk: rad/s^3 or m/s^3.
        torque: N m or N.
        provenance: Where each of `LIMITED_QUANTITIES` comes from; no entry where there is no limit.
    """

    name: str
    kind: JointKind
    lower: float = -np.inf
    upper: float = np.inf
    velocity: float = np.inf
    acceleration: float = np.inf
    jerk: float = np.inf
    torque: float = np.inf
    provenance: Mapping[str, Provenance] = field(default_factory=dict)

    @property
    def is_angle(self) -> bool:
        """Whether the joint turns (rather than slides)."""
        return self.kind != "prismatic"


@dataclass(frozen=True)
class JointGroup:
    """Joints that belong together, as an SRDF has them.

    Attributes:
        name: Of the group.
        joints: Names of its moving joints, from the root to the tips; those that are not among the robot's are
            held still.
        tip_frame: The link at the end of a group that is one chain; None: it is something else.
    """

    name: str
    joints: tuple[str, ...]
    tip_frame: str | None


@dataclass(frozen=True)
class DisabledCollision:
    """Two links that need no collision check against each other, as an SRDF has them.

    Attributes:
        link_1: Name of a link.
        link_2: Name of another.
        reason: In the words of the SRDF; None: not given.
    """

    link_1: str
    link_2: str
    reason: str | None


@dataclass(frozen=True, eq=False)
class Robot:
    """A robot arm whose configuration is one number per joint, continuous joints included.

    Attributes:
        id: Its name in the catalogue or in the store of uploads.
        source: Where the model comes from, for a person.
        model: Pinocchio model with nq == nv == len(joints), in the order of `joints`. Not to be changed.
        joints: In the order of every joint array.
        tip_frame: Name of the frame at the flange.
        geometry: Simple shapes to look at, a list of plain dictionaries in the format of the catalogue files.
        groups: Joints that belong together, of an uploaded SRDF.
        disabled_collisions: Pairs of links that an uploaded SRDF takes out of collision checks.
    """

    id: str
    source: str
    model: pin.Model
    joints: tuple[Joint, ...]
    tip_frame: str
    geometry: tuple[Mapping[str, Any], ...] = ()
    groups: tuple[JointGroup, ...] = ()
    disabled_collisions: tuple[DisabledCollision, ...] = ()

    @cached_property
    def data(self) -> pin.Data:
        """Pinocchio's scratch space. One per process: planning is single-threaded."""
        return self.model.createData()

    @cached_property
    def pool(self) -> pin.ModelPool:
        """The same for what Pinocchio computes of many states at once, on one thread."""
        return pin.ModelPool(self.model, 1)

    @property
    def dof(self) -> int:
        """Degrees of freedom."""
        return len(self.joints)

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """In the order of every joint array."""
        return tuple(joint.name for joint in self.joints)

    @cached_property
    def is_angle(self) -> np.ndarray:
        """(joints,), bool: revolute or continuous."""
        return np.array([joint.is_angle for joint in self.joints])

    def limit(self, quantity: str) -> FloatArray:
        """(joints,): `lower`, `upper`, `velocity`, `acceleration`, `jerk` or `torque`; infinite: none."""
        return self._limits[quantity]

    @cached_property
    def _limits(self) -> dict[str, FloatArray]:
        names = ("lower", "upper", "velocity", "acceleration", "jerk", "torque")
        return {name: np.array([getattr(joint, name) for joint in self.joints]) for name in names}

    @cached_property
    def tool_frame_id(self) -> int:
        """Pinocchio's id of the frame that is to reach the poses: the tool's, or the tip's without a tool."""
        if self.model.existFrame(TOOL_FRAME, pin.FrameType.OP_FRAME):
            return int(self.model.getFrameId(TOOL_FRAME, pin.FrameType.OP_FRAME))
        return self.tip_frame_id

    @cached_property
    def tip_frame_id(self) -> int:
        """Pinocchio's id of the tip frame; by type, for a link may have the tool's name."""
        if not self.model.existFrame(self.tip_frame, pin.FrameType.BODY):
            # Pinocchio would give an id beyond the last frame, and crash when it is used.
            raise ValueError(f"{self.id} has no link called {self.tip_frame!r}")
        return int(self.model.getFrameId(self.tip_frame, pin.FrameType.BODY))

    @cached_property
    def tool_in_tip(self) -> pin.SE3:
        """Placement of the tool in the tip frame; the identity without a tool."""
        frames = self.model.frames
        return frames[self.tip_frame_id].placement.actInv(frames[self.tool_frame_id].placement)

    @cached_property
    def mass(self) -> float:
        """Of everything that moves, with the payload, kg; 0: no masses are known."""
        return float(sum(inertia.mass for inertia in self.model.inertias.tolist()[1:]))

    @property
    def has_dynamics(self) -> bool:
        """Whether torques can be computed."""
        return self.mass > 0.0

    @cached_property
    def kinematic_content(self) -> bytes:
        """Equal for robots whose joints move their tip frame alike, within the same position limits.

        That is whatever their names, tools and payloads: what depends on the kinematics alone is kept by it.
        """
        placements = [placement.homogeneous for placement in self.model.jointPlacements.tolist()[1:]]
        tip = self.model.frames[self.tip_frame_id]
        limits = self.limit("lower"), self.limit("upper")
        arrays = [*placements, tip.placement.homogeneous, np.array(tip.parentJoint), self.is_angle, *limits]
        return b"".join(np.ascontiguousarray(array).tobytes() for array in arrays)

    @cached_property
    def middle(self) -> FloatArray:
        """(joints,): the middle of the position limits; 0 where a side is open."""
        lower, upper = self.limit("lower"), self.limit("upper")
        bounded = np.isfinite(lower) & np.isfinite(upper)
        middle = np.where(bounded, (np.where(bounded, lower, 0.0) + np.where(bounded, upper, 0.0)) / 2.0, 0.0)
        return np.clip(middle, lower, upper)

    def with_tool(self, pose: Pose) -> Robot:
        """The same robot with a tool centre point at `pose` in the tip frame."""
        model = self.model.copy()
        tip = model.frames[self.tip_frame_id]
        rotation = np.eye(3) if pose.rotation is None else pose.rotation
        placement = tip.placement * pin.SE3(rotation, pose.position)
        model.addFrame(pin.Frame(TOOL_FRAME, tip.parentJoint, self.tip_frame_id, placement, pin.FrameType.OP_FRAME))
        return replace(self, model=model)

    def with_payload(self, payload: Payload) -> Robot:
        """The same robot carrying `payload` at its tip frame."""
        model = self.model.copy()
        tip = model.frames[self.tip_frame_id]
        body = pin.Inertia(payload.mass, np.array(payload.center_of_mass), np.diag(payload.inertia))
        model.appendBodyToJoint(tip.parentJoint, body, tip.placement)
        return replace(self, model=model)
