"""Dynamics: the torques of states of motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from api.base.errors import invalid
from api.contract import dynamics as schemas
from api.work.conversion.given_trajectories import to_matrix
from api.work.conversion.problems import to_payload, with_process_force, with_tool
from api.work.tasks.context import task
from planner import dynamics

if TYPE_CHECKING:
    from api.pool.messages import Reply
    from api.work.tasks.context import TaskContext


@task("inverse_dynamics")
def inverse_dynamics(context: TaskContext) -> Reply:
    """Answer POST /v1/dynamics/inverse."""
    with context.stage("validate"):
        request = context.request(schemas.InverseDynamicsRequest)
        robot = context.robot(request)
        if request.payload is not None:
            robot = robot.with_payload(to_payload(request.payload))
        robot = with_process_force(with_tool(robot, request.tool), request.process_force)
        positions = to_matrix(request.positions, robot.dof, ("positions",))
        velocities, accelerations = (
            np.zeros_like(positions) if rows is None else to_matrix(rows, robot.dof, (name,))
            for name, rows in (("velocities", request.velocities), ("accelerations", request.accelerations))
        )
        faults = [
            {
                "pointer": f"/{name}",
                "message": f"must have one row for each of the {len(positions)} positions; got {len(rows)}",
            }
            for name, rows in (("velocities", velocities), ("accelerations", accelerations))
            if len(rows) != len(positions)
        ]
        if faults:
            raise invalid(faults)
    with context.stage("plan"):
        torques = dynamics.inverse_dynamics(robot, positions, velocities, accelerations)
    return context.reply({"torques": torques})
