"""Every operation of the service, in the order of the documentation."""

from __future__ import annotations

from typing import TYPE_CHECKING

from api.tasks import (
    batch_reports,
    batches,
    collisions,
    dynamics,
    kinematics,
    robots,
    scenes,
    service,
    trajectories,
    trajectory_operations,
)

if TYPE_CHECKING:
    from api.tasks.operation import Operation

OPERATIONS: tuple[Operation, ...] = (
    *trajectories.OPERATIONS,
    *trajectory_operations.OPERATIONS,
    *batches.OPERATIONS,
    *batch_reports.OPERATIONS,
    *robots.OPERATIONS,
    *scenes.OPERATIONS,
    *collisions.OPERATIONS,
    *kinematics.OPERATIONS,
    *dynamics.OPERATIONS,
    *service.OPERATIONS,
)
"""The routes, the OpenAPI document and the worker's table are made from these."""
