"""Inverse kinematics: random reachable poses of six arms, solved by this library and by the peers that are installed.

Every solver gets the same poses, one at a time in one process, and the same limits. A pose counts as solved when the
answer lies within the limits and Pinocchio's forward kinematics find it within 1e-6 m and 1e-6 rad. It also measures
all solutions of one pose and of twenty poses at once, and the choice of branches for twenty poses.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import numpy as np
import pinocchio as pin

from benchmarks.kinematics.check import check
from benchmarks.machine import machine
from benchmarks.plain_urdf import joints_of, plain_urdf
from planner.errors import PlanningError
from planner.kinematics import (
    FloatArray,
    Pose,
    all_solutions,
    forward_kinematics,
    inverse_kinematics,
    pose_errors,
    solution_layers,
)
from planner.kinematics.descent import seed_table
from planner.kinematics.options import InverseKinematicsOptions
from planner.problems.problem import PoseWaypoint
from planner.robots import Robot, catalogue_ids, load_robot
from planner.waypoints.solve import solve_waypoints

ARMS = ("panda", "ur5", "xarm7", "kuka_kr16_l6_2", "ngv_refuelling_arm", "date_sorting_arm")
TOLERANCE = 1e-6
"""m and rad."""

ROUNDING = 1e-9
"""rad or m, by which a peer may leave the limits."""

SEQUENCE = 20
"""Poses of a sequence whose branches are chosen together."""

Solver = Callable[[Pose], FloatArray | None]
OPTIONS = InverseKinematicsOptions(TOLERANCE, TOLERANCE)


def measure(poses: int, checks: int) -> dict[str, Any]:
    """Return rates, times (s) and residuals of every solver on every arm."""
    where = machine()
    arms = [arm for arm in ARMS if arm in catalogue_ids()]
    absent = [f"the arm {arm}: its package example-robot-data" for arm in ARMS if arm not in arms]
    absent += [name for name, (module, _) in PEERS.items() if module is not None and find_spec(module) is None]
    return {
        "machine": where,
        "poses": poses,
        "checks": checks,
        "absent": absent,
        "arms": {arm: _measure_arm(load_robot(arm), poses, checks // len(arms)) for arm in arms},
    }


def _measure_arm(robot: Robot, count: int, checks: int) -> dict[str, Any]:
    prepared, _ = _timed(seed_table, robot)
    low, high = np.maximum(robot.limit("lower"), -np.pi), np.minimum(robot.limit("upper"), np.pi)
    wanted = forward_kinematics(robot, np.random.default_rng(0).uniform(low, high, (count, robot.dof)))
    solvers = {
        name: _measure_solver(robot, wanted, solve)
        for name, (module, make) in PEERS.items()
        if (module is None or find_spec(module) is not None) and (solve := make(robot)) is not None
    }
    every = [_timed(lambda pose: all_solutions(robot, pose, OPTIONS), pose)[0] for pose in wanted[: count // 10]]
    lists = [wanted[i : i + SEQUENCE] for i in range(0, max(count // 2, SEQUENCE), SEQUENCE)]
    layers = [_timed(lambda poses: solution_layers(robot, poses, OPTIONS), poses)[0] for poses in lists]
    return {
        "prepare": prepared,
        "solvers": solvers,
        "all_solutions": _times(every),
        "layers": _times(layers),
        "sequence": _measure_sequences(robot, lists),
        "check": check(robot, checks, seed=0),
    }


def _measure_sequences(robot: Robot, lists: list[list[Pose]]) -> dict[str, Any]:
    times, refused = [], 0
    for poses in lists:
        start = time.perf_counter()
        try:
            solve_waypoints(robot, tuple(PoseWaypoint(pose=pose) for pose in poses), OPTIONS)
        except PlanningError:
            refused += 1
        times.append(time.perf_counter() - start)
    return {"count": len(lists), "refused": refused, **_times(times)}


def _measure_solver(robot: Robot, wanted: list[Pose], solve: Solver) -> dict[str, Any]:
    lower, upper = robot.limit("lower") - ROUNDING, robot.limit("upper") + ROUNDING
    times, residuals, wrong = [], [], 0
    for pose in wanted:
        elapsed, q = _timed(solve, pose)
        times.append(elapsed)
        if q is None:
            continue
        distance, angle = pose_errors(pose, forward_kinematics(robot, q[None])[0])
        residual = max(distance, angle or 0.0)
        if residual <= TOLERANCE and (q >= lower).all() and (q <= upper).all():
            residuals.append(residual)
        else:
            wrong += 1
    return {
        "solved": len(residuals) / len(wanted),
        "wrong": wrong,
        "worst_residual": max(residuals, default=None),
        **_times(times),
    }


def _timed(function: Callable[[Any], Any], argument: Any) -> tuple[float, Any]:
    start = time.perf_counter()
    answer = function(argument)
    return time.perf_counter() - start, answer


def _times(times: list[float]) -> dict[str, float]:
    p50, p99 = np.quantile(times, [0.5, 0.99]).tolist()
    return {"mean": float(np.mean(times)), "p50": p50, "p99": p99}


def _planner(robot: Robot) -> Solver:
    def solve(pose: Pose) -> FloatArray | None:
        result = inverse_kinematics(robot, pose, OPTIONS)
        return result.position if result.status == "solved" else None

    return solve


def _damped_least_squares(robot: Robot) -> Solver:
    """Return the loop of Pinocchio's own example, with a clip to the limits and ten random starts."""
    model, data, frame = robot.model, robot.data, robot.tool_frame_id
    lower, upper = robot.limit("lower"), robot.limit("upper")
    low, high = np.maximum(lower, -np.pi), np.minimum(upper, np.pi)
    rng = np.random.default_rng(1)

    def solve(pose: Pose) -> FloatArray | None:
        target = pin.SE3(pose.rotation, pose.position)
        for _ in range(10):
            q = rng.uniform(low, high)
            for _ in range(100):
                pin.forwardKinematics(model, data, q)
                error = pin.log6(pin.updateFramePlacement(model, data, frame).actInv(target)).vector
                if np.linalg.norm(error) < 0.1 * TOLERANCE:
                    return np.asarray(q)
                J = pin.computeFrameJacobian(model, data, q, frame, pin.ReferenceFrame.LOCAL)
                q = np.clip(q + J.T @ np.linalg.solve(J @ J.T + 1e-6 * np.eye(6), error), lower, upper)
        return None

    return solve


