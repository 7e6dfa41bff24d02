"""The robot: an immutable wrapper of a Pinocchio model, with names, limits and their provenance."""

from __future__ import annotations

import threading
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import pinocchio as pin

from planner.errors import Finding
from planner.fields import PickledByFields
from planner.kernels.serial_chain import SerialChain
from planner.robots.collision.geometry import CollisionGeometry, LinkShape
from planner.robots.collision.mesh_files import FindPieces, files_of, meshes_of
from planner.robots.collision.pairs import CollisionPair, collision_pairs
from planner.robots.derived.changes import held_by_group, on_external_axes, with_followers, with_locked
from planner.robots.derived.external_axes import ExternalAxis
from planner.robots.derived.fixed_tools import with_fixed_tool
from planner.robots.derived.own_limits import OwnLimits, checked_positions, checked_table, is_within, with_own_limits
from planner.robots.derived.positioners import mounted_model, refuse_positioner, with_positioner
from planner.robots.description import RobotDescription
from planner.robots.dh import Convention, DHJoint, DHModel, read_dh
from planner.robots.findings import Findings
from planner.robots.loads import fields_with_payload, loaded_chain, model_with_tool
from planner.robots.payload import Payload, PayloadTable
from planner.robots.urdf.arm import PlanningGroup
from planner.robots.urdf.reader import read_urdf
from planner.spatial import Pose, as_pose

TOOL_FRAME = "tool"
"""Name of the frame that carries the tool, when there is one."""


class _Scratch(threading.local):
    """What Pinocchio writes into while it computes with a model: one for each thread, made when it first asks."""

    def __init__(self, model: pin.Model) -> None:
        self.data = model.createData()


