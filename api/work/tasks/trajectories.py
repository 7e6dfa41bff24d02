"""Trajectories: plan, compare back ends, validate; and the back ends that there are."""

from __future__ import annotations

import math
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import orjson

from api.base.errors import InvalidRequest, invalid_at
from api.base.size import rows_of
from api.contract import requests
from api.contract.comparisons import ComparedBackend
from api.contract.parts.backends import backend_schemas
from api.pool.messages import PlanFigures, Reply
from api.store.contents.digests import request_hash
from api.work.answers.clearances import proved_clearance
from api.work.answers.formats import FORMATS
from api.work.answers.negotiation import negotiated
from api.work.answers.plans import AnswerOptions, as_dict
from api.work.answers.problem_documents import problem_document
from api.work.answers.views import VIEWS, View
from api.work.conversion.given_trajectories import to_trajectory
from api.work.conversion.problems import (
    frames_in_world,
    to_backend,
    to_end_states,
    to_limits,
    to_planning_problem,
    to_residual_vibration,
)
from api.work.conversion.scenes import kept_roadmap, to_scene, to_speed_zones
from api.work.conversion.time_budgets import attempts_until, within_deadline
from api.work.tasks.context import task
from api.work.tasks.remedies import acceptable_remedies, at_back_end
from planner.backends import BACKENDS
from planner.certificate import (
    CLEARANCE_TOLERANCE,
    certify_interpolation,
    certify_polynomials,
    certify_residual_vibration,
    certify_speed_zones,
    refuse_zone_faults,
)
from planner.comparison import figures
from planner.errors import PlanningError
from planner.free_motion.roadmaps import is_current
from planner.operations import trajectory_warnings
from planner.planning import plan
from planner.plots import joint_indices
from planner.scene import CollisionChecker

if TYPE_CHECKING:
    from collections.abc import Iterable

    from api.work.answers.formats import Format
    from api.work.tasks.context import TaskContext
    from planner.certificate.checks import Certificate
    from planner.comparison import Figures
    from planner.plans.result import Plan
    from planner.problems.problem import PlanningProblem
    from planner.robots import Robot
    from planner.trajectories.trajectory import PlanWarning, Trajectory


@task("plan_trajectory")
def plan_trajectory(context: TaskContext) -> Reply:
    """Answer POST /v1/trajectories."""
    forms: dict[str, Format | View] = {**FORMATS, **VIEWS}
    with context.stage("validate"):
        form = negotiated(context.arguments["format"], context.arguments["accept"], forms)
        request = context.request(requests.PlanRequest)
        asked, backend = to_planning_problem(request, context.robot(request)), to_backend(request.backend)
        asked = with_roadmap(asked, context.arguments.get("roadmap"))
        options = options_of(request, asked, context)
        if request.picture is not None and request.picture.joints is not None:
            joint_indices(asked.robot, request.picture.joints, ("picture", "joints"))
    with context.stage("plan"), acceptable_remedies(context, request, asked.robot.dof):
        solved = plan(within_deadline(asked, context.task.deadline), backend, attempts_until(context.task.deadline))
    refuse_too_many_rows(solved.trajectory.duration, request.sample_period, solved.path.robot.dof, context)
    with context.stage("serialise"):
        if isinstance(form, View):
            asked_for = request.model_dump(mode="json", by_alias=True, exclude_unset=True)
            body = form.draw(solved, asked_for, options.request_hash, f"{request.robot}, {solved.backend.kind}")
        else:
            body = form.render(solved, options)
    return Reply(200, form.media_type, body, context.timings, plan=figures_of(solved))


def figures_of(solved: Plan) -> PlanFigures:
    """Return the figures of a plan for the metrics."""
    checks = (check for check in solved.certificate.checks if check.enforced)
    ratios = {check.quantity: float(check.ratio) for check in checks if check.ratio is not None}
    return PlanFigures(solved.backend.kind, ratios)


