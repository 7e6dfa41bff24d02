"""The operations that workers run: validate, convert, call the library, serialise."""

from __future__ import annotations

import hashlib
import math
import time
from contextlib import contextmanager
from dataclasses import asdict, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import orjson
from pydantic import BaseModel, TypeAdapter, ValidationError

from api.conversion import (
    to_backend,
    to_limits,
    to_matrix,
    to_options,
    to_payload,
    to_pose,
    to_problem,
    to_robot,
    to_vector,
    to_waypoints,
    with_tool,
)
from api.errors import CatalogueRobot, invalid_request, problem
from api.kinematics_answers import nearest_answer, reachability_answer, solutions_answer
from api.schemas.answers import ComparedBackend
from api.schemas.dynamics import InverseDynamicsRequest
from api.schemas.kinematics import (
    ForwardKinematicsRequest,
    InverseKinematicsRequest,
    JacobianRequest,
    ReachabilityRequest,
    WorkspaceRequest,
)
from api.schemas.requests import CompareRequest, PlanRequest, TrajectoryRequest, ValidateRequest
from api.schemas.robots import RobotDefinition, RobotModel
from api.store import RobotContent
from api.worker_main import Caps, Reply, Task
from planner.backends import BACKENDS
from planner.certificate.samples import certify_samples
from planner.comparison import figures
from planner.dynamics import inverse_dynamics
from planner.errors import InvalidProblem, PlanningError
from planner.export import FORMATS, ExportOptions
from planner.export.json import as_dict
from planner.kinematics import (
    forward_kinematics,
    inverse_kinematics,
    jacobian,
    manipulability,
    poses_as_dicts,
    singular_values,
    solutions_or_failure,
    with_whole_turns,
    workspace,
)
from planner.kinematics.options import InverseKinematicsOptions
from planner.planning import plan
from planner.robots import Robot, catalogue_ids, describe, load_robot
from planner.waypoints.reachability import reachability

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from planner.result import Plan


JSON = "application/json"
CACHED_ROBOTS = 32
"""Robots from definitions that one worker keeps built."""

MOST_SOLUTIONS = 64
"""Solutions of one pose in an answer."""

T = TypeVar("T")


