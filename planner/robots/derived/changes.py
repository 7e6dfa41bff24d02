"""Changes of the joints of a robot: some are fixed, others are put in front of its base."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from planner.robots.build import model_with_follower, model_with_locked
from planner.robots.derived.external_axes import ExternalAxis, external_chain, model_on_axes, placement_of
from planner.robots.derived.standing import keep_standing
from planner.robots.description import RobotDescription
from planner.robots.findings import Findings, note_held_mimic, shown
from planner.spatial import FloatArray, Pose

AnyRobot = TypeVar("AnyRobot", bound=RobotDescription)

FREE_FALL: FloatArray = np.array([0.0, 0.0, -9.81])
"""The acceleration of free fall in the world, whose z axis points up, m/s^2: Pinocchio's own."""

SAME_DIRECTION = 1e-6
"""Largest difference of an acceleration, m/s^2, from that of free fall along -z up to which they are the same."""


def held_by_group(robot: RobotDescription, group: str | None, findings: Findings) -> dict[str, float]:
    """Return positions of the joints outside a group: 0 or the nearest limit; none without a group."""
    if group is None:
        return {}
    members = {kept.name: kept.joints for kept in robot.groups}.get(group)
    if members is None:
        names = ", ".join(shown(kept.name) for kept in robot.groups) or "none"
        findings.error("unknown_group", shown(group), f"there is no group {shown(group)}; there is {names}")
        findings.raise_errors()
    held = (joint for joint in robot.joints if joint.name not in (*(members or ()), *robot.external_axes))
    return {joint.name: min(max(0.0, joint.lower), joint.upper) for joint in held}


def with_locked(robot: AnyRobot, locked: Mapping[str, float], findings: Findings) -> AnyRobot:
    """Return the robot whose other joints are left, those held at positions within their limits.

    Raises:
        InvalidRobotModel: There is no such joint or position, or no joint would be left.
    """
    names = [joint.name for joint in robot.joints]
    for name, position in locked.items():
        if name not in names:
            known = ", ".join(map(shown, names))
            findings.error("unknown_joint", shown(name), f"there is no joint {shown(name)}; the joints are {known}")
            continue
        joint = robot.joints[names.index(name)]
        if not (joint.lower <= position <= joint.upper and np.isfinite(position)):
            text = f"{shown(name)} cannot be held at {position:g}, outside of its position limits"
            findings.error("outside_position_limits", shown(name), text)
    if len(locked) >= len(names):
        findings.error("no_joints", None, "no joint is left that moves")
    findings.raise_errors()
    if not locked:
        return robot
    left = [k for k, name in enumerate(names) if name not in locked]
    positions = {name: tuple(position[k] for k in left) for name, position in robot.named_positions.items()}
    model = model_with_locked(robot.model, locked)
    changed: dict[str, Any] = keep_standing(robot, model, locked)
    return replace(
        robot,
        model=model,
        joints=tuple(robot.joints[k] for k in left),
        named_positions=positions,
        external_axes=tuple(name for name in robot.external_axes if name not in locked),
        **changed,
    )


def with_followers(robot: AnyRobot, locked: Mapping[str, float], findings: Findings) -> AnyRobot:
    """Return the robot whose mimic joints stand where joints that are to be locked bring them."""
    model = robot.model
    for follower in robot.followers:
        if follower.leader in locked:
            position = locked[follower.leader]
            model = model_with_follower(model, follower, position, robot.tip_frame)
            there = follower.multiplier * position + follower.offset
            note_held_mimic(findings, follower.name, follower.leader, there)
    left = tuple(follower for follower in robot.followers if follower.leader not in locked)
    return replace(robot, model=model, followers=left)


def on_external_axes(
    robot: AnyRobot,
    axes: Sequence[ExternalAxis],
    arm_origin: Pose | None,
    mounting: Pose | None,
    findings: Findings,
) -> AnyRobot:
    """Return the robot with external axes in front of its base, in whose place theirs is mounted in the world.

    Args:
        robot: The arm.
        axes: From the base to the arm; none: the robot stays as it is.
        arm_origin: Pose of the arm's base in the link of the last axis; None: the same.
        mounting: Pose in the world of the base that the axes stand on; None: it stands upright.
        findings: The findings, which are added to.

    Raises:
        InvalidRobotModel: An axis cannot be used, or it is not said how the base is mounted.
    """
    if not axes:
        if arm_origin is not None:
            text = "the arm has an origin in the link of an external axis, but there is no external axis"
            findings.error("no_external_axes", None, text)
        return robot
    if robot.mounting is not None and mounting is None:
        text = f"{shown(robot.id)} has a mounting of its own: give that of the base that the external axes stand on"
        findings.error("mounting_missing", "mounting", text)
    elif mounting is None and np.abs(robot.model.gravity.linear - FREE_FALL).max() > SAME_DIRECTION:
        text = "the base of the external axes is taken to stand upright; the arm's own base frame did not"
        findings.warning("gravity_changed", None, text)
    origin = placement_of(robot.id, arm_origin, findings)
    joints, chain = external_chain(axes, robot.model, findings)
    findings.raise_errors()
    if not any(inertia.mass > 0.0 for inertia in robot.model.inertias.tolist()):
        text = f"nothing of {shown(robot.id)} has a mass: torques are those of its external axes and payloads alone"
        findings.warning("mass_missing", None, text)
    there = tuple(min(max(0.0, joint.lower), joint.upper) for joint in joints)
    model = model_on_axes(robot.model, chain, origin)
    return replace(
        robot,
        model=model,
        mounting=None,
        joints=(*joints, *robot.joints),
        external_axes=(*(joint.name for joint in joints), *robot.external_axes),
        named_positions={name: (*there, *position) for name, position in robot.named_positions.items()},
    )
