"""Operations on trajectories of any origin: retime, stop, reverse, slice, join, resample."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from api.contract import trajectory_operations as schemas
from api.work.answers.plans import operation_as_dict
from api.work.conversion.given_trajectories import to_matrix, to_trajectory
from api.work.conversion.problems import (
    frames_in_world,
    mounted,
    to_backend,
    to_limits,
    to_payload,
    to_vector,
    with_tool,
)
from api.work.conversion.scenes import to_scene, to_speed_zones
from api.work.tasks.context import task
from api.work.tasks.remedies import acceptable_remedies
from api.work.tasks.trajectories import refuse_too_many_rows
from planner import operations
from planner.errors import InvalidProblem
from planner.operations import JointState, bounded_quantities, kept_clear, stop_joints, stop_on_path

if TYPE_CHECKING:
    from collections.abc import Callable

    from api.pool.messages import Reply
    from api.work.tasks.context import TaskContext
    from planner.operations import CertifiedTrajectory
    from planner.robots import Robot

DEFAULT_PERIOD = 0.01
"""The time between two rows of an answer that asks for neither a period nor times, s."""


POINTS_OF_POLYNOMIALS = 2000
"""The number of positions along polynomials that are timed."""


@task("reverse_trajectory")
def reverse_trajectory(context: TaskContext) -> Reply:
    """Answer POST /v1/trajectories/reverse."""

    def edit(request: Any, robot: Robot) -> CertifiedTrajectory:
        _, trajectory = to_trajectory(request.trajectory, robot, ("trajectory",))
        return operations.reverse_trajectory(robot, trajectory, **_kept(request))

    return _answer(context, schemas.ReverseRequest, edit)


@task("slice_trajectory")
def slice_trajectory(context: TaskContext) -> Reply:
    """Answer POST /v1/trajectories/slice."""

    def edit(request: Any, robot: Robot) -> CertifiedTrajectory:
        _, trajectory = to_trajectory(request.trajectory, robot, ("trajectory",))
        return operations.slice_trajectory(robot, trajectory, request.start, request.end, **_kept(request))

    return _answer(context, schemas.SliceRequest, edit)


@task("join_trajectories")
def join_trajectories(context: TaskContext) -> Reply:
    """Answer POST /v1/trajectories/join."""

    def edit(request: Any, robot: Robot) -> CertifiedTrajectory:
        trajectories = [
            to_trajectory(given, robot, ("trajectories", k))[1] for k, given in enumerate(request.trajectories)
        ]
        return operations.join_trajectories(robot, trajectories, tolerance=request.tolerance, **_kept(request))

    return _answer(context, schemas.JoinRequest, edit)


@task("max_payload")
def max_payload(context: TaskContext) -> Reply:
    """Answer POST /v1/trajectories/max_payload."""
    with context.stage("validate"):
        request = context.request(schemas.MaxPayloadRequest)
        robot = mounted(context.robot(request), request.mounting)
        robot = robot if request.carried is None else robot.with_payload(to_payload(request.carried))
        _, trajectory = to_trajectory(request.trajectory, robot, ("trajectory",))
    with context.stage("plan"):
        vectors = request.center_of_mass, request.center_of_mass_tolerance, request.inertia
        (x, y, z), (dx, dy, dz), (ixx, iyy, izz) = vectors
        found = operations.max_payload(
            robot,
            trajectory,
            center_of_mass=(x, y, z),
            center_of_mass_tolerance=(dx, dy, dz),
            inertia=(ixx, iyy, izz),
            inertia_tolerance=request.inertia_tolerance,
            limits=to_limits(request.limits),
        )
    return context.reply({"robot": request.robot, **vars(found)})


@task("retime_trajectory")
def retime_trajectory(context: TaskContext) -> Reply:
    """Answer POST /v1/trajectories/retime."""
    return _answer(context, schemas.RetimeRequest, _retime, is_kept_clear=True)


def _retime(request: schemas.RetimeRequest, robot: Robot) -> CertifiedTrajectory:
    """Put time on points, or on the positions of a trajectory."""
    if (request.points is None) == (request.trajectory is None):
        raise InvalidProblem([(("points",), "must be given, or a `trajectory`, but not both")])
    if request.points is not None:
        points = to_matrix(request.points, robot.dof, ("points",))
    elif request.trajectory is not None:
        interpolation, trajectory = to_trajectory(request.trajectory, robot, ("trajectory",))
        even = np.linspace(0.0, trajectory.duration, POINTS_OF_POLYNOMIALS)
        (points,) = trajectory.evaluate(even if interpolation == "polynomials" else trajectory.breakpoints, [0])
    backend, limits = to_backend(request.backend), to_limits(request.limits)
    return operations.retime_trajectory(
        robot, points, backend, max_deviation=request.max_deviation, limits=limits, **_surroundings(request, robot)
    )


@task("stop_trajectory")
def stop_trajectory(context: TaskContext) -> Reply:
    """Answer POST /v1/trajectories/stop."""
    return _answer(context, schemas.StopRequest, _stop)


def _stop(request: schemas.StopRequest, robot: Robot) -> CertifiedTrajectory:
    """Stop on the path of a trajectory, or joint by joint."""
    given, state, time = request.trajectory, request.state, request.time
    if (given is None) == (state is None):
        raise InvalidProblem([(("state",), "must be given, or a `trajectory` with a `time`, but not both")])
    if (given is None) != (time is None):
        raise InvalidProblem([(("time",), "must be given with a `trajectory`, and only then")])
    if given is not None and time is not None:
        _, trajectory = to_trajectory(given, robot, ("trajectory",))
        if request.mode != "joints":
            return stop_on_path(robot, trajectory, time, **_kept(request))
        if time > trajectory.duration:
            message = f"must be at most the duration of the trajectory, {trajectory.duration:g} s; got {time:g} s"
            raise InvalidProblem([(("time",), message)])
        kept = _kept(request)
        enforced = bounded_quantities([trajectory]) if request.enforced is None else request.enforced
        return stop_joints(robot, JointState(*trajectory.evaluate(time)), **kept | {"enforced": enforced})
    assert state is not None  # noqa: S101 - or there was a trajectory
    if request.mode == "on_path":
        raise InvalidProblem([(("trajectory",), "must be given for the mode `on_path`")])
    position, velocity = (
        to_vector(getattr(state, name), robot.dof, ("state", name)) for name in ("position", "velocity")
    )
    acceleration = np.zeros(robot.dof)
    if state.acceleration is not None:
        acceleration = to_vector(state.acceleration, robot.dof, ("state", "acceleration"))
    return stop_joints(robot, JointState(position, velocity, acceleration), **_kept(request))


@task("resample_trajectory")
def resample_trajectory(context: TaskContext) -> Reply:
    """Answer POST /v1/trajectories/resample."""
    with context.stage("validate"):
        request = context.request(schemas.ResampleRequest)
        robot = _robot(context, request)
        if request.period is not None and request.times is not None:
            raise InvalidProblem([(("period",), "must not be given beside `times`")])
        _, trajectory = to_trajectory(request.trajectory, robot, ("trajectory",))
        period = request.period or DEFAULT_PERIOD
        if request.times is None:
            refuse_too_many_rows(trajectory.duration, period, robot.dof, context, "/period")
    with context.stage("plan"):
        done = operations.resample_trajectory(robot, trajectory, request.times or period, **_kept(request))
        done = kept_clear(done, **_surroundings(request, robot))
        answer = operation_as_dict(done, done.time, request.include)
    return context.reply(answer)


def _answer(
    context: TaskContext, schema: Any, edit: Callable[[Any, Robot], CertifiedTrajectory], *, is_kept_clear: bool = False
) -> Reply:
    """Read the request, edit its trajectory, and write its answer every `sample_period`.

    Args:
        context: The context of the task.
        schema: That of the request.
        edit: The operation on a request and its robot.
        is_kept_clear: Whether the operation proves clearances and speeds itself.
    """
    with context.stage("validate"):
        request = context.request(schema)
        robot = _robot(context, request)
    with context.stage("plan"), acceptable_remedies(context, request, robot.dof):
        done = edit(request, robot)
        done = done if is_kept_clear else kept_clear(done, **_surroundings(request, robot))
        refuse_too_many_rows(done.trajectory.duration, request.sample_period, robot.dof, context)
        answer = operation_as_dict(done, done.trajectory.sample_times(request.sample_period), request.include)
    return context.reply(answer)


def _surroundings(request: schemas.OperationRequest, robot: Robot) -> dict[str, Any]:
    """Return the scene and the speed zones that the answer has to respect."""
    scene = None if request.scene is None else to_scene(request.scene, frames_in_world(robot, {}))
    zones = to_speed_zones(request.speed_zones)
    return {"scene": scene, "self_collision": request.self_collision, "speed_zones": zones}


def _robot(context: TaskContext, request: schemas.OperationRequest) -> Robot:
    """Return the robot of a request, with its tool, its mounting and its payload."""
    robot = mounted(with_tool(context.robot(request), request.tool), request.mounting)
    return robot if request.payload is None else robot.with_payload(to_payload(request.payload))


def _kept(request: schemas.EditRequest) -> dict[str, Any]:
    """Return the limits that the answer has to keep."""
    return {"limits": to_limits(request.limits), "enforced": request.enforced}