@task("export_trajectory")
def export_trajectory(context: TaskContext) -> Reply:
    """Answer POST /v1/trajectories/export."""
    name = context.arguments["format"]
    if name is None:
        raise invalid_at("", "The parameter `format` must be given.")
    reply = plan_trajectory(context)

    suffix = FORMATS[name].suffix if name in FORMATS else VIEWS[name].suffix
    headers = {"Content-Disposition": f'attachment; filename="trajectory{suffix}"'}
    return replace(reply, media_type="application/octet-stream", headers=headers)


@task("compare_backends")
def compare_backend(context: TaskContext) -> Reply:
    """Answer for one back end of POST /v1/trajectories/compare, the one at the argument `index`."""
    with context.stage("validate"):
        asked = context.request(requests.CompareRequest)
        shared = {name: getattr(asked, name) for name in requests.TrajectoryRequest.model_fields}
        index = context.arguments["index"]
        request = requests.PlanRequest.model_construct(backend=asked.backends[index], **shared)
        robot = context.robot(request)
    entry: dict[str, Any] = dict.fromkeys(ComparedBackend.model_fields)
    entry["backend"] = request.backend.kind
    try:
        with context.stage("plan"), acceptable_remedies(context, asked, robot.dof), at_back_end(index):
            problem = with_roadmap(to_planning_problem(request, robot), context.arguments.get("roadmap"))
            problem = within_deadline(problem, context.task.deadline)
            solved = plan(problem, to_backend(request.backend), attempts_until(context.task.deadline))
            refuse_too_many_rows(solved.trajectory.duration, request.sample_period, solved.path.robot.dof, context)
    except (PlanningError, InvalidRequest) as error:
        _, body = problem_document(error, context.task.instance)
        return context.reply(entry | {"status": error.code, "problem": orjson.Fragment(body)})
    with context.stage("serialise"):
        trajectory = as_dict(solved, options_of(request, problem, context))
        return context.reply(entry | _compared(figures(solved)) | {"status": "planned", "trajectory": trajectory})


def _compared(found: Figures) -> dict[str, Any]:
    """Return figures in plain values: JSON has no infinite ones."""
    bounded = math.isfinite(found.peak_jerk)
    unbounded = {} if bounded else {"peak_jerk": None, "rms_jerk": None}
    return asdict(found) | unbounded | {"jerk_is_bounded": bounded}


@task("validate_trajectory")
def validate_trajectory(context: TaskContext) -> Reply:
    """Answer POST /v1/trajectories/validate."""
    with context.stage("validate"):
        request = context.request(requests.ValidateRequest)
        robot = context.robot(request)
    with context.stage("plan"):
        found = validation_of(request, robot)
        answer = {"interpolation": found.interpolation, **found.certificate.as_dict(), **found.further}
    return context.reply(answer | {"warnings": list(map(vars, found.warnings))})


class Validation(NamedTuple):
    """What holds of the trajectory of a request.

    Attributes:
        interpolation: How its samples are read.
        certificate: With the scene and the speed zones of the request.
        further: With these, the fields `clearance` and `collision` of the answer.
        warnings: The warnings of the trajectory, besides the certificate.
    """

    interpolation: requests.Interpolation
    certificate: Certificate
    further: dict[str, Any]
    warnings: Iterable[PlanWarning]


def validation_of(request: requests.ValidateRequest, robot: Robot) -> Validation:
    """Check the trajectory of a request against everything that it names.

    Raises:
        InvalidProblem: It lacks columns to check, or makes no trajectory of the robot, or its scene is at fault.
    """
    interpolation, trajectory = to_trajectory(request, robot)
    certificate = _certified(request, robot, interpolation, trajectory)
    further: dict[str, Any] = {}
    if request.scene is not None or request.self_collision or request.speed_zones:
        certificate, further = _kept_clear(request, robot, trajectory, certificate)
    warnings = trajectory_warnings(robot, certificate, to_end_states(request, robot.dof))
    return Validation(interpolation, certificate, further, warnings)


