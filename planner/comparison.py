"""The same problem through several back ends, and the figures by which the plans are compared."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from planner.backends import BackEnd, as_backend
from planner.constraints import TOTAL_POWER, Bounds
from planner.constraints.bounded import bounded_peaks
from planner.constraints.peaks import SampledConstraints
from planner.errors import PlanningError
from planner.kinematics.forward import tool_pose
from planner.planning import plan
from planner.plans.result import Plan
from planner.problems.problem import PlanningProblem
from planner.robots import Robot
from planner.spatial import FloatArray
from planner.trajectories.extrema import derivatives_on_unit_time, largest_magnitude
from planner.trajectories.integrals import Nodes
from planner.trajectories.sampled_peaks import DERIVATIVES

PATH_SAMPLES = 120
"""The number of samples of a segment at which the tool's way is compared."""


@dataclass(frozen=True)
class Figures:
    """The figures by which plans are compared.

    Attributes:
        duration: Time from start to end, s.
        peak_jerk: Largest |jerk| of any joint, rad/s^3 or m/s^3; infinite where an acceleration jumps.
        rms_jerk: Root of the mean over time of the sum over joints of jerk^2; infinite where an acceleration jumps.
        effort: Integral over time of the sum over joints of (torque / limit)^2, s; None: torques are unknown, or no
            joint has a torque limit. A longer trajectory has more of it: compare it at equal durations.
        mean_effort: The effort divided by the duration, for comparing trajectories of different durations.
        mechanical_energy: Integral over time of the sum over joints of |torque times velocity|, J; None: unknown.
        peak_power: Largest magnitude of the mechanical power of all joints together, W, as a bound at all times; None:
            torques are unknown.
        rms_torque: Root of the mean over time of the squared torque of each joint, N m or N; None: torques are unknown.
        waypoint_error: Largest deviation of a joint from a waypoint that the trajectory must reach, rad or m.
        path_deviation: Largest distance of the tool from its path with a stop at every waypoint, m. That path consists
            of its lines and circles, and of straight joint motions. Accurate to about 1e-4 of a segment's length.
    """

    duration: float
    peak_jerk: float
    rms_jerk: float
    effort: float | None
    mean_effort: float | None
    mechanical_energy: float | None
    peak_power: float | None
    rms_torque: tuple[float, ...] | None
    waypoint_error: float
    path_deviation: float


@dataclass(frozen=True, eq=False)
class Comparison:
    """The outcome of one back end for a problem: a plan and its figures, or a refusal.

    Attributes:
        backend: The back end, with its options.
        plan: The certified plan; None: the back end refuses.
        figures: The figures of the plan; None: the back end refuses.
        refusal: The refusal; None: there is a plan.
    """

    backend: BackEnd
    plan: Plan | None = None
    figures: Figures | None = None
    refusal: PlanningError | None = None


def compare(problem: PlanningProblem, backends: Iterable[BackEnd | str]) -> list[Comparison]:
    """Plan a problem with several back ends, side by side.

    Args:
        problem: The robot, the waypoints and the limits.
        backends: The back ends, or their kinds.

    Returns:
        One comparison for each back end, in their order.
    """
    return [_compared(problem, as_backend(backend)) for backend in backends]


def _compared(problem: PlanningProblem, backend: BackEnd) -> Comparison:
    """Plan a problem with one back end."""
    try:
        solved = plan(problem, backend)
    except PlanningError as refusal:
        return Comparison(backend, refusal=refusal)
    return Comparison(backend, solved, figures(solved))


def figures(plan: Plan) -> Figures:
    """Compute the figures of a plan."""
    trajectory, robot = plan.trajectory, plan.path.robot
    weights, segments, (q, dq, ddq, jerk) = Nodes.of(trajectory)
    effort = energy = power = rms = None
    if plan.path.dynamics.has_dynamics:
        torque = plan.path.dynamics.torques(segments, q, dq, ddq)
        energy = float(weights @ np.abs(torque * dq).sum(axis=1))
        power = _peak_power(plan)
        rms = tuple(np.sqrt(weights @ torque**2 / trajectory.duration).tolist())
        limit = plan.path.limits.torque.narrower[segments]
        if np.isfinite(limit).any():
            effort = float(weights @ ((torque / limit) ** 2).sum(axis=1))
    peak_jerk = rms_jerk = np.inf
    if all(check.bounded for check in plan.certificate.checks if check.quantity == "jerk"):
        jerks = derivatives_on_unit_time(trajectory, 4)[3]
        *_, peak_jerk = largest_magnitude(jerks, np.ones((len(trajectory.lengths), robot.dof)))
        rms_jerk = float(np.sqrt(weights @ (jerk**2).sum(axis=1) / trajectory.duration))
    return Figures(
        duration=trajectory.duration,
        peak_jerk=abs(peak_jerk),
        rms_jerk=rms_jerk,
        effort=effort,
        mean_effort=None if effort is None else effort / trajectory.duration,
        mechanical_energy=energy,
        peak_power=power,
        rms_torque=rms,
        waypoint_error=plan.certificate.waypoint_error,
        path_deviation=_path_deviation(plan),
    )


def _peak_power(plan: Plan) -> float:
    """Return a bound on the magnitude of the power of all joints together, W."""
    trajectory, dynamics = plan.trajectory, plan.path.dynamics
    rows = int(trajectory.segments.max()) + 1
    limited = SampledConstraints(dynamics, [(TOTAL_POWER, Bounds.of_magnitudes(np.ones((rows, 1))))], rows)
    derivatives = derivatives_on_unit_time(trajectory, DERIVATIVES)
    return float(bounded_peaks(limited, trajectory.segments, derivatives, trajectory.lengths).bound[0])


def _path_deviation(plan: Plan) -> float:
    """Return the largest distance of the tool, m, from where it goes when it stops at every waypoint."""
    trajectory, path = plan.trajectory, plan.path
    worst = 0.0
    for segment, motion in enumerate(path.tool_motions):
        if segment in path.rides:
            continue  # its path is that of the object
        robot = path.dynamics.robot_on(segment)
        times = np.linspace(trajectory.arrivals[segment], trajectory.arrivals[segment + 1], PATH_SAMPLES)
        tools = _tools(robot, trajectory.evaluate(times, [0])[0])
        share = np.linspace(0.0, 1.0, PATH_SAMPLES)
        if motion is not None:
            planned = np.array([motion.pose(u).position for u in share])
        else:
            start, end = path.positions[segment], path.positions[segment + 1]
            planned = _tools(robot, start + share[:, None] * (end - start))
        worst = max(worst, *(_distance_to_line(point, planned) for point in tools))
    return worst


def _tools(robot: Robot, positions: FloatArray) -> FloatArray:
    """Return the positions (N, 3) of the tool, m, at joint positions (N, joints)."""
    return np.array([tool_pose(robot, q).position for q in positions])


def _distance_to_line(point: FloatArray, corners: FloatArray) -> float:
    """Return the distance of a point (3,) from the polygon through the corners (N, 3)."""
    ways = np.diff(corners, axis=0)
    squared = np.maximum((ways**2).sum(axis=1), np.finfo(float).tiny)
    share = np.clip(((point - corners[:-1]) * ways).sum(axis=1) / squared, 0.0, 1.0)
    return float(np.linalg.norm(corners[:-1] + share[:, None] * ways - point, axis=1).min())
