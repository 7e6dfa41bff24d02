"""Bodies and answers of the dynamics endpoints."""

from __future__ import annotations

from api.contract.parts.common import (
    DEFAULT_DEADLINE,
    Answer,
    Deadline,
    NamedRobot,
    Payload,
    Pose,
    ProcessForce,
    Schema,
)
from api.contract.requests import Rows  # noqa: TC001 - pydantic evaluates the annotations


class InverseDynamicsRequest(Schema):
    """States of motion whose torques are requested."""

    robot: NamedRobot
    payload: Payload | None = None
    """The body that the robot carries; omitted: none."""
    tool: Pose | None = None
    """The tool centre point in the tip frame (m), where `process_force` acts; omitted: the robot's own."""
    process_force: ProcessForce | None = None
    """The force that the tool exerts in every state; omitted: none. Its `frame` is `tool`, `base` or `world`."""
    positions: Rows
    """The joint positions, shape (states, joints), rad or m."""
    velocities: Rows | None = None
    """The joint velocities, shape (states, joints), rad/s or m/s; omitted: zero."""
    accelerations: Rows | None = None
    """The joint accelerations, shape (states, joints), rad/s^2 or m/s^2; omitted: zero."""
    deadline: Deadline = DEFAULT_DEADLINE


class InverseDynamicsAnswer(Answer):
    """The torques of the requested states."""

    torques: list[list[float]]
    """The torques, shape (states, joints), N m, or N of prismatic joints; gravity, payload and process
    force are included."""
