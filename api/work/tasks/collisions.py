"""Collisions: the clearance of joint positions, or of a trajectory of any origin, from a scene and the robot itself."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from api.base.errors import invalid_at
from api.contract import collisions as schemas
from api.work.answers.clearances import clearance_answer, speed_zones_answer
from api.work.conversion.given_trajectories import to_matrix, to_trajectory
from api.work.conversion.problems import frames_in_world, mounted, with_tool
from api.work.conversion.scenes import refuse_motions, to_scene, to_speed_zones
from api.work.tasks.context import task
from planner.certificate import at_rest, refuse_zone_faults
from planner.scene import CollisionChecker

if TYPE_CHECKING:
    from api.pool.messages import Reply
    from api.work.tasks.context import TaskContext


@task("check_collisions")
def check_collisions(context: TaskContext) -> Reply:
    """Answer POST /v1/collisions/check."""
    with context.stage("validate"):
        request = context.request(schemas.CollisionCheckRequest)
        robot = mounted(with_tool(context.robot(request), request.tool), request.mounting)
        has_trajectory = request.samples is not None or request.polynomials is not None
        if (request.positions is None) != has_trajectory:
            raise invalid_at("", "The body must have either `positions`, or `samples` or `polynomials`.")
        if request.positions is None:
            motions = [to_trajectory(request, robot)[1]]
        else:
            motions = [at_rest(q) for q in np.atleast_2d(to_matrix(request.positions, robot.dof, ("positions",)))]
        if request.speed_zones and not has_trajectory:
            raise invalid_at("/speed_zones", "must be given only with a trajectory: `positions` do not move")
        scene = None if request.scene is None else to_scene(request.scene, frames_in_world(robot, request.frames))
        if not has_trajectory:
            refuse_motions(scene)
        zones = to_speed_zones(request.speed_zones)
        refuse_zone_faults(scene, zones)
        checker = CollisionChecker(robot, scene, self_collision=request.self_collision)
    with context.stage("plan"):
        results = [clearance_answer(checker, motion, request.tolerance) for motion in motions]
        if zones:
            results[0]["speed_zones"] = speed_zones_answer(zones, checker, robot, motions[0])
    return context.reply({"free": all(result["free"] for result in results), "results": results})
