"""From the schemas of robots to the library's robots."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from api.contract import robots
from api.work.conversion.curves import to_payload_table, to_torque_curve, to_velocity_curves, with_curves
from api.work.conversion.kept_meshes import kept_pieces
from api.work.conversion.poses import to_pose, with_tuples
from planner.robots import DHJoint, ExternalAxis, Robot, load_robot
from planner.robots.collision import kept_meshes

if TYPE_CHECKING:
    from collections.abc import Mapping

    from api.contract.parts import joints, payload_table


def to_robot(definition: robots.RobotModel | robots.UrdfRobot, robot_id: str) -> Robot:
    """Make the robot that a client describes; the meshes of one that is not added yet are not read.

    Raises:
        InvalidRobotModel: It cannot be used.
    """
    match definition:
        case robots.UrdfDocument():
            kept = definition.meshes if isinstance(definition, robots.UrdfModel) else []
            read = Robot.from_urdf(
                definition.urdf,
                srdf=definition.srdf,
                tip_frame=definition.tip_frame,
                base_frame=definition.base_frame,
                group=definition.group,
                joints=definition.joints,
                locked=definition.locked,
                meshes=kept_meshes(kept_pieces(kept)),
                id=robot_id,
                source="uploaded URDF",
            )
            limits: dict[str, Any] = {}
            for name, curves in definition.velocity_curves.items():
                limits[name] = {"velocity_curves": to_velocity_curves(curves)}
            for name, curve in definition.torque_curves.items():
                limits[name] = {**limits.get(name, {}), "torque_curve": to_torque_curve(curve)}
            return _with_own(read, limits, definition.payload_table)
        case robots.DhModel():
            read = Robot.from_dh(
                [DHJoint(**with_curves(with_tuples(joint.model_dump()), joint)) for joint in definition.joints],
                convention=definition.convention,
                base=None if definition.base is None else to_pose(definition.base),
                tip=None if definition.tip is None else to_pose(definition.tip),
                id=robot_id,
                source="uploaded Denavit-Hartenberg table",
            )
            return _with_own(read, {}, definition.payload_table)
        case robots.DerivedModel():
            return _to_derived_robot(definition, robot_id)


def _with_own(read: Robot, limits: Mapping[str, Any], table: payload_table.PayloadTable | None) -> Robot:
    """Return a robot with limits of joints and a payload table that its document cannot have."""
    if not limits and table is None:
        return read
    limited = read.derived(limits=limits, payload_table=to_payload_table(table))
    return replace(limited, findings=(*read.findings, *limited.findings))


def _to_derived_robot(model: robots.DerivedModel, robot_id: str) -> Robot:
    """Make the robot that a client derives from another.

    Raises:
        InvalidRobotModel: The request contradicts the other robot.
        UnknownRobot: There is no other robot.
    """
    base = load_robot(model.base or "") if model.definition is None else to_robot(model.definition, "an added robot")
    robot = base.derived(
        id=robot_id,
        limits={name: with_curves(own.model_dump(exclude_none=True), own) for name, own in model.limits.items()},
        group=model.group,
        locked=model.locked,
        tool=None if model.tool is None else to_pose(model.tool),
        mounting=None if model.mounting is None else to_pose(model.mounting),
        named_positions=model.named_positions,
        external_axes=[_to_external_axis(axis) for axis in model.external_axes],
        arm_origin=None if model.arm_origin is None else to_pose(model.arm_origin),
        positioner=[_to_external_axis(axis) for axis in model.positioner],
        workpiece=None if model.workpiece is None else to_pose(model.workpiece),
        payload_table=to_payload_table(model.payload_table),
        fixed_tool=None if model.fixed_tool is None else to_pose(model.fixed_tool),
    )
    return replace(robot, source=f"derived from {base.id}: {base.source}")


def _to_external_axis(axis: joints.ExternalAxis) -> ExternalAxis:
    """Make an external axis."""
    return ExternalAxis(**axis.model_dump() | {"origin": None if axis.origin is None else to_pose(axis.origin)})
