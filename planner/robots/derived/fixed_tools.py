"""Fixed tools: the arm holds the workpiece, and the tool stands in the cell.

Seen from the workpiece, all joints in reverse are one serial chain to the tool, as the axes of a positioner are. So the
workpiece's frame is the base frame of all poses, and speeds of the tool are relative to it. The tip frame is the frame
in which arm and tool stand.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import pinocchio as pin

from planner.robots.collision.geometry import CollisionGeometry
from planner.robots.derived.changes import AnyRobot
from planner.robots.derived.external_axes import ExternalAxis, placement_of
from planner.robots.derived.positioners import WORKPIECE, refuse_own_names, reversed_model
from planner.robots.derived.standing import FOOT, foot_at_zero
from planner.robots.description import RobotDescription
from planner.robots.findings import Findings, shown
from planner.spatial import Pose


def with_fixed_tool(
    robot: AnyRobot,
    fixed_tool: Pose | None,
    workpiece: Pose | None,
    others: tuple[Pose | None, Sequence[ExternalAxis]],
    findings: Findings,
) -> AnyRobot:
    """Return the robot that holds the workpiece under a fixed tool; the caller attaches this tool to its tip frame.

    Args:
        robot: The arm.
        fixed_tool: The tool centre point in the arm's base frame; None: the robot stays as it is.
        workpiece: Pose of the workpiece's frame in the tip frame; None: the same.
        others: The tool and the axes of the positioner, which a robot with a fixed tool cannot have.
        findings: The findings, which are added to.

    Raises:
        InvalidRobotModel: The robot cannot hold the workpiece.
    """
    if fixed_tool is None:
        return robot
    _refuse_others(robot, *others, findings)
    findings.raise_errors()
    placement_of("fixed_tool", fixed_tool, findings)
    at = placement_of(WORKPIECE, workpiece, findings)
    refuse_own_names(robot, (), findings)
    findings.raise_errors()
    tip = robot.model.frames[robot.model.getFrameId(robot.tip_frame, pin.FrameType.BODY)]
    shapes = CollisionGeometry(robot.model, robot.tip_frame, [joint.travel for joint in robot.joints])
    holding = replace(
        robot,
        model=reversed_model(robot.model, tip.placement * at),
        joints=robot.joints[::-1],
        tip_frame=FOOT,
        payload_frame=robot.tip_frame,
        positioner=tuple(joint.name for joint in reversed(robot.joints)),
        named_positions={name: position[::-1] for name, position in robot.named_positions.items()},
        collision=robot.collision or shapes,
    )
    holding.model.gravity.linear = foot_at_zero(holding).rotation @ robot.model.gravity.linear
    return holding


def _refuse_others(
    robot: RobotDescription, tool: Pose | None, positioner: Sequence[ExternalAxis], findings: Findings
) -> None:
    """Refuse axes, tools and mimic joints, which a robot with a fixed tool cannot have."""
    name = shown(robot.id)
    if robot.positioner:
        text = f"{name} has a workpiece that moves already: derive it from the arm alone, with the `fixed_tool`"
        findings.error("second_positioner", None, text)
    elif robot.external_axes or positioner:
        axes = ", ".join(robot.external_axes or [shown(axis.name) for axis in positioner])
        text = f"an arm with a `fixed_tool` cannot have external axes; fix {axes} with `locked`, or leave them out"
        findings.error("axes_with_fixed_tool", None, text)
    if tool is not None:
        text = "the arm holds the workpiece: `workpiece` is its pose in the tip frame; leave `tool` out"
        findings.error("tool_with_fixed_tool", "tool", text)
    if robot.followers:
        follower = robot.followers[0]
        text = f"{shown(follower.name)} follows {shown(follower.leader)}, which is not supported with a `fixed_tool`"
        findings.error("mimic_joint_with_fixed_tool", shown(follower.name), text)
