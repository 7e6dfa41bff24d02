"""Operations on trajectories of any origin: retime, stop, reverse, slice, join, resample."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from api.schemas import trajectory_operations as schemas
from api.tasks.operation import BODY_CODES, Operation
from api.tasks.remedies import acceptable_remedies
from api.tasks.trajectories import refuse_too_many_rows

if TYPE_CHECKING:
    from collections.abc import Callable

    from api.pool.messages import Reply
    from api.tasks.work import Work
    from planner.operations import CertifiedTrajectory
    from planner.robots import Robot

DEFAULT_PERIOD = 0.01
"""The time between two rows of an answer that asks for neither a period nor times, s."""


POINTS_OF_POLYNOMIALS = 2000
"""The number of positions along polynomials that are timed."""


def reverse_trajectory(work: Work) -> Reply:
    """Answer POST /v1/trajectories/reverse."""
    from api.conversion.given_trajectories import to_trajectory
    from planner.operations import reverse_trajectory

    def run(request: Any, robot: Robot) -> CertifiedTrajectory:
        _, trajectory = to_trajectory(request.trajectory, robot, ("trajectory",))
        return reverse_trajectory(robot, trajectory, **_kept(request))

    return _answer(work, schemas.ReverseRequest, run)


def slice_trajectory(work: Work) -> Reply:
    """Answer POST /v1/trajectories/slice."""
    from api.conversion.given_trajectories import to_trajectory
    from planner.operations import slice_trajectory

    def run(request: Any, robot: Robot) -> CertifiedTrajectory:
        _, trajectory = to_trajectory(request.trajectory, robot, ("trajectory",))
        return slice_trajectory(robot, trajectory, request.start, request.end, **_kept(request))

    return _answer(work, schemas.SliceRequest, run)


def join_trajectories(work: Work) -> Reply:
    """Answer POST /v1/trajectories/join."""
    from api.conversion.given_trajectories import to_trajectory
    from planner.operations import join_trajectories

    def run(request: Any, robot: Robot) -> CertifiedTrajectory:
        trajectories = [
            to_trajectory(given, robot, ("trajectories", k))[1] for k, given in enumerate(request.trajectories)
        ]
        return join_trajectories(robot, trajectories, tolerance=request.tolerance, **_kept(request))

    return _answer(work, schemas.JoinRequest, run)


def retime_trajectory(work: Work) -> Reply:
    """Answer POST /v1/trajectories/retime."""
    return _answer(work, schemas.RetimeRequest, _retime, is_kept_clear=True)


def _retime(request: schemas.RetimeRequest, robot: Robot) -> CertifiedTrajectory:
    """Put time on points, or on the positions of a trajectory."""
    import numpy as np

    from api.conversion.given_trajectories import to_trajectory
    from api.conversion.problems import to_backend, to_limits, to_matrix
    from planner.errors import InvalidProblem
    from planner.operations import retime_trajectory

    if (request.points is None) == (request.trajectory is None):
        raise InvalidProblem([(("points",), "either points or a trajectory are needed")])
    if request.points is not None:
        points = to_matrix(request.points, robot.dof, ("points",))
    elif request.trajectory is not None:
        interpolation, trajectory = to_trajectory(request.trajectory, robot, ("trajectory",))
        even = np.linspace(0.0, trajectory.duration, POINTS_OF_POLYNOMIALS)
        (points,) = trajectory.evaluate(even if interpolation == "polynomials" else trajectory.breakpoints, [0])
    backend, limits = to_backend(request.backend), to_limits(request.limits)
    return retime_trajectory(
        robot, points, backend, max_deviation=request.max_deviation, limits=limits, **_surroundings(request, robot)
    )


def stop_trajectory(work: Work) -> Reply:
    """Answer POST /v1/trajectories/stop."""
    return _answer(work, schemas.StopRequest, _stop)


def _stop(request: schemas.StopRequest, robot: Robot) -> CertifiedTrajectory:
    """Stop on the path of a trajectory, or joint by joint."""
    import numpy as np

    from api.conversion.given_trajectories import to_trajectory
    from api.conversion.problems import to_vector
    from planner.errors import InvalidProblem
    from planner.operations import JointState, stop_joints, stop_on_path
    from planner.operations.certified import bounded_quantities

    given, state, time = request.trajectory, request.state, request.time
    if (given is None) == (state is None):
        raise InvalidProblem([(("state",), "either a state or a trajectory and a time are needed")])
    if (given is None) != (time is None):
        raise InvalidProblem([(("time",), "a trajectory needs a time, and a time needs a trajectory")])
    if given is not None and time is not None:
        _, trajectory = to_trajectory(given, robot, ("trajectory",))
        if request.mode != "joints":
            return stop_on_path(robot, trajectory, time, **_kept(request))
        if time > trajectory.duration:
            message = f"{time:g} s is not within the trajectory, which takes {trajectory.duration:g} s"
            raise InvalidProblem([(("time",), message)])
        kept = _kept(request)
        enforced = bounded_quantities([trajectory]) if request.enforced is None else request.enforced
        return stop_joints(robot, JointState(*trajectory.evaluate(time)), **kept | {"enforced": enforced})
    assert state is not None  # noqa: S101 - or there was a trajectory
    if request.mode == "on_path":
        raise InvalidProblem([(("trajectory",), "to stop on a path takes a trajectory")])
    position, velocity = (
        to_vector(getattr(state, name), robot.dof, ("state", name)) for name in ("position", "velocity")
    )
    acceleration = np.zeros(robot.dof)
    if state.acceleration is not None:
        acceleration = to_vector(state.acceleration, robot.dof, ("state", "acceleration"))
    return stop_joints(robot, JointState(position, velocity, acceleration), **_kept(request))


def resample_trajectory(work: Work) -> Reply:
    """Answer POST /v1/trajectories/resample."""
    from api.conversion.given_trajectories import to_trajectory
    from planner.errors import InvalidProblem
    from planner.export.json import operation_as_dict
    from planner.operations import kept_clear, resample_trajectory

    with work.stage("validate"):
        request = work.request(schemas.ResampleRequest)
        robot = _robot(work, request)
        if request.period is not None and request.times is not None:
            raise InvalidProblem([(("period",), "either a period or times are asked, not both")])
        _, trajectory = to_trajectory(request.trajectory, robot, ("trajectory",))
        period = request.period or DEFAULT_PERIOD
        if request.times is None:
            refuse_too_many_rows(trajectory.duration, period, robot.dof, work, "/period")
    with work.stage("plan"):
        done = resample_trajectory(robot, trajectory, request.times or period, **_kept(request))
        done = kept_clear(done, **_surroundings(request, robot))
        answer = operation_as_dict(done, done.time, request.include)
    return work.reply(answer)


def _answer(
    work: Work, schema: Any, run: Callable[[Any, Robot], CertifiedTrajectory], *, is_kept_clear: bool = False
) -> Reply:
    """Read the request, run an operation on it, and write its answer every `sample_period`.

    Args:
        work: The task.
        schema: That of the request.
        run: The operation on a request and its robot.
        is_kept_clear: Whether the operation proves clearances and speeds itself.
    """
    from planner.export.json import operation_as_dict
    from planner.operations import kept_clear

    with work.stage("validate"):
        request = work.request(schema)
        robot = _robot(work, request)
    with work.stage("plan"), acceptable_remedies(work, request, robot.dof):
        done = run(request, robot)
        done = done if is_kept_clear else kept_clear(done, **_surroundings(request, robot))
        refuse_too_many_rows(done.trajectory.duration, request.sample_period, robot.dof, work)
        answer = operation_as_dict(done, done.trajectory.sample_times(request.sample_period), request.include)
    return work.reply(answer)


def _surroundings(request: schemas.OperationRequest, robot: Robot) -> dict[str, Any]:
    """Return what the answer has to keep clear of, and how fast it may be there."""
    from api.conversion.problems import frames_in_world
    from api.conversion.scenes import to_scene, to_speed_zones

    scene = None if request.scene is None else to_scene(request.scene, frames_in_world(robot, {}))
    zones = to_speed_zones(request.speed_zones)
    return {"scene": scene, "self_collision": request.self_collision, "speed_zones": zones}


def _robot(work: Work, request: schemas.OperationRequest) -> Robot:
    """Return the robot of a request, with its tool, its mounting and what it carries."""
    from api.conversion.problems import mounted, to_payload, with_tool

    robot = mounted(with_tool(work.robot(request), request.tool), request.mounting)
    return robot if request.payload is None else robot.with_payload(to_payload(request.payload))


def _kept(request: schemas.EditRequest) -> dict[str, Any]:
    """Return what the answer has to keep."""
    from api.conversion.problems import to_limits

    return {"limits": to_limits(request.limits), "enforced": request.enforced}


THERE = {
    "time": [0.0, 0.5, 1.0],
    "position": [[0.1, 0.2, 0.3], [0.15, 0.2, 0.25], [0.2, 0.2, 0.2]],
    "velocity": [[0.0, 0.0, 0.0], [0.15, 0.0, -0.15], [0.0, 0.0, 0.0]],
}
"""Samples of a short motion of the arm with three joints."""

POST = {
    "id": "post",
    "shape": {"kind": "cylinder", "radius": 0.05, "length": 0.5},
    "pose": {"position": [0.45, 0.0, 0.0]},
}
"""A thing that stands beside its way."""

BACK = {
    "time": [0.0, 1.0],
    "position": [[0.2, 0.2, 0.2], [0.1, 0.2, 0.3]],
    "velocity": [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
}
"""Samples of the way back."""

CODES = (
    *BODY_CODES,
    "unknown_robot",
    "unknown_scene",
    "missing_dynamics",
    "limits_unsatisfiable",
    "start_in_collision",
    "collision",
    "clearance_unproved",
)
"""Codes of the problem documents that may be the answer to an operation instead."""

OPERATIONS = (
    Operation(
        id="retime_trajectory",
        method="POST",
        path="/v1/trajectories/retime",
        tag="trajectories",
        summary="Put time on a dense list of joint positions, smoothed within a tolerance.",
        description="The points may come from any planner; the answer says how far a joint goes from them, and runs "
        "from rest to rest. In `speed_zones` it is slowed.",
        run=retime_trajectory,
        request=schemas.RetimeRequest,
        answer=schemas.RetimeAnswer,
        shared=True,
        codes=(*CODES, "joint_position_limit", "infeasible_duration"),
        examples={
            "four_points": {
                "robot": "three_dof_arm",
                "points": [[0.1, 0.2, 0.3], [0.15, 0.2, 0.25], [0.2, 0.25, 0.2], [0.2, 0.3, 0.2]],
                "backend": {"kind": "toppra"},
                "max_deviation": 0.01,
                "sample_period": 0.5,
            },
            "slow_beside_a_post": {
                "robot": "three_dof_arm",
                "points": [[-0.8, 0.2, 0.3], [0.0, 0.25, 0.25], [0.7, 0.3, 0.2]],
                "scene": {"objects": [POST]},
                "speed_zones": [{"clearance": 0.2, "speed": 0.1}],
                "backend": {"kind": "quintic"},
                "max_deviation": 0.01,
                "sample_period": 1.0,
            },
        },
    ),
    Operation(
        id="stop_trajectory",
        method="POST",
        path="/v1/trajectories/stop",
        tag="trajectories",
        summary="Stop a motion as fast as the limits let it, on its path or off it.",
        description="The fastest stop within all limits of a trajectory at a time, or of a state of the joints. Where "
        "a joint cannot stop before a limit, the problem names it.",
        run=stop_trajectory,
        request=schemas.StopRequest,
        answer=schemas.OperationAnswer,
        shared=True,
        codes=(*CODES, "joint_position_limit"),
        examples={
            "on_the_path": {
                "robot": "three_dof_arm",
                "trajectory": {"samples": THERE},
                "time": 0.4,
                "sample_period": 0.25,
            },
            "from_a_state": {
                "robot": "three_dof_arm",
                "state": {"position": [0.1, 0.2, 0.3], "velocity": [0.1, 0.0, -0.2]},
                "sample_period": 0.25,
            },
        },
    ),
    Operation(
        id="reverse_trajectory",
        method="POST",
        path="/v1/trajectories/reverse",
        tag="trajectories",
        summary="Run a trajectory backwards, with the same timing.",
        description="Positions are those of the trajectory from its end to its start, velocities have the opposite "
        "sign.",
        run=reverse_trajectory,
        request=schemas.ReverseRequest,
        answer=schemas.OperationAnswer,
        shared=True,
        codes=CODES,
        examples={
            "the_way_back": {"robot": "three_dof_arm", "trajectory": {"samples": THERE}, "sample_period": 0.25},
        },
    ),
    Operation(
        id="slice_trajectory",
        method="POST",
        path="/v1/trajectories/slice",
        tag="trajectories",
        summary="Cut out the part of a trajectory between two times.",
        description="Its polynomials stay exact. A part that begins or ends in motion says so in `initial`, `final` "
        "and a warning.",
        run=slice_trajectory,
        request=schemas.SliceRequest,
        answer=schemas.OperationAnswer,
        shared=True,
        codes=CODES,
        examples={
            "from_the_middle_on": {
                "robot": "three_dof_arm",
                "trajectory": {"samples": THERE},
                "start": 0.5,
                "sample_period": 0.25,
            },
        },
    ),
    Operation(
        id="join_trajectories",
        method="POST",
        path="/v1/trajectories/join",
        tag="trajectories",
        summary="Run trajectories one after the other, which have to meet.",
        description="Each begins where the one before ends, in position and velocity; where they do not meet, the "
        "problem says by how much.",
        run=join_trajectories,
        request=schemas.JoinRequest,
        answer=schemas.JoinAnswer,
        shared=True,
        codes=CODES,
        examples={
            "there_and_back": {
                "robot": "three_dof_arm",
                "trajectories": [{"samples": THERE}, {"samples": BACK}],
                "sample_period": 0.25,
            },
        },
    ),
    Operation(
        id="resample_trajectory",
        method="POST",
        path="/v1/trajectories/resample",
        tag="trajectories",
        summary="Sample a trajectory again, with its derivatives, as the controller runs it.",
        description="At another period, or at times of your own.",
        run=resample_trajectory,
        request=schemas.ResampleRequest,
        answer=schemas.OperationAnswer,
        shared=True,
        codes=CODES,
        examples={
            "every_250_ms": {
                "robot": "three_dof_arm",
                "trajectory": {"samples": THERE, "interpolation": "cubic"},
                "period": 0.25,
            },
        },
    ),
)
"""The operations on trajectories."""