def _optik(robot: Robot) -> Solver | None:
    if not robot.is_angle.all():
        return None  # it aborts the process at a prismatic joint
    import optik

    with tempfile.NamedTemporaryFile("w", suffix=".urdf") as file:
        file.write(plain_urdf(robot))
        file.flush()
        arm = optik.Robot.from_urdf_file(file.name, "link_0", "tool")
    arm.set_parallelism(1)
    # tol_f bounds the squared error: well below the tolerance's square.
    config = optik.SolverConfig(solution_mode="speed", max_time=0.1, tol_f=1e-14)
    rng, (lower, upper) = np.random.default_rng(1), arm.joint_limits()

    def solve(pose: Pose) -> FloatArray | None:
        target = pin.SE3(pose.rotation, pose.position).homogeneous
        answer = arm.ik(config, target, rng.uniform(lower, upper))
        return None if answer is None else np.array(answer[0])

    return solve


def _robotics_toolbox(robot: Robot) -> Solver:
    from roboticstoolbox import ET, ETS

    terms = []
    for joint, axis, placement in joints_of(robot):
        turn = pin.SE3(pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), axis).matrix(), np.zeros(3))
        limits = np.clip([joint.lower, joint.upper], -np.pi, np.pi)
        moving = ET.Rz(qlim=limits) if joint.is_angle else ET.tz(qlim=limits)
        terms += [ET.SE3((placement * turn).homogeneous), moving, ET.SE3(turn.inverse().homogeneous)]
    terms.append(ET.SE3(robot.model.frames[robot.tool_frame_id].placement.homogeneous))
    chain = ETS(terms)

    def solve(pose: Pose) -> FloatArray | None:
        target = pin.SE3(pose.rotation, pose.position).homogeneous
        # The tolerance bounds half the squared error.
        answer = chain.ik_LM(target, tol=1e-13, joint_limits=True)
        return np.array(answer.q) if answer.success else None

    return solve


PEERS: dict[str, tuple[str | None, Callable[[Robot], Solver | None]]] = {
    "planner": (None, _planner),
    "Pinocchio, damped least squares": (None, _damped_least_squares),
    "optik-py": ("optik", _optik),
    "roboticstoolbox-python (C++)": ("roboticstoolbox", _robotics_toolbox),
}
"""Module that a solver needs besides this library, and what makes it; None: there is none for such a robot."""
