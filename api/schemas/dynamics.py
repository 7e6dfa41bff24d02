"""Bodies and answers of the dynamics endpoints."""

from __future__ import annotations

from api.schemas.common import DEFAULT_DEADLINE, Answer, Deadline, Payload, RobotId, Schema
from api.schemas.requests import Rows  # noqa: TC001 - pydantic evaluates the annotations


class InverseDynamicsRequest(Schema):
    """States of motion whose torques are asked; one row a state."""

    robot: RobotId
    """An id of GET /v1/robots."""
    payload: Payload | None = None
    """What the robot carries; omitted: nothing."""
    positions: Rows
    """rad or m."""
    velocities: Rows | None = None
    """rad/s or m/s; omitted: zero."""
    accelerations: Rows | None = None
    """rad/s^2 or m/s^2; omitted: zero."""
    deadline: Deadline = DEFAULT_DEADLINE
    """s, after which the service gives up."""


class InverseDynamicsAnswer(Answer):
    """Torques, one row a state."""

    torques: list[list[float]]
    """N m, or N of prismatic joints; gravity and payload included."""