@dataclass(frozen=True, eq=False)
class Robot(PickledByFields, RobotDescription):
    """A robot arm whose configuration is one number per joint, continuous joints included.

    Robots are immutable: `derived`, `with_tool`, `with_payload` and `dataclasses.replace` make others.

    Attributes:
        id: The robot's name.
        source: Where the model comes from, for a person.
        model: Pinocchio model with nq == nv == len(joints), in the order of `joints`. Not to be changed.
        joints: The degrees of freedom, in the order of every joint array.
        tip_frame: Name of the frame at the flange; with a fixed tool, of the frame in which arm and tool stand.
        limit_sources: The document of the limits, or the rule of an estimate, by the names of `Joint.provenance`. Other
            quantities come from the same document as the model.
        mounting: Pose of the base in the world, whose z axis points up; None: gravity is as the model has it. Poses are
            in the base frame nonetheless.
        named_positions: Joint positions by name, one value per joint, rad or m.
        geometry: Simple shapes to look at, a list of plain dictionaries in the format of the catalogue files.
        groups: Joints that belong together, as an SRDF has them.
        disabled_collisions: Pairs of links that an SRDF takes out of collision checks.
        collision: The shapes of the links in the description, see `collision_shapes`.
        visuals: The visual meshes of the description, see `visual_meshes`; None: it has none.
        external_axes: Names of the first joints, which are not the arm's own, such as a rail; none: all are the arm's.
        positioner: Names of the first joints, which carry the workpiece, from the workpiece on. They are external axes,
            or all joints of an arm that holds the workpiece under a fixed tool. The base frame is the workpiece then,
            and the arm's base stands still. None: the base frame stands still.
        payload_frame: Name of the flange of an arm that holds the workpiece, for payloads; None: the tip frame.
        rated_payload: The largest payload for which the maker builds the robot, tool included, kg; None: unknown.
        rated_payload_source: The document that `rated_payload` comes from; None: it is unknown.
        payload_mass: The largest mass that `with_payload` has put on the robot, kg.
        payload_table: Factors on the acceleration and jerk limits by the payload mass; None: none.
        process_force: The force that the tool exerts, which is part of all torques; None: none.
        uncertain_payloads: The payloads with tolerances that `with_payload` has put on the robot.
        notes: Notes on the model for a person; only robots of the catalogue have them.
        followers: Mimic joints of a URDF that follow one of the joints once that is locked.
        findings: Warnings and remarks about the model, by its reader.
    """

    @classmethod
    def from_urdf(
        cls,
        urdf: str | Path,
        *,
        srdf: str | Path | None = None,
        tip_frame: str | None = None,
        base_frame: str | None = None,
        group: str | None = None,
        joints: Sequence[str] | None = None,
        locked: Mapping[str, float] | None = None,
        meshes: Path | Mapping[str, bytes] | FindPieces | None = None,
        id: str = "robot",
        source: str = "URDF",
    ) -> Robot:
        """Read the arm from the root link to the tip of a URDF; all other joints are locked.

        A group of the SRDF, a list of names or a base frame selects the moving joints. Without them, all joints on the
        chain to the tip move. Poses are always in the root link's frame.

        The reader takes acceleration and jerk limits from URDF 1.2 (the lower of `acceleration` and `deceleration`).
        Without them, a default rule applies: full speed in 0.25 s, full acceleration in 0.1 s. The soft limits of a
        safety controller narrow the position limits. `Robot.findings` has the remarks of the reader.

        Args:
            urdf: The document, or the path of its file. A string is always a document: it never opens a file.
            srdf: An SRDF document, or its path, with groups, their states (which become `named_positions`) and disabled
                collision pairs.
            tip_frame: Link at the end of the arm; None: the end of the group. Without a group, the tip of the SRDF's
                only chain. Otherwise the end of the longest chain, without fingers; a warning in `findings` names the
                other ends.
            base_frame: Link whose following joints move; together with `tip_frame` it selects the chain.
            group: Name of a group of the SRDF.
            joints: Names of the joints that move.
            locked: Positions of other joints by their names, rad or m. The others are locked at 0, or at the limit
                nearest to 0. Mimic joints follow.
            meshes: Files of the meshes (STL, OBJ, DAE), read at the first use of the shapes. It is the folder of the
                packages that `package://` names, the bytes by path, or a function for collision meshes.
            id: Name of the robot.
            source: Where the document comes from.

        Raises:
            InvalidRobotModel: The model cannot be used; `findings` lists everything that was found.
        """
        requested = PlanningGroup(tip_frame, base_frame, group, joints, locked or {})
        documents = _text(urdf), None if srdf is None else _text(srdf)
        find, files = meshes_of(meshes), files_of(meshes)
        read = read_urdf(
            documents[0], srdf=documents[1], requested=requested, meshes=find, files=files, id=id, source=source
        )
        return cls(**vars(read))

    @classmethod
    def from_dh(
        cls,
        joints: Iterable[DHJoint],
        *,
        convention: Convention = "standard",
        base: Pose | None = None,
        tip: Pose | None = None,
        id: str = "robot",
        source: str = "Denavit-Hartenberg table",
    ) -> Robot:
        """Build an arm from a Denavit-Hartenberg table, with frames `base`, `link_1`, ... (the table's) and `flange`.

        Limits that the table leaves out come from a default rule; torque limits have none. What there is to remark
        stands in `Robot.findings`.

        Args:
            joints: The rows of the table, from the base to the tip.
            convention: `standard` (distal) or `modified` (Craig's), see `DHModel`.
            base: Pose of frame 0 in the robot's base frame; None: the same.
            tip: Pose of the flange in the frame of the last row; None: the same.
            id: Name of the robot.
            source: Where the table comes from.

        Raises:
            InvalidRobotModel: The model cannot be used; `findings` lists everything that was found.
        """
        return cls(**vars(read_dh(DHModel(convention, tuple(joints), base, tip), id=id, source=source)))

    def derived(
        self,
        *,
        id: str | None = None,
        limits: Mapping[str, OwnLimits] | None = None,
        group: str | None = None,
        locked: Mapping[str, float] | None = None,
        tool: Pose | None = None,
        mounting: Pose | None = None,
        named_positions: Mapping[str, Sequence[float]] | None = None,
        external_axes: Sequence[ExternalAxis] = (),
        arm_origin: Pose | None = None,
        positioner: Sequence[ExternalAxis] = (),
        workpiece: Pose | None = None,
        payload_table: PayloadTable | None = None,
        fixed_tool: Pose | None = None,
    ) -> Robot:
        """Derive a robot from this one, with its own limits, tool and mounting.

        Args:
            id: Name of the robot; None: this one's.
            limits: Limits of single joints by their names, e.g. `{"joint_1": {"lower": -1.0, "velocity": 0.5}}`. The
                names are `lower`, `upper` (rad or m), `velocity`, `acceleration`, `jerk` and `torque` (N m or N), and
                `friction`, `damping` and `rotor_inertia`. So are `friction_tolerance`, `damping_tolerance` and
                `following_error`. `velocity_range`, `acceleration_range` and `torque_range` are
                pairs of a lower and an upper limit; `velocity_curves` hold beside this robot's. A limit may be wider
                than this robot's only if that is a default or an estimate; a warning in `findings` says so. A
                continuous joint with position limits becomes a revolute one.
            group: Name of one of `groups`, whose joints are left; the others are fixed. None: all are left.
            locked: Positions by the names of fixed joints, rad or m; they are no joints any more. The joints
                that the group leaves out are fixed at 0 otherwise, or at the limit nearest to it.
            tool: The tool centre point in the tip frame; None: this robot's.
            mounting: Pose of the base in the world, whose z axis points up; None: this robot's. Gravity follows it;
                poses stay in the base frame.
            named_positions: Joint positions by name, one value per remaining joint. They are added to this robot's
                named positions within the limits, which have external axes at 0, or at the limit nearest to 0.
            external_axes: Axes that carry this robot, from the base on: its first joints then. The base frame is that
                in which the first one stands, and its z axis points up unless there is a `mounting`.
            arm_origin: Pose of this robot's base in the link of the last external axis; None: the same.
            positioner: Axes that carry the workpiece, from this robot's base frame to the workpiece: its first joints
                then, in reverse. `mass` and so on of the last axis include the workpiece.
            workpiece: Pose of the workpiece, the base frame of all poses then, in the link of the positioner's last
                axis. With a `fixed_tool` it is in this robot's tip frame. None: the same.
            payload_table: Factors on limits by the payload mass, nowhere above this robot's; None: this robot's.
            fixed_tool: The tool centre point, in this robot's base frame, of a tool that stands in the cell. The arm
                holds the workpiece then, and its joints are in reverse order, from the workpiece on.

        Returns:
            The robot, with `findings` about the changes.

        Raises:
            InvalidRobotModel: A change contradicts this robot; `findings` lists all contradictions.
        """
        findings = Findings()
        held = {**held_by_group(self, group, findings), **(locked or {})}
        left = with_followers(with_locked(self, held, findings), held, findings)
        refuse_positioner(self, external_axes, findings)
        left = on_external_axes(left, external_axes, arm_origin, mounting, findings)
        left = with_fixed_tool(left, fixed_tool, workpiece, (tool, positioner), findings)
        left = with_positioner(left, positioner, workpiece if fixed_tool is None else None, findings)
        joints = with_own_limits(left.joints, limits or {}, findings)
        inherited = {name: q for name, q in left.named_positions.items() if is_within(joints, q)}
        positions = inherited | checked_positions(joints, named_positions or {}, findings)
        if mounting is not None and mounting.rotation is None:
            findings.error("invalid_pose", "mounting", "the mounting needs an orientation")
        table = checked_table(self.payload_table, payload_table, findings)
        findings.raise_errors()
        robot = replace(
            left,
            id=id or self.id,
            joints=joints,
            named_positions=positions,
            payload_table=table,
            findings=tuple(findings.items),
        )
        if mounting is not None and mounting.rotation is not None:
            robot = replace(robot, model=mounted_model(robot, mounting.rotation), mounting=mounting)
        attached = tool or fixed_tool
        return robot if attached is None else robot.with_tool(attached)

    def __repr__(self) -> str:
        """Return id and number of joints, in one line."""
        return f"Robot({self.id!r}, {self.dof} joints)"

    @cached_property
    def _scratch(self) -> _Scratch:
        return _Scratch(self.model)

    @property
    def data(self) -> pin.Data:
        """Pinocchio's scratch space, of each thread its own."""
        return self._scratch.data

    @cached_property
    def chain(self) -> SerialChain:
        """The joints and inertias of the model and the drives, for compiled kernels."""
        return loaded_chain(self, self.tool_frame_id)

    @property
    def dof(self) -> int:
        """The number of joints that move."""
        return len(self.joints)

    @property
    def is_position_only(self) -> bool:
        """Whether the arm has too few joints to choose the orientation of its tool, too: three or fewer of its own."""
        return self.dof - len(self.external_axes) <= 3

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """The names of the joints, in the order of every joint array."""
        return tuple(joint.name for joint in self.joints)

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
    def payload_frame_id(self) -> int:
        """Pinocchio's id of the frame that payloads are in: the flange."""
        name = self.payload_frame or self.tip_frame
        return int(self.model.getFrameId(name, pin.FrameType.BODY))

    @cached_property
    def tool_in_tip(self) -> pin.SE3:
        """Placement of the tool in the tip frame; the identity without a tool."""
        frames = self.model.frames
        return frames[self.tip_frame_id].placement.actInv(frames[self.tool_frame_id].placement)

    @cached_property
    def mass(self) -> float:
        """The mass of everything that moves, with the payload, kg; 0: no masses are known."""
        masses = [inertia.mass for inertia in self.model.inertias.tolist()]
        del masses[len(self.positioner)]  # of the link that stands still
        return float(sum(masses))

    @property
    def has_dynamics(self) -> bool:
        """Whether torques can be computed."""
        return self.mass > 0.0 or self.process_force is not None

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
    def collision_shapes(self) -> tuple[LinkShape, ...]:
        """The convex shapes of the links, read at the first use.

        They come from the collision elements of the description, with meshes cut into convex pieces. Without such
        elements they are capsules along the kinematics (`LinkShape.source` is `estimate`). The catalogue gives the
        radii of these capsules; otherwise they are 5 % of the arm's reach.
        """
        return self._collision.on(self.model)

    @property
    def collision_findings(self) -> tuple[Finding, ...]:
        """What there is to remark about the shapes, such as a mesh whose file is not there; they are read for it."""
        return self._collision.findings

    @cached_property
    def _collision(self) -> CollisionGeometry:
        travels = [joint.travel for joint in self.joints]
        return self.collision or CollisionGeometry(self.model, self.tip_frame, travels)

    @cached_property
    def collision_pairs(self) -> tuple[CollisionPair, ...]:
        """All pairs of links with shapes, and the reason for each pair that is not checked."""
        limits = self.limit("lower"), self.limit("upper")
        return collision_pairs(self.model, limits, self.collision_shapes, self.disabled_collisions)

    def with_tool(self, pose: Pose) -> Robot:
        """Attach a tool.

        Args:
            pose: The tool centre point in the tip frame; without a rotation, the tool's axes are the tip frame's.

        Returns:
            The same robot with that tool, in place of any other.
        """
        return replace(self, model=model_with_tool(self.model, self.tip_frame_id, as_pose(pose), TOOL_FRAME))

    def with_payload(self, payload: Payload) -> Robot:
        """Return the robot with a payload.

        Args:
            payload: The body carried, in the tip frame; of an arm that holds the workpiece, in the flange's.

        Returns:
            The same robot with this payload in addition to its own.
        """
        return replace(self, **fields_with_payload(self, self.payload_frame_id, payload))


def _text(document: str | Path) -> str:
    return document.read_text(encoding="utf-8") if isinstance(document, Path) else document
