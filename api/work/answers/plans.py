"""Answers for plans and for operations on trajectories."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from api.work.answers.values import choice_answer, pose_answer
from planner.certificate import worst_overshoot
from planner.constraints import VELOCITY_AT_POSITION
from planner.dynamics import SegmentDynamics
from planner.export import ExportOptions
from planner.free_motion import last_of
from planner.kinematics import configurations, manipulability
from planner.operations import JoinedTrajectory, RetimedTrajectory
from planner.plans.tool_reports import line_polynomials, tool_speed_reports
from planner.problems import as_requested, region_of
from planner.problems.actions import SetOutput
from planner.problems.problem import PoseWaypoint, ViaWaypoint
from planner.proofs import write_proof
from planner.trajectories.trajectory import PlanWarning

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from planner.certificate.sampling import SampleCertificate
    from planner.operations import CertifiedTrajectory
    from planner.plans.optimisation import Optimisation
    from planner.plans.result import Plan
    from planner.plans.tool_reports import LinePolynomial
    from planner.problems.problem import AnyWaypoint
    from planner.samples import Samples
    from planner.spatial import FloatArray, Pose
    from planner.timing.action_times import TimedAction
    from planner.trajectories.trajectory import Trajectory


@dataclass(frozen=True)
class AnswerOptions(ExportOptions):
    """The options of the answer for a plan.

    Attributes:
        request_hash: Hash of the request that the answer quotes; None: none.
    """

    request_hash: str | None = None


def as_dict(plan: Plan, options: AnswerOptions) -> dict[str, Any]:
    """Return the answer as plain values and numpy arrays."""
    robot, trajectory = plan.path.robot, plan.trajectory
    samples = plan.samples(options.sample_period, options.include)
    with_tools, rows = SegmentDynamics.of_robots(plan.problem.robots), np.arange(len(plan.path.positions))
    numbers, requested = plan.problem.numbers, plan.requested_indices
    measured = with_tools.by_robot(lambda *states: (manipulability(*states),), rows, plan.path.positions)
    manipulabilities = measured[0].tolist()
    answer: dict[str, Any] = {
        "robot": robot.id,
        "joint_names": robot.joint_names,
        "backend": plan.backend.kind,
        "solver": trajectory.solver,
        "duration": trajectory.duration,
        "samples": _rows(samples),
        "waypoints": [
            {
                "index": requested[i],
                "name": waypoint.name,
                "arrival_time": float(trajectory.arrivals[i]),
                "departure_time": float(trajectory.departures[i]),
                "position": waypoint.position,
                "pose": pose_answer(waypoint.pose),
                "position_error": waypoint.position_error,
                "orientation_error": waypoint.orientation_error,
                "solutions": waypoint.solutions,
                "solution": waypoint.solution,
                "choice": waypoint.choice,
                "configuration": vars(configuration),
                "manipulability": manipulabilities[i],
            }
            | _in_its_region(as_requested(plan.problem.waypoints[i]), waypoint.pose)
            | _gained(plan, i, numbers[i])
            for i, (waypoint, configuration) in enumerate(
                zip(plan.path.waypoints, configurations(robot, plan.path.positions), strict=True)
            )
        ],
        "certificate": plan.certificate.as_dict(),
        "warnings": [
            {"code": warning.code, "message": warning.message}
            for warning in (*plan.warnings, *_sample_warnings(plan, samples, options.sample_period))
        ],
    }
    if plan.choices:
        answer["choices"] = list(map(choice_answer, plan.choices))
    if plan.optimisation is not None:
        answer["optimisation"] = _optimisation(plan, plan.optimisation)
    if plan.rides:
        answer["rides"] = [vars(ride) for ride in plan.rides]
    if plan.problem.actions:
        answer["actions"] = list(map(_action, plan.actions))
    if "polynomials" in options.include:
        answer["polynomials"] = _polynomials(robot.joint_names, trajectory)
    if "tcp_polynomials" in options.include:
        answer["tcp_polynomials"] = [_line_polynomial(line) for line in line_polynomials(plan)]
    if "tcp_speed_report" in options.include:
        answer["tcp_speed_report"] = [
            {**vars(report), "slow": list(map(vars, report.slow))} for report in tool_speed_reports(plan)
        ]
    if "limits" in options.include:
        answer["limits"] = _limits(plan, samples)
    if "proof" in options.include:
        answer["proof"] = write_proof(plan)
    if "sample_checks" in options.include:
        answer["sample_checks"] = _sample_checks(plan.certify_samples(samples.time))
    if options.request_hash is not None:
        answer["request_hash"] = options.request_hash
    return answer


def operation_as_dict(done: CertifiedTrajectory, time: FloatArray, include: Collection[str]) -> dict[str, Any]:
    """Return the answer of an operation on trajectories as plain values and numpy arrays.

    Args:
        done: The result of the operation.
        time: (N,), s, strictly increasing, the times of its samples.
        include: Parts to be written besides: columns of the samples, `polynomials`, `sample_checks`.

    Raises:
        InvalidProblem: `include` has `sample_checks`, but the samples do not cover the whole trajectory.
    """
    robot, trajectory = done.robot, done.trajectory
    answer: dict[str, Any] = {
        "robot": robot.id,
        "joint_names": robot.joint_names,
        "duration": trajectory.duration,
        "initial": vars(done.initial),
        "final": vars(done.final),
        "samples": _rows(done.samples(time, include)),
        "certificate": done.certificate.as_dict(),
        "warnings": [vars(warning) for warning in done.warnings],
    }
    if isinstance(done, RetimedTrajectory):
        answer |= {"backend": done.backend.kind, "solver": trajectory.solver, "deviation": done.deviation}
    if isinstance(done, JoinedTrajectory):
        answer["junctions"] = [vars(junction) for junction in done.junctions]
    if "polynomials" in include:
        answer["polynomials"] = _polynomials(robot.joint_names, trajectory)
    if "sample_checks" in include:
        answer["sample_checks"] = _sample_checks(done.certify_samples(time))
    return answer


def _sample_checks(checked: list[SampleCertificate]) -> list[dict[str, Any]]:
    return [{"interpolation": one.interpolation, **one.certificate.as_dict()} for one in checked]


def _in_its_region(asked: AnyWaypoint, reached: Pose) -> dict[str, Any]:
    """Return where in its region a waypoint is; nothing if nothing of it is left open."""
    if not (isinstance(asked, PoseWaypoint) and asked.free):
        return {}
    return {"free": region_of(asked.free).offsets(asked.pose_in_base, reached)}


def _optimisation(plan: Plan, report: Optimisation) -> dict[str, Any]:
    """Return the gain of the optimisation of the duration, with the indices of the request."""
    requested = [plan.requested_indices[last_of(plan.problem, k)] for k in range(plan.problem.numbers[-1] + 1)]
    return {
        "first": report.first,
        "last": report.last,
        "iterates": report.iterates,
        "moved": [requested[k] for k in sorted(report.moved)],
        "blends": [{"waypoint": requested[k], "radius": radius} for k, radius in sorted(report.radii.items())],
    }


def _gained(plan: Plan, waypoint: int, asked: int) -> dict[str, Any]:
    """Return the gain of improving a detour; nothing for corners, or without an optimisation."""
    if isinstance(plan.problem.waypoints[waypoint], ViaWaypoint):
        return {}
    gain = next((detour.gain for detour in plan.detours if detour.waypoint == asked), None)
    return {} if gain is None else {"gain": vars(gain)}


def _rows(samples: Samples) -> dict[str, Any]:
    """Return the samples in the form of the answer."""
    rows: dict[str, Any] = {
        "time": samples.time,
        "position": samples.position,
        "velocity": samples.velocity,
        "acceleration": samples.acceleration,
        "segment": samples.segment,
    }
    if samples.jerk is not None:
        rows["jerk"] = samples.jerk
    if samples.torque is not None:
        rows["torque"] = samples.torque
    if samples.tcp_position is not None:
        rows["tcp_pose"] = {"position": samples.tcp_position, "quaternion_xyzw": samples.tcp_quaternion}
    if samples.tcp_rpy is not None:
        rows["tcp_rpy"] = samples.tcp_rpy
    for name, rates in (("tcp_velocity", samples.tcp_velocity), ("tcp_acceleration", samples.tcp_acceleration)):
        if rates is not None:
            rows[name] = dict(zip(("linear", "angular"), rates, strict=True))
    return rows


def _sample_warnings(plan: Plan, samples: Samples, period: float) -> Iterator[PlanWarning]:
    """Yield warnings of limits that a controller would exceed between samples too far apart."""
    smooth = any(check.quantity == "jerk" and check.bounded for check in plan.certificate.checks)
    continuous = ("velocity", "acceleration") if smooth else ("velocity",)
    trajectory, limits = plan.trajectory, plan.path.limits
    worst = worst_overshoot(trajectory, limits, samples.time, samples.position, samples.velocity, continuous)
    if worst is not None:
        yield PlanWarning(
            "samples_overshoot",
            f"the samples are {period:g} s apart: a controller that runs cubics through them reaches "
            f"{worst.ratio:.4g} times the {worst.quantity} limit of {plan.path.robot.joint_names[worst.joint]} "
            f"at {worst.time:.4g} s; ask for a shorter sample period",
        )


def _polynomials(joint_names: tuple[str, ...], trajectory: Trajectory) -> list[dict[str, Any]]:
    return [
        {
            "joint": name,
            "breakpoints": trajectory.breakpoints,
            "coefficients": trajectory.coefficients[:, j].tolist(),
        }
        for j, name in enumerate(joint_names)
    ]


def _limits(plan: Plan, samples: Samples) -> dict[str, Any]:
    """Return the limits of each segment, and state-dependent limits at each sample; infinite ones become null."""
    limits = plan.path.limits
    lower, upper = (np.broadcast_to(side, limits.torque.upper.shape).copy() for side in limits.position)
    written: dict[str, Any] = {"position": {"lower": lower, "upper": upper}}
    for quantity in ("velocity", "acceleration", "jerk", "torque"):
        bounds = limits.bounds(quantity)
        written[quantity] = {"lower": bounds.lower.copy(), "upper": bounds.upper.copy()}
    written |= {"tool": dict(limits.of_tool)}
    if VELOCITY_AT_POSITION in limits.further:
        bounds = limits.velocity_at(plan.path.robot, samples.segment, samples.position)
        written |= {"at_samples": {"velocity": {"lower": bounds.lower, "upper": bounds.upper}}}
    return written


def _action(timed: TimedAction) -> dict[str, Any]:
    action = timed.action
    if isinstance(action, SetOutput):
        own: dict[str, Any] = {"kind": "set_output", "name": action.name, "value": action.value}
    else:
        own = {"kind": "wait", "duration": action.duration}
    return {"index": timed.index, "time": timed.time, "distance": timed.distance, **own}


def _line_polynomial(line: LinePolynomial) -> dict[str, Any]:
    return {
        "segment": line.segment,
        "breakpoints": line.breakpoints,
        "path_parameter": line.path_parameter.tolist(),
        **{axis: line.position[:, k].tolist() for k, axis in enumerate("xyz")},
        "deviation": line.deviation,
    }