class Stopwatch:
    """Times of the stages of one task, s."""

    def __init__(self) -> None:
        self.timings: dict[str, float] = {}

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time what is done inside."""
        start = time.monotonic()
        yield
        self.timings[name] = time.monotonic() - start


def plan_trajectory(task: Task, caps: Caps) -> Reply:
    """POST /v1/trajectories."""
    watch = Stopwatch()
    with watch.stage("validate"):
        request = _validate(PlanRequest, task.body)
        _check_caps(request, caps, waypoints=request.waypoints)
        asked, backend = to_problem(request, _robot(request.robot, task)), to_backend(request.backend)
        quoted = request_hash(request)
    with watch.stage("plan"):
        solved = plan(asked, backend)
    _check_rows(request, solved, caps)
    form = FORMATS[task.arguments["format"]]
    with watch.stage("serialise"):
        options = ExportOptions(request.sample_period, frozenset(request.include), quoted)
        body = form.render(solved, options)
    return Reply(200, form.media_type, body, watch.timings)


def compare_backend(task: Task, caps: Caps) -> Reply:
    """One back end of POST /v1/trajectories/compare: its entry in the results."""
    watch = Stopwatch()
    with watch.stage("validate"):
        asked = _validate(CompareRequest, task.body)
        _check_caps(asked, caps, waypoints=asked.waypoints)
        shared = {name: getattr(asked, name) for name in TrajectoryRequest.model_fields}
        request = PlanRequest.model_construct(backend=asked.backends[task.arguments["index"]], **shared)
        robot = _robot(request.robot, task)
    entry: dict[str, Any] = dict.fromkeys(ComparedBackend.model_fields)
    entry["backend"] = request.backend.kind
    try:
        with watch.stage("plan"):
            solved = plan(to_problem(request, robot), to_backend(request.backend))
            _check_rows(request, solved, caps)
    except PlanningError as error:
        _, body = problem(error, task.instance)
        return _json(entry | {"status": error.code, "problem": orjson.loads(body)}, watch)
    with watch.stage("serialise"):
        options = ExportOptions(request.sample_period, frozenset(request.include), request_hash(request))
        entry |= asdict(figures(solved)) | {"status": "planned", "trajectory": as_dict(solved, options)}
        return _json(entry, watch)


def validate_trajectory(task: Task, caps: Caps) -> Reply:
    """POST /v1/trajectories/validate."""
    watch = Stopwatch()
    with watch.stage("validate"):
        request = _validate(ValidateRequest, task.body)
        _check_caps(request, caps)
        robot, samples = _robot(request.robot, task), request.samples
        times, position = np.array(samples.time), to_matrix(samples.position, robot.dof, "/samples/position")
        velocity, acceleration = (
            None if values is None else to_matrix(values, robot.dof, f"/samples/{name}")
            for name, values in (("velocity", samples.velocity), ("acceleration", samples.acceleration))
        )
    with watch.stage("plan"):
        limits = to_limits(request.limits)
        certificate = certify_samples(robot, limits, times, position, velocity, acceleration)
    return _json(certificate.as_dict(), watch)


def run_forward_kinematics(task: Task, caps: Caps) -> Reply:
    """POST /v1/kinematics/forward."""
    watch = Stopwatch()
    with watch.stage("validate"):
        request = _validate(ForwardKinematicsRequest, task.body)
        _check_caps(request, caps)
        robot = with_tool(_robot(request.robot, task), request.tool)
        positions = to_matrix(request.positions, robot.dof, "/positions")
    with watch.stage("plan"):
        poses = forward_kinematics(robot, positions)
    return _json({"poses": poses_as_dicts(poses)}, watch)


def run_inverse_kinematics(task: Task, caps: Caps) -> Reply:
    """POST /v1/kinematics/inverse."""
    watch = Stopwatch()
    with watch.stage("validate"):
        request = _validate(InverseKinematicsRequest, task.body)
        _check_caps(request, caps, poses=request.poses)
        robot = with_tool(_robot(request.robot, task), request.tool)
        reference = None
        if request.reference is not None:
            reference = to_vector(request.reference, robot.dof, "/reference")
        options = InverseKinematicsOptions(request.tolerance_position, request.tolerance_orientation, seed=request.seed)
    with watch.stage("plan"):
        results: list[dict[str, Any]] = []
        for asked in request.poses:
            pose = to_pose(asked)
            if request.solutions == "all":
                near = robot.middle if reference is None else reference
                answer = solutions_or_failure(robot, pose, options, near)
                if isinstance(answer, tuple):
                    answer = with_whole_turns(robot, answer, near, MOST_SOLUTIONS)
            else:
                answer = inverse_kinematics(robot, pose, options, reference)
                if answer.status == "solved":
                    reference, answer = answer.position, (answer.position,)
            if not isinstance(answer, tuple):
                results.append({"status": answer.status, "solutions": [], "nearest": nearest_answer(answer)})
                continue
            solutions = solutions_answer(robot, pose, answer)
            results.append({"status": "solved", "solutions": solutions})
    return _json({"results": results}, watch)


def run_reachability(task: Task, caps: Caps) -> Reply:
    """POST /v1/kinematics/reachability."""
    watch = Stopwatch()
    with watch.stage("validate"):
        request = _validate(ReachabilityRequest, task.body)
        _check_caps(request, caps, waypoints=request.waypoints)
        robot = with_tool(_robot(request.robot, task), request.tool)
        waypoints, options = to_waypoints(request.waypoints), to_options(request.ik, request.seed)
    with watch.stage("plan"):
        found = reachability(robot, waypoints, options)
    return _json(reachability_answer(waypoints, found), watch)


def run_jacobian(task: Task, caps: Caps) -> Reply:
    """POST /v1/kinematics/jacobian."""
    watch = Stopwatch()
    with watch.stage("validate"):
        request = _validate(JacobianRequest, task.body)
        _check_caps(request, caps)
        robot = with_tool(_robot(request.robot, task), request.tool)
        position = to_vector(request.position, robot.dof, "/position")
    with watch.stage("plan"):
        answer = {
            "jacobian": jacobian(robot, position),
            "manipulability": manipulability(robot, position[None])[0],
            "singular_values": singular_values(robot, position[None])[0],
        }
    return _json(answer, watch)


def run_workspace(task: Task, caps: Caps) -> Reply:
    """POST /v1/kinematics/workspace."""
    watch = Stopwatch()
    with watch.stage("validate"):
        request = _validate(WorkspaceRequest, task.body)
        _check_caps(request, caps)
        if 3 * request.samples > caps.max_samples:
            limit = f"{request.samples} points of 3 values are more than the {caps.max_samples} values of an answer"
            raise InvalidProblem([("/samples", limit)])
        robot = with_tool(_robot(request.robot, task), request.tool)
    with watch.stage("plan"):
        found = workspace(robot, request.samples, request.seed)
    return _json(found, watch)


def run_inverse_dynamics(task: Task, caps: Caps) -> Reply:
    """POST /v1/dynamics/inverse."""
    watch = Stopwatch()
    with watch.stage("validate"):
        request = _validate(InverseDynamicsRequest, task.body)
        _check_caps(request, caps)
        robot = _robot(request.robot, task)
        if request.payload is not None:
            robot = robot.with_payload(to_payload(request.payload))
        positions = to_matrix(request.positions, robot.dof, "/positions")
        velocities, accelerations = (
            np.zeros_like(positions) if rows is None else to_matrix(rows, robot.dof, f"/{name}")
            for name, rows in (("velocities", request.velocities), ("accelerations", request.accelerations))
        )
        faults = [
            (f"/{name}", f"{len(rows)} rows for {len(positions)} positions")
            for name, rows in (("velocities", velocities), ("accelerations", accelerations))
            if len(rows) != len(positions)
        ]
        if faults:
            raise InvalidProblem(faults)
    with watch.stage("plan"):
        torques = inverse_dynamics(robot, positions, velocities, accelerations)
    return _json({"torques": torques}, watch)


def add_robot(task: Task, caps: Caps) -> Reply:
    """POST /v1/robots: read the model. The parent keeps the content that comes back in `result`."""
    watch = Stopwatch()
    with watch.stage("validate"):
        named = _validate(RobotDefinition, task.body)
        definition = _canonical(named, exclude={"id"})
        digest = _sha256(definition)
        robot_id = named.id or "dh_" + digest.removeprefix("sha256:")[:16]
        if robot_id in catalogue_ids():
            raise CatalogueRobot(f"{robot_id} is a robot of the catalogue; choose another id")
    with watch.stage("plan"):
        robot = to_robot(named, robot_id)
    description = describe(robot) | {"content": digest}
    answer = description | {"findings": [asdict(finding) for finding in robot.findings]}
    del description["id"]
    reply = _json(answer, watch, status=201)
    return Reply(
        reply.status,
        JSON,
        reply.body,
        reply.timings,
        headers={"Location": f"/v1/robots/{robot_id}"},
        result=(robot_id, RobotContent(digest, definition, _dump(description))),
    )


def list_robots(task: Task, caps: Caps) -> Reply:
    """GET /v1/robots; the argument `added` holds the descriptions of the added ones."""
    watch = Stopwatch()
    with watch.stage("plan"):
        robots = [*map(_described, catalogue_ids()), *map(orjson.Fragment, task.arguments["added"])]
    return _json({"robots": robots}, watch)


def get_robot(task: Task, caps: Caps) -> Reply:
    """GET /v1/robots/{id} of a catalogue robot."""
    watch = Stopwatch()
    with watch.stage("plan"):
        description = _described(task.arguments["id"])
    return _json(description, watch)


RUN: dict[str, Callable[[Task, Caps], Reply]] = {
    "plan_trajectory": plan_trajectory,
    "compare_backend": compare_backend,
    "validate_trajectory": validate_trajectory,
    "forward_kinematics": run_forward_kinematics,
    "inverse_kinematics": run_inverse_kinematics,
    "reachability": run_reachability,
    "jacobian": run_jacobian,
    "workspace": run_workspace,
    "inverse_dynamics": run_inverse_dynamics,
    "add_robot": add_robot,
    "list_robots": list_robots,
    "get_robot": get_robot,
}
"""What runs for each operation id."""


def warm_up(caps: Caps) -> None:
    """Plan once with every back end, so that no request pays for first-time work."""
    robot = load_robot(WARM_UP_ROBOT)
    positions = (robot.middle.tolist(), (robot.middle + 0.01).tolist())
    for kind in BACKENDS:
        body = orjson.dumps(
            {
                "robot": WARM_UP_ROBOT,
                "waypoints": [{"kind": "joint", "position": position} for position in positions],
                "backend": {"kind": kind},
            }
        )
        plan_trajectory(Task("plan_trajectory", "", 0.0, math.inf, body, {"format": "json"}), caps)


WARM_UP_ROBOT = "kuka_kr16_l6_2"
"""It has inertias, which one back end asks for."""

_adapters: dict[Any, TypeAdapter[Any]] = {}


def _validate(schema: Any, body: bytes) -> Any:
    if schema not in _adapters:
        _adapters[schema] = TypeAdapter(schema)
    try:
        return _adapters[schema].validate_json(body)
    except ValidationError as error:
        raise invalid_request(error, orjson.loads(body)) from None


def request_hash(request: BaseModel) -> str:
    """What an answer quotes its request by: the same for requests that differ only in notation."""
    return _sha256(_canonical(request))


def _sha256(content: bytes) -> str:
    return "sha256:" + hashlib.sha256(content).hexdigest()


def _canonical(request: BaseModel, exclude: set[str] | None = None) -> bytes:
    """The request with its defaults filled in, keys in the order of its schema."""
    return request.model_dump_json(exclude=exclude).encode()


def _check_caps(request: Any, caps: Caps, **lists: Sequence[Any]) -> None:
    faults = []
    if request.deadline > caps.max_deadline:
        faults.append(("/deadline", f"at most {caps.max_deadline:g} s"))
    for name, values in lists.items():
        if len(values) > caps.max_waypoints:
            faults.append((f"/{name}", f"{len(values)} are more than the {caps.max_waypoints} of a request"))
    if faults:
        raise InvalidProblem(faults)


def _check_rows(request: PlanRequest, solved: Plan, caps: Caps) -> None:
    rows, dof = math.ceil(solved.trajectory.duration / request.sample_period) + 1, solved.path.robot.dof
    if rows * dof > caps.max_samples:
        limit = f"{rows} rows of {dof} joints are more than the {caps.max_samples} values of an answer"
        raise InvalidProblem([("/sample_period", limit)])


def _robot(robot_id: str, task: Task) -> Robot:
    definition = task.arguments.get("definition")
    return load_robot(robot_id) if definition is None else _named(definition, robot_id)


@lru_cache(maxsize=CACHED_ROBOTS)
def _named(definition: bytes, robot_id: str) -> Robot:
    """The robot under one of its names, always the same object: what is prepared for it is prepared once."""
    return replace(_built(definition), id=robot_id)


@lru_cache(maxsize=CACHED_ROBOTS)
def _built(definition: bytes) -> Robot:
    """The robot of a definition. Kept by the definition itself: no name can bring back another robot's model."""
    return to_robot(_validate(RobotModel, definition), _sha256(definition))


@lru_cache(maxsize=1024)
def _described(robot_id: str) -> Any:
    return orjson.Fragment(_dump(describe(load_robot(robot_id)) | {"content": None}))


def _dump(value: Any) -> bytes:
    return orjson.dumps(value, option=orjson.OPT_SERIALIZE_NUMPY)


def _json(value: Any, watch: Stopwatch, status: int = 200) -> Reply:
    with watch.stage("serialise"):
        body = _dump(value)
    return Reply(status, JSON, body, watch.timings)
