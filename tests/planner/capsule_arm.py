"""A KR 16-2 whose links are capsules, so that closed forms tell their distances."""

from __future__ import annotations

from dataclasses import replace

from planner import Robot, load_robot

LINK_RADII = (0.22, 0.19, 0.14, 0.14, 0.08, 0.08, 0.055)


def capsule_arm() -> Robot:
    """Return the arm of the catalogue with capsules along its kinematics in place of its outline."""
    robot = load_robot("kuka_kr16_2")
    assert robot.collision is not None
    return replace(robot, collision=replace(robot.collision, elements=(), link_radii=LINK_RADII))


CAPSULE_ARM = capsule_arm()


def arm_of_capsules(id: str) -> Robot:
    """Return an arm of the catalogue, the KR 16-2 with capsules."""
    return CAPSULE_ARM if id == CAPSULE_ARM.id else load_robot(id)
