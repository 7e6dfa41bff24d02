"""Operations on trajectories of any origin: reverse, slice, join, resample."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from api.schemas import trajectory_operations as schemas
from api.tasks.operation import BODY_CODES, Operation
from api.tasks.trajectories import refuse_too_many_rows

if TYPE_CHECKING:
    from collections.abc import Callable

    from api.messages import Reply
    from api.tasks.work import Work
    from planner.operations import CertifiedTrajectory
    from planner.robots import Robot

DEFAULT_PERIOD = 0.01
"""The time between two rows of an answer that asks for neither a period nor times, s."""


def reverse_trajectory(work: Work) -> Reply:
    """Answer POST /v1/trajectories/reverse."""
    from api.given_trajectories import to_trajectory
    from planner.operations import reverse_trajectory

    def run(request: Any, robot: Robot) -> CertifiedTrajectory:
        _, trajectory = to_trajectory(request.trajectory, robot, ("trajectory",))
        return reverse_trajectory(robot, trajectory, **_kept(request))

    return _answer(work, schemas.ReverseRequest, run)


def slice_trajectory(work: Work) -> Reply:
    """Answer POST /v1/trajectories/slice."""
    from api.given_trajectories import to_trajectory
    from planner.operations import slice_trajectory

    def run(request: Any, robot: Robot) -> CertifiedTrajectory:
        _, trajectory = to_trajectory(request.trajectory, robot, ("trajectory",))
        return slice_trajectory(robot, trajectory, request.start, request.end, **_kept(request))

    return _answer(work, schemas.SliceRequest, run)


def join_trajectories(work: Work) -> Reply:
    """Answer POST /v1/trajectories/join."""
    from api.given_trajectories import to_trajectory
    from planner.operations import join_trajectories

    def run(request: Any, robot: Robot) -> CertifiedTrajectory:
        trajectories = [
            to_trajectory(given, robot, ("trajectories", k))[1] for k, given in enumerate(request.trajectories)
        ]
        return join_trajectories(robot, trajectories, tolerance=request.tolerance, **_kept(request))

    return _answer(work, schemas.JoinRequest, run)


def resample_trajectory(work: Work) -> Reply:
    """Answer POST /v1/trajectories/resample."""
    from api.given_trajectories import to_trajectory
    from planner.errors import InvalidProblem
    from planner.export.json import operation_as_dict
    from planner.operations import resample_trajectory

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
        answer = operation_as_dict(done, done.time, request.include)
    return work.reply(answer)


def _answer(work: Work, schema: Any, run: Callable[[Any, Robot], CertifiedTrajectory]) -> Reply:
    """Read the request, run an operation on it, and write its answer every `sample_period`."""
    from planner.export.json import operation_as_dict

    with work.stage("validate"):
        request = work.request(schema)
        robot = _robot(work, request)
    with work.stage("plan"):
        done = run(request, robot)
        refuse_too_many_rows(done.trajectory.duration, request.sample_period, robot.dof, work)
        answer = operation_as_dict(done, done.trajectory.sample_times(request.sample_period), request.include)
    return work.reply(answer)


def _robot(work: Work, request: schemas.OperationRequest) -> Robot:
    """Return the robot of a request, with its tool, its mounting and what it carries."""
    from api.conversion import mounted, to_payload, with_tool

    robot = mounted(with_tool(work.robot(request), request.tool), request.mounting)
    return robot if request.payload is None else robot.with_payload(to_payload(request.payload))


def _kept(request: schemas.EditRequest) -> dict[str, Any]:
    """Return what the answer has to keep."""
    from api.conversion import to_limits

    return {"limits": to_limits(request.limits), "enforced": request.enforced}


THERE = {
    "time": [0.0, 0.5, 1.0],
    "position": [[0.1, 0.2, 0.3], [0.15, 0.2, 0.25], [0.2, 0.2, 0.2]],
    "velocity": [[0.0, 0.0, 0.0], [0.15, 0.0, -0.15], [0.0, 0.0, 0.0]],
}
"""Samples of a short motion of the arm with three joints."""

BACK = {
    "time": [0.0, 1.0],
    "position": [[0.2, 0.2, 0.2], [0.1, 0.2, 0.3]],
    "velocity": [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
}
"""Samples of the way back."""

CODES = (*BODY_CODES, "unknown_robot", "missing_dynamics", "limits_unsatisfiable")
"""Codes of the problem documents that may be the answer to an operation instead."""

OPERATIONS = (
    Operation(
        id="reverse_trajectory",
        method="POST",
        path="/v1/trajectories/reverse",
        tag="trajectories",
        summary="Run a trajectory backwards, with the same timing.",
        run=reverse_trajectory,
        request=schemas.ReverseRequest,
        answer=schemas.OperationAnswer,
        codes=CODES,
        examples={"the_way_back": {"robot": "three_dof_arm", "trajectory": {"samples": THERE}}},
    ),
    Operation(
        id="slice_trajectory",
        method="POST",
        path="/v1/trajectories/slice",
        tag="trajectories",
        summary="Cut out the part of a trajectory between two times.",
        run=slice_trajectory,
        request=schemas.SliceRequest,
        answer=schemas.OperationAnswer,
        codes=CODES,
        examples={
            "from_the_middle_on": {"robot": "three_dof_arm", "trajectory": {"samples": THERE}, "start": 0.5},
        },
    ),
    Operation(
        id="join_trajectories",
        method="POST",
        path="/v1/trajectories/join",
        tag="trajectories",
        summary="Run trajectories one after the other, which have to meet.",
        run=join_trajectories,
        request=schemas.JoinRequest,
        answer=schemas.JoinAnswer,
        codes=CODES,
        examples={
            "there_and_back": {"robot": "three_dof_arm", "trajectories": [{"samples": THERE}, {"samples": BACK}]},
        },
    ),
    Operation(
        id="resample_trajectory",
        method="POST",
        path="/v1/trajectories/resample",
        tag="trajectories",
        summary="Sample a trajectory again, with its derivatives, as the controller runs it.",
        run=resample_trajectory,
        request=schemas.ResampleRequest,
        answer=schemas.OperationAnswer,
        codes=CODES,
        examples={
            "at_250_hz": {
                "robot": "three_dof_arm",
                "trajectory": {"samples": THERE, "interpolation": "cubic"},
                "period": 0.004,
            },
        },
    ),
)
"""The operations on trajectories."""
