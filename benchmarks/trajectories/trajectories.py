"""Trajectories: fixed lists of waypoints through every back end, beside the peers that are installed.

Every solver gets the same joint waypoints and the same limits, the robot's own but for torques, one list after the
other in one process. All answers are judged alike, by samples. Velocities and accelerations are compared
at 10,000 instants. The jerk comes from differences of these accelerations, so that a jump counts. Each waypoint has the
distance at which it is passed. Compute times are the processor's, without
imports and first calls. They depend little on other programs. Ours include the certificate, which the others do not
have.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.machine import machine
from benchmarks.trajectories.peers import PEERS, Motion
from planner.backends import Cubic, MinEffort, Quintic, Ruckig, Toppra, Trapezoidal
from planner.backends.base import enforced
from planner.errors import PlanningError
from planner.planning import plan
from planner.problems.problem import JointWaypoint, PlanningProblem
from planner.problems.transitions import ThroughTransition
from planner.robots import Robot, catalogue_ids, load_robot

if TYPE_CHECKING:
    from benchmarks.trajectories.peers import Solver
    from planner.backends import BackEnd
    from planner.spatial import FloatArray

SIX_JOINTS = "kuka_kr16_l6_2"
SEVEN_JOINTS, WITHOUT_IT = "panda", "date_sorting_arm"
"""An arm of the catalogue, where its package is there, and the one that is used otherwise."""

OURS: dict[str, BackEnd] = {
    "cubic": Cubic(),
    "quintic": Quintic(),
    "trapezoidal": Trapezoidal(),
    "ruckig": Ruckig(),
    "toppra": Toppra(),
    "toppra, jerk_limited": Toppra(jerk_limited=True),
    "min_effort": MinEffort(knots=16),
}
"""Every back end but `auto`, which only chooses one of these."""

REFERENCE = "toppra"
"""Durations are relative to the durations of this one."""

SLOW, MOST_FOR_SLOW, EVERY_FOR_SLOW = "min_effort", 6, 4
"""A back end that minimises something else than time and takes longer: of the lists with so few waypoints, every so
many."""

SAMPLES = 10_000
KEPT = 1.0 + 1e-6
"""Share of a limit up to which it counts as kept."""

APPROACHES = 25
"""Steps towards the instant at which a waypoint is nearest; each at least halves the distance in time."""

QUANTITIES = ("velocity", "acceleration", "jerk")


@dataclass(frozen=True, eq=False)
class Case:
    """A list of waypoints.

    Attributes:
        robot: With the limits.
        positions: (N, joints), rad or m.
    """

    robot: Robot
    positions: FloatArray


def measure(count: int) -> dict[str, Any]:
    """Return durations, use of the limits, errors at the waypoints and compute times of every solver; SI units."""
    where = machine()
    seven = SEVEN_JOINTS if SEVEN_JOINTS in catalogue_ids() else WITHOUT_IT
    lists = cases((arm(SIX_JOINTS), arm(seven)), count)
    absent = [name for name, peer in PEERS.items() if not peer.installed]
    if seven != SEVEN_JOINTS:
        absent.append(f"the arm {SEVEN_JOINTS}: its package example-robot-data; {seven} was taken instead")
    return {
        "machine": where,
        "lists": count,
        "arms": [SIX_JOINTS, seven],
        "absent": absent,
        "transitions": {transition: _measure_all(lists, transition) for transition in ("through", "stop")},
    }


def arm(name: str) -> Robot:
    """Return an arm of the catalogue without torque limits, which the other libraries do not know."""
    robot = load_robot(name)
    return replace(robot, joints=tuple(replace(joint, torque=np.inf) for joint in robot.joints))


def cases(robots: tuple[Robot, ...], count: int) -> list[Case]:
    """Return the lists: 2 to 50 waypoints, half at most 10, near or far apart, the robots by turns.

    A smaller count gives the first ones of the same lists.
    """
    return [_case(robots[i % len(robots)], np.random.default_rng(i)) for i in range(count)]


def _case(robot: Robot, rng: np.random.Generator) -> Case:
    lower, upper = np.maximum(robot.limit("lower"), -np.pi), np.minimum(robot.limit("upper"), np.pi)
    middle, half = 0.5 * (lower + upper), 0.35 * (upper - lower)
    number, stride = int(2.0 * 25.5 ** rng.uniform()), float(rng.uniform(0.05, 1.0))
    positions = [rng.uniform(-1.0, 1.0, robot.dof)]
    while len(positions) < number:
        there = positions[-1] + stride * rng.uniform(-1.0, 1.0, robot.dof)
        positions.append(np.where(np.abs(there) > 1.0, np.sign(there) * 2.0 - there, there))
    return Case(robot, middle + half * np.array(positions))


def _measure_all(lists: list[Case], transition: str) -> dict[str, Any]:
    robots = {case.robot.id: case.robot for case in lists}
    solvers: dict[str, tuple[frozenset[str], dict[str, Solver]]] = {}
    for name, backend in OURS.items():
        made = {key: _planner(robot, backend, transition) for key, robot in robots.items()}
        solvers[f"our {name}"] = (enforced(backend), made)
    for name, peer in PEERS.items():
        # One that stops is also what passing waypoints is compared with.
        if peer.installed and (peer.stops or transition == "through"):
            made = {key: peer.solver(robot) for key, robot in robots.items()}
            solvers[name] = (frozenset(peer.promises), made)
    few = [k for k, case in enumerate(lists) if len(case.positions) <= MOST_FOR_SLOW][::EVERY_FOR_SLOW]
    rows: dict[str, list[dict[str, Any] | None]] = {name: [] for name in solvers}
    for name, (_, made) in solvers.items():
        for case in lists[: len(robots)]:  # imports and first calls are not timed
            if SLOW not in name or few:
                made[case.robot.id](case.positions[:3])
    for k, case in enumerate(lists):
        for name, (_, made) in solvers.items():
            asked = SLOW not in name or k in few
            rows[name].append(_judge(case, made[case.robot.id]) if asked else None)
    reference = rows[f"our {REFERENCE}"]
    return {name: _summary(rows[name], reference, promised) for name, (promised, _) in solvers.items()}


def _planner(robot: Robot, backend: BackEnd, transition: str) -> Solver:
    def solve(positions: FloatArray) -> Motion | None:
        first, *inner, last = (JointWaypoint(position=tuple(q)) for q in positions.tolist())
        if transition == "through":
            inner = [replace(waypoint, transition=ThroughTransition()) for waypoint in inner]
        try:
            trajectory = plan(PlanningProblem(robot, (first, *inner, last)), backend).trajectory
        except PlanningError:
            return None

        def sample(times: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
            q, dq, ddq = trajectory.evaluate(times)
            return q, dq, ddq

        return Motion(trajectory.duration, sample)

    return solve


def _judge(case: Case, solve: Solver) -> dict[str, Any]:
    """Return one answer to one list; without a duration where there was none."""
    start = time.process_time()
    motion = solve(case.positions)
    judged: dict[str, Any] = {"waypoints": len(case.positions), "compute": time.process_time() - start}
    if motion is None:
        return judged
    times = np.linspace(0.0, motion.duration, SAMPLES)
    q, dq, ddq = motion.sample(times)
    jerk = np.diff(ddq, axis=0) / (times[1] - times[0])
    use = {
        quantity: float((np.abs(values) / case.robot.limit(quantity)).max())
        for quantity, values in zip(QUANTITIES, (dq, ddq, jerk), strict=True)
    }
    lower, upper = case.robot.limit("lower"), case.robot.limit("upper")
    outside = bool(((q < lower - 1e-6) | (q > upper + 1e-6)).any())
    error = _waypoint_error(case.positions, motion, times, q)
    return judged | {"duration": motion.duration, "use": use, "outside": outside, "waypoint_error": error}


def _waypoint_error(positions: FloatArray, motion: Motion, times: FloatArray, q: FloatArray) -> float:
    """Return the largest distance in any joint of a waypoint from the nearest point of the motion.

    From the nearest sample on, it makes Gauss-Newton steps in time, no longer than the sample period. The result is
    exact where a waypoint is met, and otherwise to the motion between two samples.
    """
    nearest = np.array([np.abs(q - position).max(axis=1).argmin() for position in positions])
    t, least, step = times[nearest], np.full(len(positions), np.inf), times[1] - times[0]
    for _ in range(APPROACHES):
        here, rate, _ = motion.sample(t)
        away = here - positions
        least = np.minimum(least, np.abs(away).max(axis=1))
        change = -(away * rate).sum(axis=1) / np.maximum((rate * rate).sum(axis=1), np.finfo(float).tiny)
        t = np.clip(t + np.clip(change, -step, step), 0.0, motion.duration)
    return float(least.max())


def _summary(
    rows: list[dict[str, Any] | None], reference: list[dict[str, Any] | None], promised: frozenset[str]
) -> dict[str, Any]:
    asked = [row for row in rows if row is not None]
    solved = [row for row in asked if "duration" in row]
    ratios = [
        row["duration"] / best["duration"]
        for row, best in zip(rows, reference, strict=True)
        if row and best and "duration" in row and "duration" in best
    ]
    kept = [quantity for quantity in QUANTITIES if quantity in promised]
    worst = [max((row["use"][quantity] for quantity in kept), default=0.0) for row in solved]
    return {
        "asked": len(asked),
        "refused": len(asked) - len(solved),
        "promised": kept,
        "duration_ratio": _quantiles(ratios),
        "worst": {quantity: max((row["use"][quantity] for row in solved), default=None) for quantity in QUANTITIES},
        "over_limit": sum(use > KEPT for use in worst),
        "outside": sum(row["outside"] for row in solved),
        "waypoint_error": max((row["waypoint_error"] for row in solved), default=None),
        "compute": _quantiles([row["compute"] for row in solved]),
        "rows": rows,
    }


def _quantiles(values: list[float]) -> dict[str, float] | None:
    """Return least, median, 99 of 100 and largest; None of no values."""
    if not values:
        return None
    least, p50, p99, most = np.quantile(values, [0.0, 0.5, 0.99, 1.0]).tolist()
    return {"least": least, "p50": p50, "p99": p99, "most": most}