def _kept_clear(
    request: requests.ValidateRequest, robot: Robot, trajectory: Trajectory, certificate: Certificate
) -> tuple[Certificate, dict[str, Any]]:
    """Check the trajectory of a request against its scene.

    Returns:
        The certificate with it, and the fields of the answer that a certificate does not have.
    """
    scene = None if request.scene is None else to_scene(request.scene, frames_in_world(robot, {}))
    zones = to_speed_zones(request.speed_zones)
    refuse_zone_faults(scene, zones)
    checker = CollisionChecker(robot, scene, self_collision=request.self_collision)
    report, collision = proved_clearance(checker, trajectory, CLEARANCE_TOLERANCE)
    checks = certify_speed_zones(zones, [checker], [robot], trajectory)
    certificate = replace(
        certificate,
        satisfied=certificate.satisfied and collision is None and all(check.satisfied for check in checks),
        clearance=report,
        speed_zones=checks,
    )
    return certificate, {"clearance": None if report is None else report.as_dict(), "collision": collision}


def _certified(
    request: requests.ValidateRequest, robot: Robot, interpolation: requests.Interpolation, trajectory: Trajectory
) -> Certificate:
    """Hold the trajectory of a request against its limits."""
    limits, ends = to_limits(request.limits), to_end_states(request, robot.dof)
    if interpolation == "polynomials":
        certificate = certify_polynomials(robot, trajectory, limits=limits, ends=ends)
    else:
        certificate = certify_interpolation(robot, trajectory, interpolation, limits, ends)
    if (mode := to_residual_vibration(request.residual_vibration)) is None:
        return certificate
    around = ends.initial_velocity, ends.final_velocity
    left = certify_residual_vibration(mode, robot.joint_names, [trajectory], trajectory.breakpoints[-1:], around)
    return replace(certificate, checks=(*certificate.checks, *left))


@task("list_backends")
def list_backends(context: TaskContext) -> Reply:
    """Answer GET /v1/backends."""
    descriptions = []
    for kind, backend in BACKENDS.items():
        options = backend_schemas()[kind].model_json_schema()["properties"]
        del options["kind"]
        guarantees = dict(backend.guarantees)
        descriptions.append(
            {"kind": kind, "summary": backend.summary, "options": options, "guarantees": guarantees},
        )
    return context.reply({"backends": descriptions})


def with_roadmap(problem: PlanningProblem, content: bytes | None) -> PlanningProblem:
    """Let free motions be searched on the roadmap in these bytes, if it fits robot and scene."""
    roadmap = kept_roadmap(content)
    fits = roadmap is not None and is_current(roadmap, problem.robot, problem.scene, problem.self_collision)
    return replace(problem, roadmap=roadmap) if fits else problem


def options_of(request: requests.PlanRequest, problem: PlanningProblem, context: TaskContext) -> AnswerOptions:
    """Make the options of an answer to a plan request with its problem."""
    roadmap = None if problem.roadmap is None else context.arguments["roadmap"]
    return export_options(request, context.arguments.get("definition"), roadmap)


def export_options(
    request: requests.PlanRequest, definition: bytes | None, roadmap: bytes | None = None
) -> AnswerOptions:
    """Make the options of an answer to a request.

    Args:
        request: The request.
        definition: The definition of the added robot that it names; None: it names none.
        roadmap: The bytes of the roadmap on which free motions are searched; None: there is none.
    """
    quoted = request_hash(request, definition, roadmap)
    return AnswerOptions(request.sample_period, frozenset(request.include), request.repeat, quoted)


def refuse_too_many_rows(
    duration: float, period: float, dof: int, context: TaskContext, field: str = "/sample_period"
) -> None:
    """Refuse to write more than an answer may hold.

    Raises:
        InvalidRequest: A trajectory of this duration, s, has too many rows at this period, s, which the field asks.
    """
    rows = rows_of(duration, period)
    if rows * dof > context.caps.max_samples:
        limit = f"must be longer: {rows} rows of {dof} joints exceed the {context.caps.max_samples} values of an answer"
        raise invalid_at(field, limit)
