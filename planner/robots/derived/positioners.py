"""Positioners: external axes that carry the workpiece, while the base of the arm stands still.

Seen from the workpiece, the axes in reverse and the arm are one serial chain. So the workpiece's frame is the base
frame of all poses, and speeds of the tool are relative to it. A joint of the model turns about the z axis of its frame,
or slides along it. With a half turn F about x, the inverse of an axis's motion is F Rz(q) F: positions keep the sign of
the axis.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import pinocchio as pin

from planner.robots.build import MovingJoint, build_model
from planner.robots.derived.changes import FREE_FALL, AnyRobot
from planner.robots.derived.external_axes import ExternalAxis, append_arm, external_chain, placement_of
from planner.robots.derived.standing import FLIP, FOOT, foot_at_zero
from planner.robots.description import RobotDescription
from planner.robots.findings import Findings, shown
from planner.spatial import FloatArray, Pose

WORKPIECE = "workpiece"
"""Name of the link that a positioner carries: the base frame of a robot with a positioner."""


def with_positioner(
    robot: AnyRobot, axes: Sequence[ExternalAxis], workpiece: Pose | None, findings: Findings
) -> AnyRobot:
    """Return the robot with a positioner beside it, whose workpiece is its base frame.

    Args:
        robot: The arm, perhaps on external axes.
        axes: From the arm's base frame to the workpiece; none: the robot stays as it is.
        workpiece: Pose of the workpiece's frame in the link of the last axis; None: the same.
        findings: The findings, which are added to.

    Raises:
        InvalidRobotModel: An axis cannot be used, or the robot cannot have a positioner.
    """
    if not axes:
        if workpiece is not None:
            text = "the workpiece has a pose, but there is neither a `positioner` nor a `fixed_tool`"
            findings.error("no_positioner", None, text)
        return robot
    if robot.positioner:
        findings.error(
            "second_positioner", None, f"{shown(robot.id)} has a workpiece that moves already, by {robot.positioner}"
        )
        findings.raise_errors()
    at = placement_of(WORKPIECE, workpiece, findings)
    refuse_own_names(robot, {axis.name for axis in axes}, findings)
    joints, chain = external_chain(axes, robot.model, findings)
    findings.raise_errors()
    there = tuple(min(max(0.0, joint.lower), joint.upper) for joint in reversed(joints))
    beside = replace(
        robot,
        model=_model_beside(robot.model, chain, at),
        joints=(*reversed(joints), *robot.joints),
        external_axes=(*(joint.name for joint in reversed(joints)), *robot.external_axes),
        positioner=tuple(joint.name for joint in reversed(joints)),
        named_positions={name: (*there, *position) for name, position in robot.named_positions.items()},
    )
    beside.model.gravity.linear = foot_at_zero(beside).rotation @ robot.model.gravity.linear
    return beside


def refuse_own_names(robot: RobotDescription, others: Collection[str], findings: Findings) -> None:
    """Refuse links, and axes with the names `others`, that have the name of the workpiece or of the foot."""
    taken = {frame.name for frame in robot.model.frames.tolist()[1:]} | {*others}
    for name in sorted(taken & {WORKPIECE, FOOT}):
        text = f"no link or axis can be called {shown(name)}: a moving workpiece and its foot have these names"
        findings.error("duplicate_name", shown(name), text)


def _model_beside(model: pin.Model, chain: Sequence[MovingJoint], workpiece: pin.SE3) -> pin.Model:
    """Return the model of an arm and a positioner, from the workpiece on.

    Args:
        model: The arm.
        chain: The axes of the positioner, from the arm's base to the workpiece.
        workpiece: Placement of the workpiece in the link of the last axis.
    """
    whole = reversed_model(build_model(model.name, [], chain), chain[-1].links[0].placement * workpiece)
    append_arm(whole, model, whole.frames[whole.getFrameId(FOOT, pin.FrameType.BODY)].placement, moves_base=False)
    return whole


def reversed_model(model: pin.Model, workpiece: pin.SE3) -> pin.Model:
    """Return a serial chain seen from a workpiece at its end; the last frame, `FOOT`, is its base.

    Args:
        model: The chain, as `build_model` makes it.
        workpiece: Placement of the workpiece in the frame of the last joint.
    """
    whole, parent, placement = pin.Model(), 0, workpiece.inverse()
    whole.name = model.name
    whole.addFrame(pin.Frame(WORKPIECE, 0, 0, pin.SE3.Identity(), pin.FrameType.BODY), False)
    for number in reversed(range(model.njoints)):  # `placement` is that of the joint's frame
        whole.appendBodyToJoint(parent, model.inertias[number], placement)
        for frame in model.frames.tolist()[1:]:
            if frame.parentJoint == number and frame.type == pin.FrameType.BODY:
                there = placement * frame.placement
                whole.addFrame(pin.Frame(frame.name, parent, 0, there, frame.type, frame.inertia), False)
        if number:
            parent = whole.addJoint(parent, model.joints[number], placement * FLIP, model.names[number])
            placement = FLIP * model.jointPlacements[number].inverse()
    whole.addFrame(pin.Frame(FOOT, parent, 0, placement, pin.FrameType.BODY), False)
    return whole


def refuse_positioner(robot: RobotDescription, axes: Sequence[ExternalAxis], findings: Findings) -> None:
    """Refuse external axes in front of a robot that has a positioner: they would carry the workpiece."""
    if robot.positioner and axes:
        what = "a fixed tool" if robot.holds_workpiece else "a positioner"
        text = f"{shown(robot.id)} has {what}: derive it from the arm on its `external_axes`"
        findings.error("axes_with_positioner", None, text)
        findings.raise_errors()


def mounted_model(robot: RobotDescription, mounting: FloatArray) -> pin.Model:
    """Return the model whose frame that stands still has a rotation (3, 3) in the world: gravity follows."""
    model = robot.model.copy()
    model.gravity.linear = foot_at_zero(robot).rotation @ (mounting.T @ FREE_FALL)
    return model
