"""Kinematics: forward, inverse, reachability, Jacobian and workspace."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from api.base.errors import invalid_at
from api.contract import kinematics as schemas
from api.pool.messages import Reply
from api.work.answers.kinematics import all_answer, best_answer, reachability_answer
from api.work.answers.negotiation import MediaType, negotiated
from api.work.answers.values import pose_answer
from api.work.conversion.given_trajectories import to_matrix
from api.work.conversion.poses import to_pose
from api.work.conversion.problems import (
    frames_in_world,
    mounted,
    to_options,
    to_vector,
    to_waypoints,
    with_tool,
)
from api.work.conversion.scenes import to_scene
from api.work.tasks.context import task
from planner import kinematics
from planner.kinematics import (
    free_first,
    inverse_kinematics_many,
    manipulability,
    singular_values,
    solutions_or_failure,
    with_whole_turns,
)
from planner.kinematics.options import InverseKinematicsOptions
from planner.scene import checker_at_waypoints, is_free
from planner.waypoints.reachability import reachability as check_reachability

if TYPE_CHECKING:
    from api.work.tasks.context import TaskContext

FORMS_OF_WORKSPACE = {
    "json": MediaType("application/json"),
    "svg": MediaType("image/svg+xml"),
    "png": MediaType("image/png"),
}
"""The forms of a workspace, by the names that `?format=` has for them."""

MOST_SOLUTIONS = 64
"""The most solutions of one pose in an answer; a robot with six joints has 16 at most, whole turns aside."""


@task("forward_kinematics")
def forward_kinematics(context: TaskContext) -> Reply:
    """Answer POST /v1/kinematics/forward."""
    with context.stage("validate"):
        request = context.request(schemas.ForwardKinematicsRequest)
        robot = with_tool(context.robot(request), request.tool)
        positions = to_matrix(request.positions, robot.dof, ("positions",))
    with context.stage("plan"):
        answer: dict[str, Any] = {"poses": list(map(pose_answer, kinematics.forward_kinematics(robot, positions)))}
        if "links" in request.include:
            found = (kinematics.frame_poses(robot, position).items() for position in positions)
            answer["links"] = [[{"link": name} | pose_answer(pose) for name, pose in links] for links in found]
    return context.reply(answer)


@task("inverse_kinematics")
def inverse_kinematics(context: TaskContext) -> Reply:
    """Answer POST /v1/kinematics/inverse."""
    with context.stage("validate"):
        request = context.request(schemas.InverseKinematicsRequest)
        robot = mounted(with_tool(context.robot(request), request.tool), request.mounting)
        scene = None if request.scene is None else to_scene(request.scene, frames_in_world(robot, request.frames))
        checker = checker_at_waypoints(robot, scene, request.self_collision, ())
        free = None if checker is None else partial(is_free, checker)
        reference = None
        if request.reference is not None:
            reference = to_vector(request.reference, robot.dof, ("reference",))
        options = InverseKinematicsOptions(request.tolerance_position, request.tolerance_orientation, seed=request.seed)
    with context.stage("plan"):
        poses = [to_pose(asked) for asked in request.poses]
        if request.solutions == "best":
            found_in_turn = inverse_kinematics_many(robot, poses, options, reference, free)
            results = [best_answer(best, checker) for best in found_in_turn]
        else:
            near = robot.middle if reference is None else reference
            results = []
            for pose in poses:
                found = solutions_or_failure(robot, pose, options, near, free)
                if isinstance(found, tuple):
                    found = with_whole_turns(robot, found, near, MOST_SOLUTIONS)
                    found = found if free is None else free_first(found, free)
                results.append(all_answer(robot, pose, found, checker))
    return context.reply({"results": results})


@task("reachability")
def reachability(context: TaskContext) -> Reply:
    """Answer POST /v1/kinematics/reachability."""
    with context.stage("validate"):
        request = context.request(schemas.ReachabilityRequest)
        robot = mounted(with_tool(context.robot(request), request.tool), request.mounting)
        waypoints = to_waypoints(request.waypoints, robot, request.frames)
        options = to_options(request.ik, request.seed)
        scene = None if request.scene is None else to_scene(request.scene, frames_in_world(robot, request.frames))
    with context.stage("plan"):
        found = check_reachability(robot, waypoints, options, scene=scene, self_collision=request.self_collision)
    return context.reply(reachability_answer(waypoints, found))


@task("jacobian")
def jacobian(context: TaskContext) -> Reply:
    """Answer POST /v1/kinematics/jacobian."""
    with context.stage("validate"):
        request = context.request(schemas.JacobianRequest)
        robot = with_tool(context.robot(request), request.tool)
        position = to_vector(request.position, robot.dof, ("position",))
    with context.stage("plan"):
        answer = {
            "jacobian": kinematics.jacobian(robot, position),
            "manipulability": manipulability(robot, position[None])[0],
            "singular_values": singular_values(robot, position[None])[0],
        }
    return context.reply(answer)


@task("workspace")
def workspace(context: TaskContext) -> Reply:
    """Answer POST /v1/kinematics/workspace."""
    form = negotiated(context.arguments["format"], context.arguments["accept"], FORMS_OF_WORKSPACE)

    with context.stage("validate"):
        request = context.request(schemas.WorkspaceRequest)
        if 3 * request.samples > context.caps.max_samples:
            limit = f"must be at most {context.caps.max_samples // 3}; got {request.samples}"
            raise invalid_at("/samples", limit)
        robot = with_tool(context.robot(request), request.tool)
    with context.stage("plan"):
        found = kinematics.workspace(robot, request.samples, request.seed)
    if form is FORMS_OF_WORKSPACE["json"]:
        return context.reply(found)
    from planner.plots.picture import draw_workspace

    with context.stage("serialise"):
        picture = draw_workspace(robot, found, view=request.view)
        body = picture.svg() if form is FORMS_OF_WORKSPACE["svg"] else picture.png()
    return Reply(200, form.media_type, body, context.timings)
