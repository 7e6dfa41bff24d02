"""Collisions: how near postures, or a trajectory of any origin, come to a scene and to themselves."""

from __future__ import annotations

from typing import TYPE_CHECKING

from api.errors import invalid
from api.schemas import collisions as schemas
from api.tasks.operation import BODY_CODES, Operation

if TYPE_CHECKING:
    from api.pool.messages import Reply
    from api.tasks.work import Work


def check_collisions(work: Work) -> Reply:
    """Answer POST /v1/collisions/check."""
    import numpy as np

    from api.answers.clearances import clearance_answer, speed_zones_answer
    from api.conversion.given_trajectories import to_trajectory
    from api.conversion.problems import frames_in_world, mounted, to_matrix, with_tool
    from api.conversion.scenes import to_scene, to_speed_zones
    from planner.certificate.clearance import at_rest
    from planner.scene import CollisionChecker
    from planner.speed_zones import refuse_zone_faults

    with work.stage("validate"):
        request = work.request(schemas.CollisionCheckRequest)
        robot = mounted(with_tool(work.robot(request), request.tool), request.mounting)
        has_trajectory = request.samples is not None or request.polynomials is not None
        if (request.positions is None) != has_trajectory:
            raise invalid([{"pointer": "", "message": "either positions are needed, or samples or polynomials"}])
        if request.positions is None:
            motions = [to_trajectory(request, robot)[1]]
        else:
            motions = [at_rest(q) for q in np.atleast_2d(to_matrix(request.positions, robot.dof, ("positions",)))]
        if request.speed_zones and not has_trajectory:
            raise invalid([{"pointer": "/speed_zones", "message": "positions do not move: a trajectory is needed"}])
        scene = None if request.scene is None else to_scene(request.scene, frames_in_world(robot, request.frames))
        zones = to_speed_zones(request.speed_zones)
        refuse_zone_faults(scene, zones)
        checker = CollisionChecker(robot, scene, self_collision=request.self_collision)
    with work.stage("plan"):
        results = [clearance_answer(checker, motion, request.tolerance) for motion in motions]
        if zones:
            results[0]["speed_zones"] = speed_zones_answer(zones, checker, robot, motions[0])
    return work.reply({"free": all(result["free"] for result in results), "results": results})


TABLE = {
    "id": "table",
    "shape": {"kind": "box", "size": [1.0, 2.0, 0.05]},
    "pose": {"position": [1.3, 0.0, 0.3]},
}
"""A thing that stands in the examples."""

OPERATIONS = (
    Operation(
        id="check_collisions",
        method="POST",
        path="/v1/collisions/check",
        tag="collisions",
        summary="Prove that postures, or a trajectory of any origin, keep clear.",
        description="Postures are looked at one by one; a trajectory, as samples with the interpolation that the "
        "controller runs or as polynomials, at all times. Each is `free`, with its clearance for certain, or the pair "
        "that is too near is named. `speed_zones` say when a trajectory is near to objects, and how fast it is there.",
        run=check_collisions,
        request=schemas.CollisionCheckRequest,
        answer=schemas.CollisionCheckAnswer,
        shared=True,
        codes=(*BODY_CODES, "unknown_robot", "unknown_scene"),
        examples={
            "two_postures": {
                "robot": "kuka_kr16_2",
                "scene": {"objects": [TABLE], "margin": 0.02},
                "positions": [[0.0, -1.5, 1.5, 0.0, 0.5, 0.0], [0.0, -0.2, 0.9, 0.0, 0.9, 0.0]],
            },
            "samples": {
                "robot": "kuka_kr16_2",
                "scene": {"objects": [TABLE], "margin": 0.02},
                "samples": {
                    "time": [0.0, 1.0],
                    "position": [[0.0, -1.5, 1.5, 0.0, 0.5, 0.0], [0.4, -1.2, 1.2, 0.0, 0.5, 0.0]],
                },
            },
            "too_fast_near_the_table": {
                "robot": "kuka_kr16_2",
                "scene": {"objects": [TABLE]},
                "speed_zones": [{"clearance": 0.5, "speed": 0.1, "objects": ["table"]}],
                "samples": {
                    "time": [0.0, 1.0, 3.0],
                    "position": [
                        [0.0, -1.5, 1.5, 0.0, 0.5, 0.0],
                        [0.0, -1.0, 1.2, 0.0, 0.5, 0.0],
                        [0.0, -0.8, 1.2, 0.0, 0.5, 0.0],
                    ],
                },
            },
        },
    ),
)
"""What there is about collisions."""
